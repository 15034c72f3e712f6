#pragma once

#include <string>
#include <utility>
#include <vector>

#include "reports/chart.h"

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

/// One panel per name of a panel, each with a line of slope 1 to compare with.
Chart growth_chart(const std::vector<GrowthCurve>& curves, const std::string& file, const std::string& title,
                   const std::string& x_label, const std::string& y_label);

}  // namespace ricochet
