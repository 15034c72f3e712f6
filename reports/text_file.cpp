#include "reports/text_file.h"

#include <fstream>
#include <sstream>

#include "problems/input_error.h"

namespace ricochet {

std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  if (std::filesystem::exists(path)) throw InputError("file", path.string(), "it exists; a new file is required");
  std::ofstream file(path, std::ios::binary);
  const bool was_opened = file.is_open();
  file << text;
  file.close();
  if (file) return;
  std::error_code ignored;
  if (was_opened) std::filesystem::remove(path, ignored);
  throw InputError("file", path.string(), "it cannot be written");
}

}  // namespace ricochet
