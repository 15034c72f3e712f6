#include "reports/figures.h"

#include <filesystem>

#include "problems/input_error.h"
#include "reports/text_file.h"

namespace ricochet {

FigureFolder::FigureFolder(std::string folder, bool with_pdf) : folder_(std::move(folder)), with_pdf_(with_pdf) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw InputError("report folder", folder_, error.message());
}

void FigureFolder::write(const std::string& file, const std::string& text) const {
  write_text("figure", std::filesystem::path(folder_) / file, text);
}

}  // namespace ricochet
