#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/studies/grid/fastest_rows.h"

namespace ricochet {
namespace {

const FastestRun* find(const std::vector<FastestRun>& runs, const std::string& scene, const std::string& family,
                       double level) {
  for (const FastestRun& run : runs) {
    if (run.scene == scene && run.family() == family && run.level() == level) return &run;
  }
  return nullptr;
}

std::string microseconds(const FastestRun* run) {
  if (!run || !run->is_judged()) return "?";
  return run->is_reached() ? fmt::format("{:.3g}", run->microseconds()) : "-";
}

/// Time of a family over that of the first; NaN where one of them does not reach the level, or nobody can say.
double ratio(const std::vector<FastestRun>& runs, const std::string& scene, const std::string& family,
             const std::string& first, double level) {
  const FastestRun *own = find(runs, scene, family, level), *other = find(runs, scene, first, level);
  const bool both = own && other && own->is_judged() && own->is_reached() && other->is_reached();
  return both ? own->microseconds() / other->microseconds() : std::nan("");
}

/// ", solvers kept between runs"
std::string which_solver(const std::vector<FastestRun>& runs) {
  return runs.front().solver() == "kept" ? ", solvers kept between runs" : "";
}

}  // namespace

std::vector<FastestRun> runs_of_solver(const std::vector<FastestRun>& runs, const std::string& solver) {
  return rows_where(runs, [&](const FastestRun& run) { return run.solver() == solver; });
}

Table fastest_table(const std::vector<FastestRun>& runs) {
  const auto scenes = different(runs, &FastestRun::scene), families = different(runs, &FastestRun::family);
  const auto levels = different(runs, &FastestRun::level);
  std::string names;
  for (const auto& family : families) names += (names.empty() ? "" : " / ") + family;
  Table table{
      .title = "Microseconds of the fastest run that reaches an error" + which_solver(runs),
      .note =
          names +
          ": each family with its best method and setting; in brackets the ratio of the second to the first. CPU "
          "time, median of interleaved repetitions. ?: the reference is not accurate enough to decide; -: no setting "
          "reaches the error.",
      .columns = {{"scene", true}, {"group", true}},
      .rows = {}};
  for (const double level : levels) table.columns.push_back({fmt::format("{:.0e}", level), true});
  for (const auto& scene : scenes) {
    auto& line = table.rows.emplace_back();
    line.push_back(scene);
    line.push_back(find(runs, scene, families[0], levels[0])->group);
    for (const double level : levels) {
      std::string cell;
      for (const auto& family : families)
        cell += (cell.empty() ? "" : " / ") + microseconds(find(runs, scene, family, level));
      const double r = families.size() > 1 ? ratio(runs, scene, families[1], families[0], level) : std::nan("");
      line.push_back(std::isfinite(r) ? fmt::format("{} ({:.2g})", cell, r) : cell);
    }
  }
  return table;
}

Table ratio_table(const std::vector<FastestRun>& runs) {
  const auto scenes = different(runs, &FastestRun::scene), families = different(runs, &FastestRun::family);
  const auto levels = different(runs, &FastestRun::level);
  auto groups = different(runs, &FastestRun::group);
  groups.push_back("all");
  Table table{
      .title = "Time over that of " + families[0] + which_solver(runs),
      .note =
          "Geometric mean of the ratios over the scenes of a group on which both families reach the error; in brackets "
          "the smallest and largest ratio and the number of scenes.",
      .columns = {{"group", true}, {"family", true}},
      .rows = {}};
  for (const double level : levels) table.columns.push_back({fmt::format("{:.0e}", level), true});
  for (const auto& group : groups) {
    for (std::size_t f = 1; f < families.size(); ++f) {
      auto& line = table.rows.emplace_back();
      line = {group, families[f]};
      for (const double level : levels) {
        double sum = 0, least = HUGE_VAL, most = 0;
        int count = 0;
        for (const auto& scene : scenes) {
          const FastestRun* run = find(runs, scene, families[f], level);
          if (!run || (group != "all" && run->group != group)) continue;
          const double r = ratio(runs, scene, families[f], families[0], level);
          if (!std::isfinite(r)) continue;
          sum += std::log(r);
          least = std::min(least, r);
          most = std::max(most, r);
          ++count;
        }
        const double mean = std::exp(sum / count);
        line.push_back(count == 0 ? "-"
                                  : fmt::format("{} ({:.2g}..{:.2g}, {})",
                                                mean < 0.1 ? fmt::format("{:.2g}", mean) : fmt::format("{:.2f}", mean),
                                                least, most, count));
      }
    }
  }
  return table;
}

Table choice_table(const std::vector<FastestRun>& runs) {
  using R = FastestRun;
  static const std::vector<Column<R>> columns = {
      {"scene", &R::scene},
      {"error at most", "", "{:.0e}", &R::level},
      {"family", &R::family},
      {"solver", &R::solver},
      {"method", &R::method},
      {"setting", [](const R& r) { return r.setting.text(); }},
      {"error", "", "{:.1e}", &R::error},
      {"time", "us", "{:.3g}", &R::microseconds},
      {"quartiles",
       [](const R& r) {
         return fmt::format("{:.3g} .. {:.3g}", 1e6 * r.timing.lower_quartile, 1e6 * r.timing.upper_quartile);
       }},
      {"peak heap", "kB", "{:.1f}", [](const R& r) { return r.peak_bytes / 1e3; }},
      {"runs tried", "", "{:g}", [](const R& r) { return r.value("tried"); }},
      {"failed", "", "{:g}", [](const R& r) { return r.value("failed"); }},
      {"repeat with", &R::command},
  };
  const auto reached = rows_where(runs, &R::is_reached);
  return table_of("The fastest runs", columns, reached);
}

Table unreached_table(const std::vector<FastestRun>& runs) {
  using R = FastestRun;
  static const std::vector<Column<R>> columns = {
      {"scene", &R::scene},
      {"family", &R::family},
      {"solver", &R::solver},
      {"error at most", "", "{:.0e}", &R::level},
      {"reason",
       [](const R& r) {
         if (!r.is_judged()) return fmt::format("the reference is known to {:.1e} only", r.reference_error);
         return r.message.empty() ? std::string("no setting that was tried reaches it") : r.message;
       }},
  };
  std::vector<R> unreached;
  for (const R& run : runs) {
    const bool is_first = run.family() == runs.front().family() && run.solver() == runs.front().solver();
    if (run.is_judged() ? run.is_reached() : !is_first) continue;  // a level that nobody can judge comes once
    unreached.push_back(run);
    if (!run.is_judged()) unreached.back().labels["family"] = "all";
  }
  Table table = table_of("Levels without a run", columns, unreached);
  table.is_list = true;
  return table;
}

std::vector<MeasuredRun> measured_runs(const std::vector<FastestRun>& runs) {
  std::vector<MeasuredRun> list;
  for (const FastestRun& run : runs) {
    const auto is_this = [&](const MeasuredRun& other) {
      return other.scene == run.scene && other.method == run.method && other.setting == run.setting.text();
    };
    if (run.is_reached() && std::ranges::none_of(list, is_this))
      list.push_back({run.scene, run.method, run.setting.text(), run.metrics, run.reference_error, run.solution_size});
  }
  return list;
}

}  // namespace ricochet
