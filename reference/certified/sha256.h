#pragma once

#include <string>
#include <string_view>

/// @file
/// SHA-256 of a text, as in FIPS 180-4: sha256().

namespace ricochet::reference::certified {

/// The hash of the bytes of a `text`, 64 hexadecimal digits in lower case.
std::string sha256(std::string_view text);

}  // namespace ricochet::reference::certified
