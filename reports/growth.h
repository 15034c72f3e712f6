#pragma once

#include <string>
#include <utility>
#include <vector>

#include "reports/figures.h"
#include "reports/section.h"

namespace ricochet {

/// p of the least-squares line log y = c + p log x. NaN with fewer than 3 points. @param x, y  positive
double growth_exponent(const std::vector<double>& x, const std::vector<double>& y);

/// "n^1.05", "-" where there is no fit.
std::string growth_text(const std::string& n, const std::vector<double>& x, const std::vector<double>& y);

/// A curve of a figure on logarithmic axes.
struct GrowthCurve {
  std::string panel, name;
  std::vector<std::pair<double, double>> points;
};

/// One panel per name of a panel, each with a line of slope 1 to compare with, and one key below them: FILE_NAME.svg.
Figure draw_growth(const FigureFolder& folder, const std::vector<GrowthCurve>& curves, const std::string& file_name,
                   const std::string& title, const std::string& x_label, const std::string& y_label);

/// The same as a chart with its data. @param table  name of the table with its numbers
Section::Chart growth_chart(const std::vector<GrowthCurve>& curves, const std::string& file_name,
                            const std::string& title, const std::string& x_label, const std::string& y_label,
                            const std::string& table);

}  // namespace ricochet
