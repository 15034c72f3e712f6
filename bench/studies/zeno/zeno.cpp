#include "bench/studies/zeno/zeno.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/experiment/experiment_file.h"
#include "bench/experiment/study.h"
#include "bench/measure/measure_run.h"
#include "bench/measure/problem_choice.h"
#include "bench/rows/progress.h"
#include "methods/contact_laws/contact_scales.h"
#include "methods/elements/element_motion.h"
#include "methods/elements/element_solver.h"
#include "methods/registry.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "problems/input_error.h"
#include "problems/registry.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr double kPartOfZenoTime = 1.3;  // of a run; rest is long enough to be seen
constexpr int kPartsOfAPiece = 8;        // of the motion, at which positions are compared
constexpr int kLengthBisections = 60;    // to the last bit of a length
constexpr int kExcursionSamples = 500;   // an extremum between two of them is missed by 1e-5 of it
constexpr double kNoBound = std::numeric_limits<double>::quiet_NaN();

/// Height above the ground that a closed element reaches in 1 s from v+ = 1 m/s [m]: its velocity vanishes at the stages,
/// and not between them. The height is proportional to the length of the element and to v+.
double excursion(const ButcherTableau& tableau) {
  Element element;
  element.h = 1;
  element.q0 = element.q1 = Vector::Zero(1);
  element.v0 = Vector::Ones(1);
  element.a = -tableau.A.lu().solve(Vector::Ones(tableau.n_s)).transpose();  // capture.h (1)
  element.v1 = element.v0 + element.a * tableau.b;
  Motion motion;
  ElementMotion(tableau).add(0, 1, element, motion);
  double farthest = 0;
  Vector q, v;
  for (int k = 0; k <= kExcursionSamples; ++k) {
    motion.within(0, static_cast<double>(k) / kExcursionSamples, q, v);
    farthest = std::max(farthest, std::abs(q[0]));
  }
  return farthest;
}

/// Bounds of a run whose closed element absorbs v+ by its stages.
void set_bounds(const ButcherTableau& tableau, double T, const ExactBall& ball, double radius, ZenoRun& run) {
  run.rest_bound = run.position_bound = kNoBound;
  const Capture closed = capture(tableau);
  if (tableau.order < 2 || !closed.absorbs()) return;
  double longest = T;  // element
  if (run.H > 0) {
    run.rest_bound = closed.rest_time_bound(run.H, run.e);
    longest = run.H;
  } else {
    // v+ <= tol / kappa, or the bounce is lower than rounding of the gap, v+^2 / (2 g) <= ContactScales::kGapRounding
    // (|q| + T |v|).
    const double size = ball.h_0 + radius + T * std::sqrt(2 * ball.g * ball.h_0);
    const double v_plus =
        std::max(run.tolerance / closed.kappa, std::sqrt(2 * ball.g * ContactScales::kGapRounding * size));
    run.rest_bound = 2 * v_plus / (ball.g * (1 - run.e));
  }
  // The highest of the flights left out, and the motion of the element that takes v+, with the v+ of the bound above.
  const double v_plus = ball.g * run.rest_bound * (1 - run.e) / 2;
  run.position_bound = v_plus * v_plus / (2 * ball.g) + excursion(tableau) * longest * v_plus;
}

}  // namespace

double ExactBall::t_Z() const {
  return std::sqrt(2 * h_0 / g) * (1 + e) / (1 - e);  // (1)
}

double ExactBall::height(double t) const {
  double flight = std::sqrt(2 * h_0 / g);  // the fall, then each flight in turn
  if (t < flight) return h_0 - 0.5 * g * t * t;
  if (t >= t_Z()) return 0;
  t -= flight;
  flight *= 2 * e;
  while (t > flight && flight > 0) {
    t -= flight;
    flight *= e;
  }
  return 0.5 * g * t * (flight - t);
}

std::vector<double> ExactBall::highest_after(double t) const {
  std::vector<double> times;
  double start = std::sqrt(2 * h_0 / g);
  // A flight shorter than rounding of the time is none.
  for (double flight = 2 * e * start; start + flight > start; start += flight, flight *= e) {
    if (start + flight / 2 >= t) times.push_back(start + flight / 2);
  }
  return times;
}

ZenoCapture measure_capture(const std::string& name) {
  const ButcherTableau tableau = tableau_argument(name);
  const Capture computed = capture(tableau);
  if (!std::isfinite(computed.kappa))
    throw InputError("tableaus", name, "A is singular, a closed element has no solution");
  const auto ball = make_problem("bouncing_ball");
  const double g = ExactBall().g, v_plus = 1;
  Counters counters;
  ElementSystem elements(*ball, tableau, counters);
  ElementSolver solver(elements, 1e-14);
  Element element;
  element.resize(ball->info(), tableau.n_s);
  element.q0[0] = 0.1;  // on the ground
  element.v0[0] = v_plus;
  element.modes[0] = ContactMode::closed;
  const auto least_force = [&](double h) {
    element.h = h;
    return solver.solve(element) == ElementSolver::Result::converged ? element.lambda_n.minCoeff() : kNoBound;
  };
  double too_short = 0, long_enough = 100 * v_plus / g;
  while (!(least_force(long_enough) >= 0) && long_enough < 1e6) long_enough *= 2;
  for (int k = 0; k < kLengthBisections; ++k) {
    const double h = 0.5 * (too_short + long_enough);
    (least_force(h) >= 0 ? long_enough : too_short) = h;
  }
  least_force(2 * long_enough);
  return {.tableau = name,
          .n_s = tableau.n_s,
          .kappa = computed.kappa,
          .kept = computed.kept,
          .measured_kappa = long_enough * g / v_plus,
          .measured_kept = element.v1[0] / v_plus};
}

ZenoRun measure_rest(const std::string& method, double e, double H, double tolerance) {
  const ExactBall exact{.e = e};
  ZenoRun run{.method = method, .command = {}, .e = e, .H = H, .tolerance = tolerance, .status = {}, .message = {}};
  run.t_Z = exact.t_Z();
  double T = kPartOfZenoTime * run.t_Z;
  Setting setting{.tolerance = tolerance};
  if (H > 0) {
    setting.steps = static_cast<int>(std::ceil(T / H));
    T = setting.steps * H;
  }
  const ProblemChoice choice{.problem = "bouncing_ball", .parameters = {{"e", e}, {"duration", T}}};
  const auto ball = choice.make_problem();
  const double ground = ball->info().q0[0] - exact.h_0;
  set_bounds(tableau_argument(tableau_of(method)), T, exact, ground, run);
  Run measured = planned_run(choice, method, setting);
  const Solution solution = measure_run({.problem = *ball, .recording = Recording::motion}, measured);
  run.command = measured.command();
  run.status = measured.status;
  run.message = measured.message;
  run.impacts = static_cast<int>(std::count_if(solution.events.begin(), solution.events.end(),
                                               [](const Event& event) { return event.kind == EventKind::impact; }));
  if (!solution.succeeded() || solution.events.empty()) return run;
  const Event& last = solution.events.back();
  run.rests = last.kind == EventKind::impact && is_closed(last.modes[0]);
  run.t_rest = last.t;
  run.v_plus = last.v_plus[0];
  run.v_end = std::abs(solution.v[0]);
  run.energy = 0.5 * (run.v_plus * run.v_plus - run.v_end * run.v_end);
  const auto compare = [&](double t) {
    Vector q, v;
    solution.motion.at(t, q, v);
    run.position_error = std::max(run.position_error, std::abs(q[0] - ground - exact.height(t)));
  };
  for (std::size_t piece = 0; piece < solution.motion.n_pieces(); ++piece) {
    const double begin = solution.motion.begin_of(piece), end = solution.motion.end_of(piece);
    if (begin < last.t) continue;
    for (int k = 0; k <= kPartsOfAPiece; ++k)
      compare(k == kPartsOfAPiece ? end : begin + k * (end - begin) / kPartsOfAPiece);
  }
  for (const double t : exact.highest_after(last.t)) compare(t);
  return run;
}

namespace {

/// The runs of an experiment, in the order of its results.
struct ZenoPlan {
  struct Entry {
    std::string method;
    double e, H, tolerance;
  };
  std::vector<std::string> tableaus;
  std::vector<Entry> runs;

  explicit ZenoPlan(const json& experiment) {
    experiment.at("tableaus").get_to(tableaus);
    const auto restitution = experiment.at("restitution").get<std::vector<double>>();
    for (const double e : restitution) {
      if (!(e > 0 && e < 1)) throw InputError("restitution", e, "numbers between 0 and 1 are required");
    }
    const auto lengths = logarithmic_grid(experiment.at("step_lengths"), "step_lengths");
    for (const std::string method : experiment.at("methods")) {
      require_kind_of_setting(*make_method(method), "methods, which have steps", "");
      for (const double e : restitution) {
        for (const double H : lengths) runs.push_back({method, e, H, 0});
      }
    }
    const auto tolerances = experiment.value("tolerances", std::vector<double>());
    for (const auto& method : experiment.value("adaptive_methods", std::vector<std::string>())) {
      require_kind_of_setting(*make_method(method), "", "adaptive_methods, which have tolerances");
      for (const double e : restitution) {
        for (const double tolerance : tolerances) runs.push_back({method, e, 0, tolerance});
      }
    }
  }
};

void run_zeno(const json& experiment, ResultsFile& file) {
  const ZenoPlan plan(experiment);
  const auto capture = [&](std::size_t k) { return measure_capture(plan.tableaus[k]); };
  file.each<ZenoCapture>(plan.tableaus.size(), capture, [](std::size_t) {});
  Progress progress(experiment.at("id").get<std::string>());
  const auto bounce = [&](std::size_t k) {
    const ZenoPlan::Entry& run = plan.runs[k];
    return measure_rest(run.method, run.e, run.H, run.tolerance);
  };
  file.each<ZenoRun>(plan.runs.size(), bounce, [&](std::size_t k) {
    progress.update(static_cast<double>(k + 1) / static_cast<double>(plan.runs.size()), plan.runs[k].method);
  });
}

void show_zeno(const Results& results, Section& section) {
  const auto captures = results.all<ZenoCapture>();
  const auto runs = results.all<ZenoRun>();
  section.chart(zeno_chart(captures, runs, results.experiment()));
  section.result("captures", zeno_capture_table(captures));
  section.result("methods", zeno_table(runs));
  section.details("runs", zeno_details(runs));
}

/// Two of the ways to fail are among what is measured: FESD-J may find no solution with two elements, and a tableau that
/// gives the velocity back never ends the bounces.
int zeno_unexpected_failures(const Results& results) {
  const auto runs = results.all<ZenoRun>();
  return static_cast<int>(std::ranges::count_if(runs, [](const ZenoRun& run) {
    return !run.succeeded() && run.status != "infeasible" && run.status != "step_limit";
  }));
}

constexpr const char* kZenoFields = R"~({
  "required": ["tableaus", "restitution", "step_lengths", "methods"],
  "properties": {
    "tableaus": {"type": "array", "items": {"type": "string"}, "description": "Whose closed element is measured.", "examples": [["radau-iia:3"]]},
    "restitution": {"type": "array", "items": {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}, "description": "Coefficients e.", "examples": [[0.5, 0.9]]},
    "step_lengths": {"$ref": "#/$defs/range", "description": "Step lengths of fixed-step methods [s].", "examples": [{"from": 0.1, "to": 1e-4, "per_decade": 2}]},
    "methods": {"type": "array", "items": {"$ref": "#/$defs/method"}, "description": "Fixed-step methods.", "examples": [["fesd:radau-iia:3"]]},
    "tolerances": {"type": "array", "items": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1}, "description": "Of adaptive_methods.", "examples": [[1e-6]]},
    "adaptive_methods": {"type": "array", "items": {"$ref": "#/$defs/method"}, "description": "Error-controlled methods.", "examples": [["fesd_adaptive:radau-iia:3"]]}
  }
})~";

const bool zeno_is_registered = register_study({.kind = "zeno",
                                                .summary = "when and how the bouncing of a ball ends",
                                                .fields = kZenoFields,
                                                .rows = {ZenoCapture::kKind, ZenoRun::kKind},
                                                .times = Times::none,
                                                .run = run_zeno,
                                                .show = show_zeno,
                                                .unexpected_failures = zeno_unexpected_failures});

}  // namespace

}  // namespace ricochet
