#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

#include "bench/studies/questions/question.h"
#include "bench/studies/questions/toss_data.h"
#include "methods/peers/engines/engine_scene.h"
#include "problems/input_error.h"

/// @file
/// Question: how near is a simulation to a measured motion? A cube was tossed on a table (toss_data.h). Simulations start
/// from the measured state, with fitted coefficients. The distance between the methods stands beside the distance to the
/// measurement: if methods are nearer to each other than to the cube, only a better model helps, not a better method.

namespace ricochet::tosses {
namespace {

using nlohmann::json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kBetween = 0.05;  // [s], of the times that are compared

std::string time_name(double t, const char* what) {
  return fmt::format("{} at {:.2f} s", what, t);
}

std::vector<Answer> toss_conditions(const json& experiment) {
  const std::string folder = experiment.value("data", "");
  if (folder.empty())
    throw InputError("data", "''", "--data DIR with the files N.pt of the ContactNets cube tosses is required");
  auto files = toss_files(folder);
  if (const int most = experiment.value("tosses", 0); most > 0 && most < static_cast<int>(files.size()))
    files.resize(static_cast<std::size_t>(most));
  std::vector<Answer> conditions;
  for (const std::string& file : files) conditions.emplace_back().scene = file;
  return conditions;
}

double angle_between(const Matrix3<double>& A, const Matrix3<double>& B) {
  double trace = 0;
  for (std::size_t k = 0; k < 3; ++k) trace += dot(A[k], B[k]);
  return std::acos(std::clamp((trace - 1) / 2, -1.0, 1.0));
}

/// The pose at a time, between steps.
Pose pose_at(const EngineScene& scene, const Solution& s, double t) {
  return scene.states_of(position_at(s, t), s.v).front().pose;
}

void measure_toss(const json& experiment, const Method& method, Answer& answer) {
  const Toss toss = toss_of(read_toss(answer.scene), experiment.at("e"), experiment.at("mu"));
  const Solution s = run_for(method, {}, *toss.problem, Recording::motion, answer);
  if (!s.succeeded()) return;
  const EngineScene scene(*toss.problem);
  const double T = toss.problem->info().end_time;
  for (int k = 1; k * kBetween <= T; ++k) {
    const double t = k * kBetween, row = t * kTossRate;
    const auto below =
        static_cast<std::size_t>(std::min(std::floor(row), static_cast<double>(toss.measured.size() - 2)));
    const double part = row - static_cast<double>(below);
    const Pose &left = toss.measured[below], &right = toss.measured[below + 1];
    const Vector3<double> centre = sum(scaled(1 - part, left.centre), scaled(part, right.centre));
    const Pose pose = pose_at(scene, s, t);
    const Vector3<double> d = difference(pose.centre, centre);
    answer.values[time_name(t, "distance")] = std::sqrt(dot(d, d));
    // The rotation of the nearer row.
    answer.values[time_name(t, "angle")] = angle_between(pose.R, (part < 0.5 ? left : right).R);
    answer.values[time_name(t, "x")] = pose.centre[0];
    answer.values[time_name(t, "y")] = pose.centre[1];
    answer.values[time_name(t, "z")] = pose.centre[2];
  }
}

double mean(const std::vector<double>& values) {
  double total = 0;
  for (const double value : values) total += value;
  return values.empty() ? kNaN : total / static_cast<double>(values.size());
}

double median(std::vector<double> values) {
  if (values.empty()) return kNaN;
  std::sort(values.begin(), values.end());
  return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

/// The times that some toss has.
std::vector<double> times_of(const std::vector<Answer>& answers) {
  std::vector<double> times;
  for (int k = 1;; ++k) {
    const double t = k * kBetween;
    if (std::ranges::none_of(answers, [&](const Answer& a) { return a.values.contains(time_name(t, "distance")); }))
      break;
    times.push_back(t);
  }
  return times;
}

std::vector<double> all_at(const std::vector<Answer>& list, double t, const char* what) {
  std::vector<double> values;
  for (const Answer& a : list) {
    if (a.values.contains(time_name(t, what))) values.push_back(a.values.at(time_name(t, what)));
  }
  return values;
}

/// Mean distance of the methods of a toss from their common mean, over all tosses.
double spread_at(const std::vector<Answer>& answers, double t) {
  std::map<std::string, std::vector<Vector3<double>>> places;
  for (const Answer& a : answers) {
    if (!a.values.contains(time_name(t, "x"))) continue;
    places[a.scene].push_back(
        {a.values.at(time_name(t, "x")), a.values.at(time_name(t, "y")), a.values.at(time_name(t, "z"))});
  }
  std::vector<double> distances;
  for (const auto& [scene, list] : places) {
    Vector3<double> centre{};
    for (const auto& x : list) centre = sum(centre, scaled(1.0 / static_cast<double>(list.size()), x));
    for (const auto& x : list) {
      const auto d = difference(x, centre);
      distances.push_back(std::sqrt(dot(d, d)));
    }
  }
  return mean(distances);
}

struct Line {
  std::string method;
  int tosses = 0, failed = 0;
  double middle = kNaN, end = kNaN, median_end = kNaN, angle = kNaN;
};

Table answer_table(const std::vector<Answer>& answers) {
  const auto times = times_of(answers);
  if (times.empty()) return {.title = "The answer", .note = "no toss was simulated", .columns = {}, .rows = {}};
  // The last time that every toss has.
  double last = times.front();
  const auto count = [&](double t) { return all_at(answers, t, "distance").size(); };
  for (const double t : times) {
    if (count(t) == count(times.front())) last = t;
  }
  const double half = times[times.size() / 2] < last ? times[times.size() / 2] : times.front();
  std::vector<Line> lines;
  for (const MethodAnswers& m : by_method(answers)) {
    const std::vector<Answer>& list = m.answers;
    Line line{.method = m.method};
    for (const Answer& a : list) {
      ++line.tosses;
      line.failed += !a.succeeded();
    }
    line.middle = 1e3 * mean(all_at(list, half, "distance"));
    line.end = 1e3 * mean(all_at(list, last, "distance"));
    line.median_end = 1e3 * median(all_at(list, last, "distance"));
    line.angle = 180 / std::acos(-1.0) * mean(all_at(list, last, "angle"));
    lines.push_back(line);
  }
  const std::vector<Column<Line>> columns = {
      {"method", &Line::method},
      {"tosses", "", "{}", &Line::tosses},
      {"failed", "", "{}", &Line::failed},
      {fmt::format("from the cube at {:.2f} s", half), "mm", "{:.1f}", &Line::middle},
      {fmt::format("at {:.2f} s", last), "mm", "{:.1f}", &Line::end},
      {"median", "mm", "{:.1f}", &Line::median_end},
      {"turned by", "deg", "{:.0f}", &Line::angle}};
  const double spread = 1e3 * spread_at(answers, last);
  double nearest = HUGE_VAL;
  for (const Line& line : lines) nearest = std::fmin(nearest, line.end);
  return table_of(
      "The answer", columns, lines,
      fmt::format(
          "Mean distances of the cube's centre from where it was measured, {:.1f} mm wide. At {:.2f} s the "
          "methods are {:.1f} mm from their common mean, and the nearest of them {:.1f} mm from the cube: {}",
          2e3 * kCubeHalfWidth, last, spread, nearest,
          spread < 0.5 * nearest
              ? "what is wrong is the model (one mu, one e, a flat rigid floor, Newton's law), which no method can mend; "
                "verification settles which equations are solved, not whether they are nature's."
              : "the choice of a method matters as much as the model."));
}

/// Means over all tosses; the curve of a method has them once, with its first toss.
QuestionPanel panel_of(const char* title, const char* label, const char* what, double unit,
                       const std::vector<Answer>& answers) {
  return {{.title = title, .x = {.label = "time [s]"}, .y = {.label = label, .from = 0}},
          [=, times = times_of(answers)](const Answer& a, const MethodAnswers& m) {
            Chart::Points points;
            const bool is_first = &a == &*std::ranges::find_if(m.answers, &Answer::succeeded);
            for (std::size_t k = 0; is_first && k < times.size(); ++k) {
              const double value = mean(all_at(m.answers, times[k], what));
              if (std::isfinite(value)) points.emplace_back(times[k], unit * value);
            }
            return points;
          }};
}

std::vector<QuestionPanel> panels(const std::vector<Answer>& answers) {
  std::vector<QuestionPanel> list = {
      panel_of("centre", "mean distance from the measured cube [mm]", "distance", 1e3, answers),
      panel_of("rotation", "mean angle from the measured cube [°]", "angle", 180 / std::acos(-1.0), answers)};
  Chart::Points spread;
  for (const double t : times_of(answers)) spread.emplace_back(t, 1e3 * spread_at(answers, t));
  list.front().reference = [=](Chart::Panel& p) {
    p.add("distance between the methods", {}, Chart::Drawn::reference, spread);
  };
  return list;
}

constexpr const char* kFields = R"~({
  "data": {"type": "string", "description": "Folder with the files N.pt; --data sets it.", "examples": ["tosses_processed"]},
  "tosses": {"type": "integer", "minimum": 1, "description": "Of the first so many files alone.", "examples": [20]},
  "e": {"type": "number", "minimum": 0, "maximum": 1, "description": "Restitution that was fitted.", "examples": [0.125]},
  "mu": {"type": "number", "minimum": 0, "description": "Friction that was fitted.", "examples": [0.18]}
})~";

const bool registered = register_question(
    {.kind = "tosses",
     .summary = "how near is a simulation to a measured motion?",
     .fields = kFields,
     .conditions = toss_conditions,
     .measure = measure_toss,
     .figure = "From a measured motion",
     .caption = "Mean over all tosses that last as long. Grey: mean distance of the methods from their common mean.",
     .panels = panels,
     .details = {{time_name(0.25, "distance"), "distance at 0.25 s", "m", "{:.4f}"},
                 {time_name(0.5, "distance"), "at 0.5 s", "m", "{:.4f}"}},
     .before = [](const Results&, const std::vector<Answer>& answers, Section& section) {
       section.result("answer", answer_table(answers));
     }});

}  // namespace
}  // namespace ricochet::tosses
