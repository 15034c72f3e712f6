#include "reports/order_fit.h"

#include <gsl/gsl_cdf.h>
#include <gsl/gsl_fit.h>

#include <cmath>

namespace ricochet {
namespace {

constexpr double kRounding = 1e-13;
constexpr int kFewest = 6;

}  // namespace

std::optional<OrderFit> fit_order(const std::vector<const Record*>& runs) {
  OrderFit fit;
  fit.attempted = static_cast<int>(runs.size());
  std::vector<const Record*> points;
  for (const Record* run : runs) {
    if (run->has_error() && run->error > 0) points.push_back(run);
  }
  std::size_t begin = 0, end = points.size();
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (points[k]->error >= kAsymptoticError * points[k]->solution_size) begin = k + 1;
  }
  for (std::size_t k = points.size(); k-- > begin;) {
    const double floor = std::max(points[k]->reference_error, kRounding * points[k]->solution_size);
    if (points[k]->error <= 10 * floor) end = k;
  }
  if (end < begin + kFewest) return std::nullopt;

  std::vector<double> x, y;
  for (std::size_t k = begin; k < end; ++k) {
    x.push_back(std::log10(points[k]->h_bar));
    y.push_back(std::log10(points[k]->error));
  }
  const auto n = x.size();
  double intercept = 0, c00 = 0, c01 = 0, c11 = 0, squares = 0;
  gsl_fit_linear(x.data(), 1, y.data(), 1, n, &intercept, &fit.slope, &c00, &c01, &c11, &squares);
  const auto freedom = static_cast<double>(n - 2);
  fit.half_width = gsl_cdf_tdist_Pinv(0.975, freedom) * std::sqrt(c11);
  fit.scatter = std::sqrt(squares / freedom);
  fit.first_steps = points[begin]->steps;
  fit.last_steps = points[end - 1]->steps;
  fit.used = static_cast<int>(n);
  return fit;
}

std::vector<std::optional<double>> local_slopes(const std::vector<const Record*>& runs) {
  std::vector<std::optional<double>> slopes(runs.size());
  for (std::size_t k = 1; k < runs.size(); ++k) {
    if (!runs[k]->has_error() || !runs[k - 1]->has_error()) continue;
    slopes[k] = std::log(runs[k]->error / runs[k - 1]->error) / std::log(runs[k]->h_bar / runs[k - 1]->h_bar);
  }
  return slopes;
}

}  // namespace ricochet
