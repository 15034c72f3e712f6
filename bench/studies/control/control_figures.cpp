#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/studies/control/control_views.h"

namespace ricochet {
namespace {

constexpr double kGap = Chart::kAuto;
// Costs that differ by more than this factor need an axis of logarithms, which has numbers then.
constexpr double kDecade = 10;
// A velocity that changes by less of the range of all velocities at one instant does not jump.
constexpr double kJump = 1e-3;

Chart::Points column(const std::vector<double>& t, const std::vector<std::vector<double>>& rows, std::size_t k) {
  Chart::Points points;
  for (std::size_t s = 0; s < t.size(); ++s) points.emplace_back(t[s], rows[s][k]);
  return points;
}

CurveLook open_circle(std::size_t k) {
  return {.colour = CurveLook::of(k).colour, .is_open = true};
}

std::size_t width(const std::vector<std::vector<double>>& rows) {
  return rows.empty() ? 0 : rows.front().size();
}

void add_positions(const ControlRun& run, Chart::Panel& panel) {
  for (std::size_t k = 0; k < width(run.claimed.q); ++k)
    panel.add(fmt::format("q_{}", k + 1), CurveLook::plain(k), Chart::Drawn::line,
              column(run.claimed.t, run.claimed.q, k));
  for (std::size_t k = 0; k < width(run.replayed.q); ++k)
    panel.add("", open_circle(k), Chart::Drawn::marks, column(run.replayed.t, run.replayed.q, k));
}

/// Lines that end at a jump: a dot at its left limit, a bullet at its right one.
void add_velocities(const ControlRun& run, Chart::Panel& panel) {
  double least = 0, most = 0;
  for (const auto& v : run.claimed.v) {
    least = std::min(least, std::ranges::min(v));
    most = std::max(most, std::ranges::max(v));
  }
  for (std::size_t k = 0; k < width(run.claimed.v); ++k) {
    const Chart::Points v = column(run.claimed.t, run.claimed.v, k);
    Chart::Points line, left, right, between;
    for (std::size_t s = 0; s < v.size(); ++s) {
      if (s > 0 && v[s].first == v[s - 1].first && std::abs(v[s].second - v[s - 1].second) > kJump * (most - least)) {
        left.push_back(v[s - 1]);
        right.push_back(v[s]);
        between.insert(between.end(), {v[s - 1], v[s], {v[s].first, kGap}});
        line.emplace_back(v[s].first, kGap);
      }
      line.push_back(v[s]);
    }
    panel.add("", CurveLook::plain(k), Chart::Drawn::line, line);
    panel.add("", {.colour = CurveLook::of(k).colour, .dash = 2}, Chart::Drawn::line, between);
    panel.add("", open_circle(k), Chart::Drawn::marks, left);
    panel.add("", CurveLook::plain(k), Chart::Drawn::marks, right);
  }
}

void add_controls(const ControlRun& run, Chart::Panel& panel) {
  for (std::size_t k = 0; k < width(run.u); ++k) {
    Chart::Points points;
    const double H = run.T / static_cast<double>(run.u.size());
    for (std::size_t s = 0; s < run.u.size(); ++s) points.emplace_back(static_cast<double>(s) * H, run.u[s][k]);
    points.emplace_back(run.T, run.u.back()[k]);  // the last interval has an end
    panel.add(fmt::format("u_{}", k + 1), CurveLook::plain(k), Chart::Drawn::steps, points);
  }
}

/// Times of the borders of elements, at which the claimed motion has two points.
std::vector<double> borders(const ControlRun& run) {
  std::vector<double> t;
  for (std::size_t s = 1; s < run.claimed.t.size(); ++s) {
    if (run.claimed.t[s] == run.claimed.t[s - 1]) t.push_back(run.claimed.t[s]);
  }
  if (!run.claimed.t.empty()) t.push_back(run.claimed.t.back());
  return t;
}

/// A force over time: lines through the stages of an element, continued to its borders, where forces jump.
Chart::Points force_line(const Chart::Points& stages, const std::vector<double>& borders) {
  if (borders.size() < 2) return stages;
  Chart::Points line;
  for (std::size_t n = 0, s = 0; n + 1 < borders.size(); ++n) {
    Chart::Points element;
    while (s < stages.size() && stages[s].first <= borders[n + 1]) element.push_back(stages[s++]);
    if (element.empty()) continue;
    const auto extend = [](double t, const auto& near, const auto& far) {
      if (near.first == far.first) return std::pair(t, near.second);
      return std::pair(t, near.second + (near.second - far.second) * (t - near.first) / (near.first - far.first));
    };
    const auto second = element.size() > 1 ? element[1] : element[0];
    line.push_back(extend(borders[n], element[0], second));
    line.insert(line.end(), element.begin(), element.end());
    const auto before = element.size() > 1 ? element[element.size() - 2] : element.back();
    if (element.back().first < borders[n + 1]) line.push_back(extend(borders[n + 1], element.back(), before));
  }
  return line;
}

void add_normal_forces(const ControlRun& run, Chart::Panel& panel) {
  const auto ends = borders(run);
  for (std::size_t k = 0; k < width(run.lambda_n); ++k) {
    Chart::Points line = force_line(column(run.force_t, run.lambda_n, k), ends);
    for (auto& [t, force] : line) force = std::max(force, 0.0);  // what is continued may leave the cone
    panel.add(run.contacts[k], CurveLook::plain(k), Chart::Drawn::line, line);
  }
}

void add_friction_forces(const ControlRun& run, Chart::Panel& panel) {
  const auto ends = borders(run);
  for (std::size_t k = 0; k < run.friction.size(); ++k)
    panel.add("", CurveLook::plain(static_cast<std::size_t>(run.friction[k])), Chart::Drawn::line,
              force_line(column(run.force_t, run.lambda_t, k), ends));
}

void add_impulses(const ControlRun& run, Chart::Panel& panel) {
  for (const auto& impact : run.impacts) {
    const auto contact = static_cast<std::size_t>(impact.contact);
    panel.add("", CurveLook::plain(contact), Chart::Drawn::stems, {{impact.t, impact.Lambda_n}});
    for (const double Lambda_t : impact.Lambda_t)
      panel.add("", open_circle(contact), Chart::Drawn::marks, {{impact.t, Lambda_t}});
  }
}

bool has_friction(const ControlRun& run) {
  return !run.friction.empty();
}
bool has_impacts(const ControlRun& run) {
  return !run.impacts.empty();
}

std::string run_name(const ControlRun& run) {
  return (run.method == "shooting" ? "shooting, " : "") + run.discretisation +
         (run.succeeded() ? "" : ": " + run.status);
}

struct Row {
  const char* label;
  void (*add)(const ControlRun& run, Chart::Panel& panel);
  bool is_shown;
};

}  // namespace

Chart progress_chart(const std::vector<ControlRun>& runs, const std::string& file) {
  Chart chart{
      .name = runs.front().problem + "_progress",
      .file = file,
      .title = runs.front().problem + ": cost over iterations",
      .caption =
          "Shooting: the cost of the plant's motion at every iteration, which may violate constraints at first. "
          "Homotopy: the cost of each relaxation, whose motions violate the plant less and less."};
  Chart::Panel& panel =
      chart.panels.emplace_back(Chart::Panel{.x = {.label = "iterations", .is_log = true}, .y = {.label = "cost"}});
  double least = std::numeric_limits<double>::infinity(), most = -least;
  std::size_t k = 0;
  for (const ControlRun& run : runs) {
    Chart::Points points;
    for (std::size_t i = 0; i < run.progress_cost.size(); ++i) {
      if (run.progress_iterations[i] > 0) points.emplace_back(run.progress_iterations[i], run.progress_cost[i]);
      least = std::min(least, run.progress_cost[i]);
      most = std::max(most, run.progress_cost[i]);
    }
    panel.add(run_name(run), CurveLook::plain(k++), run.method == "shooting" ? Chart::Drawn::line : Chart::Drawn::both,
              points);
  }
  panel.y.is_log = least > 0 && most > kDecade * least;
  return chart;
}

Chart control_chart(const std::vector<ControlRun>& runs, const std::string& file) {
  std::vector<Row> rows = {{"position", add_positions, true},
                           {"velocity", add_velocities, true},
                           {"control", add_controls, true},
                           {"normal force [N]", add_normal_forces, true},
                           {"friction [N]", add_friction_forces, std::ranges::any_of(runs, has_friction)},
                           {"impulse [N s]", add_impulses, std::ranges::any_of(runs, has_impacts)}};
  std::erase_if(rows, [](const Row& row) { return !row.is_shown; });
  const int columns = static_cast<int>(runs.size());
  Chart chart{
      .name = runs.front().problem,
      .file = file,
      .title = runs.front().problem + ": motion, controls and forces",
      .caption = fmt::format(
          "{}. Lines: the motion that the optimisation claims; circles on it: the plant under its controls. "
          "Velocities jump at impacts, from the open circle to the bullet. Forces of one contact have one colour; "
          "its impulses are stems, open circles their tangential part. Time stepping has no impulses: they are "
          "forces of a step; its stems are what such a step passes on.",
          runs.front().title),
      .columns = columns,
      .width = columns > 1 ? 440 : 530,
      .height = 100,
      .has_key_each = true};
  for (const Row& row : rows) {
    const bool is_first = &row == &rows.front(), is_last = &row == &rows.back();
    for (const ControlRun& run : runs) {
      const std::string name = run_name(run);
      Chart::Panel& panel = chart.panels.emplace_back(
          Chart::Panel{.title = is_first ? name : "",
                       .x = {.label = is_last ? "t [s]" : "", .from = 0, .to = run.T > 0 ? run.T : 1},
                       .y = {.label = row.label}});
      row.add(run, panel);
    }
  }
  return chart;
}

}  // namespace ricochet
