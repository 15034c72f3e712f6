#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/measure/problem_choice.h"
#include "bench/studies/throughput/throughput_rows.h"
#include "reports/setting.h"

namespace ricochet {
namespace {

/// The line of a number of threads, and that of one thread.
struct ThroughputLine {
  ThroughputRun run, single;
};

std::vector<ThroughputLine> lines_of(const std::vector<ThroughputRun>& runs) {
  std::vector<ThroughputLine> lines;
  for (const auto& run : runs) {
    if (!run.is_reached) continue;
    const auto is_single = [&](const ThroughputRun& other) {
      return other.scene == run.scene && other.method == run.method && other.level == run.level && other.threads == 1;
    };
    const auto single = std::ranges::find_if(runs, is_single);
    lines.push_back({run, single == runs.end() ? ThroughputRun() : *single});
  }
  return lines;
}

}  // namespace

std::string ThroughputSetting::text() const {
  return Setting{steps, tolerance}.text();
}

Table throughput_summary(const std::vector<ThroughputRun>& runs) {
  const auto methods = different(runs, &ThroughputRun::method);
  const int most = std::ranges::max(runs, {}, &ThroughputRun::threads).threads;
  Table table{
      .title = "Runs per second and core at the same error",
      .note = fmt::format(
          "Median of runs per second of CPU time, including the CSV output: one thread / {0} threads / {0} independent "
          "processes, the limit of the machine. Nine of ten runs reach the error; -: no tested setting does.",
          most),
      .columns = {{"scene", true}, {"error at most", true}},
      .rows = {}};
  for (const auto& method : methods) table.columns.push_back({method, true});
  for (const auto& scene : different(runs, &ThroughputRun::scene)) {
    for (const double level : different(runs, &ThroughputRun::level)) {
      auto& line = table.rows.emplace_back();
      line = {scene, fmt::format("{:.0e}", level)};
      for (const auto& method : methods) {
        const auto by = [&](int threads) {
          return std::ranges::find_if(runs, [&](const ThroughputRun& run) {
            return run.scene == scene && run.level == level && run.method == method && run.threads == threads;
          });
        };
        const auto one = by(1), all = by(most);
        const bool is_there = one != runs.end() && all != runs.end() && one->is_reached;
        line.push_back(is_there ? fmt::format("{:.0f} / {:.0f} / {:.0f}", one->core_rate(), all->core_rate(),
                                              all->process_core_rate())
                                : "-");
      }
    }
  }
  return table;
}

Table throughput_table(const std::vector<ThroughputRun>& runs) {
  using L = ThroughputLine;
  static const std::vector<Column<L>> columns = {
      {"scene", [](const L& l) { return l.run.scene; }},
      {"error at most", "", "{:.0e}", [](const L& l) { return l.run.level; }},
      {"method", [](const L& l) { return l.run.method; }},
      {"setting", [](const L& l) { return l.run.setting.text(); }},
      {"error", "", "{:.1e}", [](const L& l) { return l.run.setting.error; }},
      {"threads", "", "{}", [](const L& l) { return l.run.threads; }},
      {"runs", "1/s", "{:.0f}", [](const L& l) { return l.run.rate(); }},
      {"per core", "1/s", "{:.0f}", [](const L& l) { return l.run.rate() / l.run.threads; }},
      {"of one thread", "", "{:.2f}",
       [](const L& l) { return when(l.single.runs > 0, l.run.rate() / l.run.threads / l.single.rate()); }},
      {"of processes", "", "{:.2f}", [](const L& l) { return l.run.rate() / l.run.process_rate(); }},
      {"processes", "1/s", "{:.0f}", [](const L& l) { return l.run.process_rate(); }},
      {"CPU time of a run", "us", "{:.3g}", [](const L& l) { return 1e6 * l.run.cpu_seconds / l.run.runs; }},
      {"by processes", "us", "{:.3g}", [](const L& l) { return 1e6 * l.run.process_cpu_seconds / l.run.runs; }},
  };
  return table_of(
      "Runs per second of an ensemble, at the same error", columns, lines_of(runs),
      "Wall time, the least of repetitions in turn, since other programs can only add to it; lines of CSV "
      "included. Error: nine of ten runs keep it. Of one thread: runs per second and core over those of one "
      "thread. Of processes: over those of as many processes of one thread, which share nothing: the limit "
      "of the machine. CPU time: median; where it grows with the threads they wait for memory or share a "
      "core.");
}

Table throughput_settings_table(const std::vector<ThroughputCurve>& curves) {
  struct Line {
    const ThroughputCurve* curve;
    const ThroughputSetting* setting;
  };
  std::vector<Line> lines;
  for (const auto& curve : curves) {
    for (const auto& setting : curve.settings) lines.push_back({&curve, &setting});
  }
  static const std::vector<Column<Line>> columns = {
      {"scene", [](const Line& l) { return l.curve->scene; }},
      {"method", [](const Line& l) { return l.curve->method; }},
      {"setting", [](const Line& l) { return l.setting->text(); }},
      {"error", "", "{:.1e}", [](const Line& l) { return l.setting->error; }},
      {"failed", "%", "{:.3g}", [](const Line& l) { return 100 * l.setting->failed; }},
      {"CPU time of a run", "us", "{:.3g}", [](const Line& l) { return l.setting->microseconds; }},
      {"runs judged", "", "{}", [](const Line& l) { return l.curve->judged; }},
      {"reference known to", "", "{:.1e}", [](const Line& l) { return l.curve->uncertainty; }},
  };
  return table_of("Settings on the first runs", columns, lines);
}

Table throughput_setup_table(const std::vector<ThroughputCurve>& curves) {
  struct Line {
    ThroughputCurve curve;
    double cheapest;  ///< of all methods [us]
  };
  std::vector<Line> lines;
  for (const auto& curve : curves) {
    if (curve.settings.empty()) continue;
    if (lines.empty() || lines.back().curve.scene != curve.scene) lines.push_back({curve, HUGE_VAL});
    for (const auto& setting : curve.settings)
      lines.back().cheapest = std::min(lines.back().cheapest, setting.microseconds);
  }
  static const std::vector<Column<Line>> columns = {
      {"scene", [](const Line& l) { return l.curve.scene; }},
      {"making a problem", "us", "{:.0f}", [](const Line& l) { return l.curve.make_microseconds; }},
      {"setting the values of a run", "us", "{:.2g}", [](const Line& l) { return l.curve.set_microseconds; }},
      {"cheapest run", "us", "{:.3g}", &Line::cheapest},
  };
  return table_of("Before the first step", columns, lines,
                  "CPU time. A thread makes its problem once and sets the values of every run in it, validation "
                  "included. The cheapest run: of all methods, whatever its error.");
}

Table throughput_failures(const std::vector<ThroughputRun>& runs, const std::vector<ThroughputCurve>& curves) {
  struct Line {
    ThroughputRun run;
    std::string why;
  };
  std::vector<Line> lines;
  for (const auto& run : runs) {
    if (run.is_reached || run.threads != runs.front().threads) continue;
    const auto curve = std::ranges::find_if(
        curves, [&](const ThroughputCurve& c) { return c.scene == run.scene && c.method == run.method; });
    lines.push_back(
        {run, curve == curves.end() || curve->why.empty() ? "no setting that was tried reaches it" : curve->why});
  }
  static const std::vector<Column<Line>> columns = {
      {"scene", [](const Line& l) { return l.run.scene; }},
      {"method", [](const Line& l) { return l.run.method; }},
      {"error at most", "", "{:.0e}", [](const Line& l) { return l.run.level; }},
      {"reason", [](const Line& l) { return l.why; }},
  };
  Table table = table_of("Errors that are not reached", columns, lines);
  table.is_list = true;
  return table;
}

namespace {

// Scenes that a method solves exactly have errors of rounding alone.
constexpr double kLeastErrorDrawn = 1e-10;

Chart error_chart(const std::vector<ThroughputCurve>& curves, const std::string& file) {
  Chart chart{
      .name = "errors",
      .file = file,
      .title = "Runs per second and core over the error",
      .caption = fmt::format("CPU time in one thread, all settings that were tried; up and left is better. Errors "
                             "below {:.0e} are drawn there.",
                             kLeastErrorDrawn)};
  const auto methods = different(curves, &ThroughputCurve::method);
  for (const auto& curve : curves) {
    Chart::Points points;
    for (const auto& setting : curve.settings) {
      if (std::isfinite(setting.error))
        points.emplace_back(std::max(setting.error, kLeastErrorDrawn), 1e6 / setting.microseconds);
    }
    const auto k = static_cast<std::size_t>(std::ranges::find(methods, curve.method) - methods.begin());
    chart
        .panel(curve.scene, {.label = "error of nine of ten runs", .is_log = true},
               {.label = "runs per second and core", .is_log = true})
        .add(curve.method, CurveLook::of(k), Chart::Drawn::both, points);
  }
  return chart;
}

Chart thread_chart(const std::vector<ThroughputRun>& runs, const std::string& file) {
  const auto scenes = different(runs, &ThroughputRun::scene), methods = different(runs, &ThroughputRun::method);
  const double level = std::ranges::max(runs, {}, &ThroughputRun::level).level;
  Chart chart{
      .name = "threads",
      .file = file,
      .title = "Runs per second over the number of threads",
      .caption = fmt::format("At an error of {:.0e}. Circles: as many processes that share nothing, the limit of the "
                             "machine. Dotted: one thread times the number of threads.",
                             level)};
  for (const auto& scene : scenes) {
    Chart::Panel& panel =
        chart.panel(scene, {.label = "threads", .is_log = true}, {.label = "runs per second", .is_log = true});
    for (std::size_t m = 0; m < methods.size(); ++m) {
      Chart::Points threads, processes, ideal;
      for (const auto& run : runs) {
        if (run.scene != scene || run.method != methods[m] || run.level != level || !run.is_reached) continue;
        threads.emplace_back(run.threads, run.rate());
        processes.emplace_back(run.threads, run.process_rate());
        ideal.emplace_back(run.threads, threads.front().second * run.threads / threads.front().first);
      }
      const CurveLook look = CurveLook::of(m);
      panel.add(methods[m], look, Chart::Drawn::both, threads);
      panel.add("", {.colour = look.colour, .is_open = true}, Chart::Drawn::marks, processes);
      panel.add("", {.colour = look.colour, .dash = 2}, Chart::Drawn::line, ideal);
    }
  }
  return chart;
}

}  // namespace

std::vector<Chart> throughput_charts(const std::vector<ThroughputCurve>& curves, const std::vector<ThroughputRun>& runs,
                                     const std::string& name) {
  if (curves.empty() || runs.empty()) return {};
  return {error_chart(curves, name + "_errors"), thread_chart(runs, name + "_threads")};
}

}  // namespace ricochet
