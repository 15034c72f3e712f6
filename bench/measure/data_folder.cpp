#include "bench/measure/data_folder.h"

#include <cstdlib>
#include <filesystem>

namespace ricochet {

std::string data_folder() {
  namespace fs = std::filesystem;
  if (const char* const set = std::getenv("RICOCHET_DATA"); set && *set) return set;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = program.parent_path().parent_path() / "share" / "ricochet";
  if (!program.empty() && fs::is_directory(installed, error)) return installed;
  if (fs::is_directory(RICOCHET_SOURCE_DIR, error)) return RICOCHET_SOURCE_DIR;
  return "/usr/share/ricochet";  // where /proc is not mounted
}

std::string find_project_file(const std::string& path) {
  if (std::filesystem::exists(path)) return path;
  const std::filesystem::path in_data = std::filesystem::path(data_folder()) / path;
  return std::filesystem::exists(in_data) ? in_data.string() : path;
}

}  // namespace ricochet
