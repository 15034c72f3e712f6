#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/fuzzers/targets.h"

namespace ricochet::fuzzing {

std::string file_of(const std::string& text) {
  static const struct File {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("ricochet_fuzzed_" + std::to_string(::getpid()));
    ~File() { std::filesystem::remove(path); }
  } file;
  std::ofstream(file.path, std::ios::binary | std::ios::trunc) << text;
  return file.path;
}

}  // namespace ricochet::fuzzing
