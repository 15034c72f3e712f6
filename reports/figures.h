#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ricochet {

/// A figure that was drawn.
struct Figure {
  std::string file;  ///< SVG, relative to the report folder
  std::string title, caption;
  nlohmann::json motion = {};  ///< the row whose motion it shows, if it is a drawing of one
};

/// Folder into which figures are drawn: charts by gnuplot (reports/render/gnuplot.h), motions as our own SVG.
class FigureFolder {
 public:
  /// @param with_pdf  charts are drawn as PDF, too, for a paper
  /// @throws InputError if the folder cannot be written
  explicit FigureFolder(std::string folder, bool with_pdf = false);

  const std::string& path() const { return folder_; }
  bool with_pdf() const { return with_pdf_; }
  /// Writes a file of the folder. @throws InputError if it cannot be written
  void write(const std::string& file, const std::string& text) const;

 private:
  std::string folder_;
  bool with_pdf_;
};

}  // namespace ricochet
