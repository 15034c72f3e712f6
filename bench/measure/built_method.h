#pragma once

#include <string>

namespace ricochet {

/// Why the method of a `spec` is not in this program, "libode-dev not found"; empty where it is, or where no such method
/// is known.
std::string why_not_built(const std::string& spec);

}  // namespace ricochet
