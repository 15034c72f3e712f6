#include "reports/performance_profile.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "reports/curve_look.h"
#include "reports/gnuplot.h"

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

std::vector<std::size_t> PerformanceProfile::drawn() const {
  std::vector<std::size_t> list(solvers_.size());
  std::iota(list.begin(), list.end(), 0);
  if (list.size() <= kMostCurves) return list;
  std::ranges::stable_sort(list, std::greater(), [&](std::size_t s) { return solved(s); });
  list.resize(kMostCurves);
  return list;
}

nlohmann::json PerformanceProfile::json() const {
  nlohmann::json solvers = nlohmann::json::array();
  for (std::size_t s = 0; s < solvers_.size(); ++s) {
    solvers.push_back({{"name", solvers_[s]}, {"ratios", finite_ratios(s)}});
    CurveLook::of(s).put_into(solvers.back());
  }
  return {{"problems", n_problems()}, {"solvers", solvers}};
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

Figure PerformanceProfile::draw(const FigureFolder& folder, const std::string& name, const std::string& title) const {
  const double end = std::pow(10, std::ceil(std::log10(1.01 * largest_ratio())));
  Panel panel("profile");
  for (const std::size_t s : drawn()) {
    Points steps = {{1, share(s, 1)}};
    for (const double ratio : finite_ratios(s)) {
      if (ratio > steps.back().first) steps.emplace_back(ratio, share(s, ratio));
    }
    steps.emplace_back(end, solved(s));
    panel.add(steps, s, fmt::format("with steps lw 2 dt {}", 1 + CurveLook::of(s).dash), solvers_[s]);
  }
  std::string script = gnuplot_head(760, 460) + fmt::format("set output '{}.svg'\n", name) + panel.data();
  script += "set logscale x\nset key outside right\n";
  script += fmt::format("set xrange [1:{:g}]\nset yrange [0:1.02]\n", end);
  script += "set xlabel 'tau: time over that of the fastest solver'\n";
  script += fmt::format("set ylabel 'share of {} problems'\n", n_problems());
  folder.draw(name, script + panel.plot());
  const bool is_whole = solvers_.size() <= kMostCurves;
  return {.file = name + ".svg",
          .title = title,
          .caption = fmt::format("Performance profiles of Dolan and Moré{}",
                                 is_whole ? "" : fmt::format(", the {} solvers that solve most", kMostCurves))};
}

void PerformanceProfile::show(Section& section, const std::string& name, const std::string& title,
                              const std::string& caption, const std::string& figure) const {
  const auto still = [profile = *this, figure, title](const FigureFolder& folder) {
    return std::vector{profile.draw(folder, figure, title)};
  };
  const std::string table_name = name + "_shares";
  section.chart({.kind = "profile",
                 .name = name,
                 .table = table_name,
                 .title = title,
                 .caption = caption,
                 .data = json(),
                 .still = {still}});
  section.details(table_name, table(title));
}

}  // namespace ricochet
