#include "reports/order_fit.h"

#include <fmt/format.h>
#include <gsl/gsl_cdf.h>
#include <gsl/gsl_fit.h>

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

constexpr double kRounding = 1e-13;
constexpr double kAboveFloor = 10;
constexpr std::size_t kFewest = 6;

/// Runs with an error; those in [begin, end) are fitted.
struct Window {
  std::vector<const Run*> points;
  std::size_t begin = 0, end = 0;

  explicit Window(const std::vector<const Run*>& runs);
  std::size_t size() const { return end > begin ? end - begin : 0; }
};

double floor_of(const Run& run) {
  return kAboveFloor * std::max(run.reference_error, kRounding * run.solution_size);
}

Window::Window(const std::vector<const Run*>& runs) {
  for (const Run* run : runs) {
    if (run->has_error() && run->error >= 0) points.push_back(run);
  }
  end = points.size();
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (points[k]->error >= kAsymptoticError * points[k]->solution_size) begin = k + 1;
  }
  for (std::size_t k = points.size(); k-- > begin;) {
    if (points[k]->error <= floor_of(*points[k])) end = k;
  }
}

/// States why the window has so few points.
void explain_few_points(const Window& window, const std::vector<const Run*>& runs, ObservedOrder& order) {
  const auto& points = window.points;
  if (points.empty()) {
    const bool has_solutions = std::ranges::any_of(runs, [](const Run* run) { return run->succeeded(); });
    order.no_fit = has_solutions ? "no reference" : "no solution";
    order.reason = has_solutions ? "no run was compared with a reference"
                                 : fmt::format("none of {} runs has a solution", runs.size());
    return;
  }
  const Run& finest = *points.back();
  const bool is_rounding = kRounding * finest.solution_size >= finest.reference_error;
  const std::string coarse =
      window.begin == 0 ? ""
                        : fmt::format("up to N_sim = {} errors are above {:.1e}, 0.3 % of the solution",
                                      points[window.begin - 1]->setting.steps, kAsymptoticError * finest.solution_size);
  const std::string floor =
      fmt::format("{:.1e}, 10 times {}", order.floor, is_rounding ? "rounding" : "the uncertainty of the reference");
  if (window.begin == points.size()) {
    order.no_fit = "too coarse";
    order.reason = coarse;
  } else if (window.size() == 0) {
    order.no_fit = is_rounding ? "exact to rounding" : "as exact as the reference";
    order.reason = fmt::format("from N_sim = {} on errors are below {}", points[window.begin]->setting.steps, floor);
  } else {
    order.no_fit = "too few points";
    order.reason = fmt::format("{} of the {} points that are required", window.size(), kFewest);
    if (!coarse.empty()) order.reason += "; " + coarse;
    if (window.end < points.size())
      order.reason +=
          fmt::format("; from N_sim = {} on not all are above {}", points[window.end]->setting.steps, floor);
  }
}

}  // namespace

OrderFit fit_line(const std::vector<double>& step_lengths, const std::vector<double>& errors) {
  std::vector<double> x, y;
  for (const double h : step_lengths) x.push_back(std::log10(h));
  for (const double error : errors) y.push_back(std::log10(error));
  const auto n = x.size();
  OrderFit fit;
  double intercept = 0, c00 = 0, c01 = 0, c11 = 0, squares = 0;
  gsl_fit_linear(x.data(), 1, y.data(), 1, n, &intercept, &fit.slope, &c00, &c01, &c11, &squares);
  const auto freedom = static_cast<double>(n - 2);
  fit.half_width = gsl_cdf_tdist_Pinv(0.975, freedom) * std::sqrt(c11);
  fit.scatter = std::sqrt(squares / freedom);
  fit.used = static_cast<int>(n);
  return fit;
}

ObservedOrder observe_order(const std::vector<const Run*>& runs) {
  const Window window(runs);
  ObservedOrder order;
  if (!window.points.empty()) order.floor = floor_of(*window.points.back());
  if (window.size() < kFewest) {
    explain_few_points(window, runs, order);
    return order;
  }
  std::vector<double> step_lengths, errors;
  for (std::size_t k = window.begin; k < window.end; ++k) {
    step_lengths.push_back(window.points[k]->h_bar);
    errors.push_back(window.points[k]->error);
  }
  OrderFit fit = fit_line(step_lengths, errors);
  fit.first_steps = window.points[window.begin]->setting.steps;
  fit.last_steps = window.points[window.end - 1]->setting.steps;
  fit.attempted = static_cast<int>(runs.size());
  if (fit.half_width <= kWidestInterval) {
    order.fit = fit;
  } else {
    order.no_fit = "no line";
    order.reason = fmt::format("{:.2f} ± {:.2f} through {} points, N_sim = {} .. {}; at most ± {:g} is a fit",
                               fit.slope, fit.half_width, fit.used, fit.first_steps, fit.last_steps, kWidestInterval);
  }
  return order;
}

std::optional<OrderFit> fit_order(const std::vector<const Run*>& runs) {
  return observe_order(runs).fit;
}

std::vector<std::optional<double>> local_slopes(const std::vector<const Run*>& runs) {
  std::vector<std::optional<double>> slopes(runs.size());
  const auto has_logarithm = [](const Run& run) { return run.has_error() && run.error > 0; };
  for (std::size_t k = 1; k < runs.size(); ++k) {
    if (!has_logarithm(*runs[k]) || !has_logarithm(*runs[k - 1])) continue;
    slopes[k] = std::log(runs[k]->error / runs[k - 1]->error) / std::log(runs[k]->h_bar / runs[k - 1]->h_bar);
  }
  return slopes;
}

}  // namespace ricochet
