#include "reports/performance_profile.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace ricochet {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

PerformanceProfile::PerformanceProfile(std::vector<std::string> solvers, std::vector<std::vector<double>> costs)
    : solvers_(std::move(solvers)), ratios_(std::move(costs)) {
  for (std::size_t p = 0; p < n_problems(); ++p) {
    double best = kInfinity;
    for (const auto& of_solver : ratios_) best = std::min(best, of_solver[p]);
    for (auto& of_solver : ratios_) of_solver[p] = std::isfinite(of_solver[p]) ? of_solver[p] / best : kInfinity;
  }
}

double PerformanceProfile::share(std::size_t solver, double tau) const {
  const auto& ratios = ratios_[solver];
  const auto within = std::ranges::count_if(ratios, [&](double x) { return x <= tau; });
  return ratios.empty() ? 0 : static_cast<double>(within) / static_cast<double>(ratios.size());
}

double PerformanceProfile::solved(std::size_t solver) const {
  return share(solver, std::numeric_limits<double>::max());
}

double PerformanceProfile::largest_ratio() const {
  double largest = 1;
  for (const auto& of_solver : ratios_) {
    for (const double ratio : of_solver) {
      if (std::isfinite(ratio)) largest = std::max(largest, ratio);
    }
  }
  return largest;
}

std::vector<double> PerformanceProfile::finite_ratios(std::size_t solver) const {
  std::vector<double> ratios;
  for (const double ratio : ratios_[solver]) {
    if (std::isfinite(ratio)) ratios.push_back(ratio);
  }
  std::ranges::sort(ratios);
  return ratios;
}

Table PerformanceProfile::table(const std::string& title) const {
  constexpr double kTaus[] = {1, 2, 5, 10, 100};
  Table table;
  table.title = title;
  table.note =
      fmt::format("{} problems; share within tau times the best of all solvers; a failure is infinite", n_problems());
  table.columns = {{"solver", true}, {"solved"}};
  for (const double tau : kTaus) table.columns.push_back({fmt::format("tau = {}", tau)});
  for (std::size_t s = 0; s < solvers_.size(); ++s) {
    auto& row = table.rows.emplace_back();
    row = {solvers_[s], fmt::format("{:.1f} %", 100 * solved(s))};
    for (const double tau : kTaus) row.push_back(fmt::format("{:.3f}", share(s, tau)));
  }
  return table;
}

Chart PerformanceProfile::chart(const std::string& name, const std::string& file, const std::string& title,
                                const std::string& caption) const {
  const double end = std::pow(10, std::ceil(std::log10(1.01 * largest_ratio())));
  Chart chart{.name = name, .file = file, .title = title, .caption = caption, .width = 620, .height = 380};
  chart.panels = {{.title = "",
                   .x = {.label = "tau: time over that of the fastest solver", .is_log = true, .from = 1, .to = end},
                   .y = {.label = fmt::format("share of {} problems", n_problems()), .from = 0, .to = 1.02}}};
  std::vector<double> shares;
  for (std::size_t s = 0; s < solvers_.size(); ++s) shares.push_back(solved(s));
  std::ranges::sort(shares, std::greater());
  for (std::size_t s = 0; s < solvers_.size(); ++s) {
    Chart::Points steps = {{1, 0}};
    for (const double ratio : finite_ratios(s))
      steps.emplace_back(ratio, static_cast<double>(steps.size()) / static_cast<double>(n_problems()));
    steps.emplace_back(end, solved(s));
    chart.panels.front().add(solvers_[s], CurveLook::of(s), Chart::Drawn::steps, steps);
    chart.panels.front().series.back().is_minor = shares.size() > kMostCurves && solved(s) < shares[kMostCurves - 1];
  }
  return chart;
}

void PerformanceProfile::show(Section& section, const std::string& name, const std::string& title,
                              const std::string& caption, const std::string& file) const {
  section.chart(chart(name, file, title, caption), "profile", {{"problems", n_problems()}});
  section.details(name + "_shares", table(title));
}

}  // namespace ricochet
