#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ricochet {

/// A figure that was drawn.
struct Figure {
  std::string file;  ///< SVG, relative to the report folder
  std::string title, caption;
  nlohmann::json motion = {};  ///< the row whose motion it shows, where it is one that is not drawn with gnuplot
};

/// Where figures are drawn, with gnuplot (Debian: gnuplot-nox), which writes SVG for log-log plots without further ado.
/// The gnuplot script of each figure stays beside it. Frames of a motion are SVG of our own.
class FigureFolder {
 public:
  /// @param with_pdf  what gnuplot draws is there as PDF, too, for a paper
  /// @throws InputError when the folder cannot be written
  explicit FigureFolder(std::string folder, bool with_pdf = false);

  /// Runs a script whose output is `name`.svg. @throws InputError when gnuplot fails
  void draw(const std::string& name, const std::string& script) const;
  /// A file of the folder. @throws InputError when it cannot be written
  void write(const std::string& file, const std::string& text) const;

 private:
  void run(const std::string& name, const std::string& script) const;

  std::string folder_;
  bool with_pdf_;
};

/// Whether gnuplot can be run.
bool can_draw();

}  // namespace ricochet
