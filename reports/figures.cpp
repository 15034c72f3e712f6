#include "reports/figures.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>

#include "problems/input_error.h"
#include "reports/gnuplot.h"
#include "reports/text_file.h"

namespace ricochet {

bool can_draw() {
  return std::system("gnuplot --version >/dev/null 2>&1") == 0;
}

FigureFolder::FigureFolder(std::string folder, bool with_pdf) : folder_(std::move(folder)), with_pdf_(with_pdf) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw InputError("report folder", folder_, error.message());
}

void FigureFolder::write(const std::string& name, const std::string& text) const {
  write_text("figure", std::filesystem::path(folder_) / name, text);
}

void FigureFolder::draw(const std::string& name, const std::string& script) const {
  if (with_pdf_) run(name, pdf_script(script));
  run(name, script);  // the one that stays
}

void FigureFolder::run(const std::string& name, const std::string& script) const {
  write(name + ".gp", script);
  const std::string command = fmt::format("cd '{}' && gnuplot '{}.gp' 2>'{}.log'", folder_, name, name);
  if (std::system(command.c_str()) != 0)
    throw InputError("figure", name, fmt::format("gnuplot failed, see {}/{}.log", folder_, name));
  std::filesystem::remove(std::filesystem::path(folder_) / (name + ".log"));
}

}  // namespace ricochet
