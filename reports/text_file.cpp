#include "reports/text_file.h"

#include <fstream>
#include <sstream>

namespace ricochet {

std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace ricochet
