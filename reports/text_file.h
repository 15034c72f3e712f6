#pragma once

#include <filesystem>
#include <string>

namespace ricochet {

/// The bytes of a file; empty where it cannot be read.
std::string read_text(const std::filesystem::path& path);

}  // namespace ricochet
