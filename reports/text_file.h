#pragma once

#include <filesystem>
#include <string>

namespace ricochet {

/// The bytes of a file; empty where it cannot be read.
std::string read_text(const std::filesystem::path& path);

/// Makes a new file of the text; one that could not be written whole is removed again.
/// @throws InputError when there is one already, or it cannot be written
void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace ricochet
