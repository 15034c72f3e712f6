#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/commands/commands.h"
#include "bench/commands/problem_options.h"
#include "bench/measure/trajectory_of.h"
#include "methods/contact_laws/bernstein.h"
#include "methods/contact_laws/gap_search.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reports/table.h"

namespace ricochet {
namespace {

struct AuditArguments {
  ProblemOptions problem;
  std::string problem_id;  ///< without --problem in front of it
  std::string method;

  /// A single word without an option is the method where another option says which problem.
  void sort() {
    const bool has_problem = !problem.problem.empty() || !problem.scene.empty();
    if (method.empty() && has_problem) std::swap(method, problem_id);
    if (method.empty()) throw InputError("--method", "''", "a method is required");
    if (problem_id.empty()) return;
    if (has_problem) throw InputError("problem_id", problem_id, "the problem is also given by --problem or --scene");
    problem.problem = problem_id;
  }
};

/// The method's own equations, as it reports them.
Table residual_table(const Problem& problem, const Solution& solution) {
  Table table;
  table.title = "Equations of the method: largest relative residual over all steps";
  table.columns = {{"equation", true}, {"formula", true}, {"residual"}, {"in the step from t"}, {"contact", true}};
  for (const auto& r : solution.residuals) {
    table.rows.push_back({r.name, r.formula, r.value > 0 ? fmt::format("{:.2e}", r.value) : "0",
                          r.value > 0 ? fmt::format("{:.6g}", r.t) : "-",
                          r.contact >= 0 ? problem.info().contacts[r.contact].name : "-"});
    if (r.impossible > 0)
      table.note += fmt::format("{}{} has no solution at {} points, which are left out", table.note.empty() ? "" : "; ",
                                r.name, r.impossible);
  }
  return table;
}

/// The gap of a contact at its lowest, and when [m, s].
struct LowestGap {
  double gap = 0, t = 0;
};

/// Per contact, the lowest gap within a step at whose ends it is not negative: bodies have gone through each other, and
/// the method has not seen it. Found by GapSearch along the motion, however short the dip.
std::vector<LowestGap> passed_gaps(const Problem& problem, const Motion& motion) {
  constexpr int kDegree = 12;  // the highest of a piece
  constexpr int kSamples = 256;
  constexpr double kNoticed = 1e-9;  // of 1 + |q|: less is the drift of closed contacts
  const ProblemInfo& info = problem.info();
  Matrix bernstein(kDegree + 1, kDegree + 1), values(info.n_q, kDegree + 1);
  Vector s(kDegree + 1), q(info.n_q), v(info.n_q);
  for (int row = 0; row <= kDegree; ++row) {
    s[row] = 0.5 * (1 - std::cos(row * std::numbers::pi / kDegree));
    bernstein.row(row) = bernstein::basis(s[row], kDegree);
  }
  const Matrix from_values = bernstein.inverse().transpose();
  const std::vector<ContactMode> open(info.contacts.size(), ContactMode::open);
  std::vector<LowestGap> lowest(info.contacts.size());
  GapSearch search(problem, kDegree);
  for (std::size_t piece = 0; piece < motion.n_pieces(); ++piece) {
    for (int k = 0; k <= kDegree; ++k) {
      motion.within(piece, s[k], q, v);
      values.col(k) = q;
    }
    search.path() = values * from_values;
    search.begin(open);
    const double noticed = kNoticed * (1 + values.cwiseAbs().maxCoeff());
    for (const int i : info.unilateral) {
      if (search.left_gap(i) < -noticed || search.gap(i, 1) < -noticed) continue;
      const auto closing = search.first_closing(i, {.gap = noticed, .rounding = noticed});
      for (int k = 0; closing && k <= kSamples; ++k) {
        const double at = closing.to + (1 - closing.to) * k / kSamples, gap = search.gap(i, at);
        if (gap >= lowest[i].gap) continue;
        lowest[i] = {gap, motion.begin_of(piece) + at * (motion.end_of(piece) - motion.begin_of(piece))};
      }
    }
  }
  return lowest;
}

/// Violations of the conditions that hold for every motion, also measured between the steps.
Table invariant_table(const Problem& problem, const Solution& solution) {
  Table table;
  table.title = "Invariants of the motion";
  table.columns = {{"invariant", true}, {"value"}, {"at t"}};
  const auto& info = problem.info();
  std::vector<double> lowest(info.n_c(), 0), lowest_time(info.n_c(), 0);
  double gain = 0, gain_time = 0;
  std::optional<double> energy = problem.energy(info.q0, info.v0);
  const std::optional<double> first = energy;
  const Trajectory motion = trajectory_of(problem, "", "", solution);
  Vector q = info.q0, v = info.v0;
  for (std::size_t k = 0; k < motion.t.size(); ++k) {
    const double t = motion.t[k];
    std::ranges::copy(motion.q[k], q.begin());
    std::ranges::copy(motion.v[k], v.begin());
    if (info.clock >= 0) q[info.clock] = t;
    const Vector gap = problem.gap(q);
    for (int i = 0; i < info.n_c(); ++i) {
      const double depth = info.contacts[i].is_bilateral ? -std::abs(gap[i]) : gap[i];
      if (depth >= lowest[i]) continue;
      lowest[i] = depth;
      lowest_time[i] = t;
    }
    if (!first) continue;
    const double change = *problem.energy(q, v) - *first;
    if (change > gain) {
      gain = change;
      gain_time = t;
    }
  }
  for (int i = 0; i < info.n_c(); ++i) {
    const char* what =
        info.contacts[i].is_bilateral ? "largest gap of bilateral constraint" : "deepest penetration of contact";
    table.rows.push_back({fmt::format("{} '{}' [m]", what, info.contacts[i].name),
                          fmt::format("{:.3g}", std::abs(lowest[i])), fmt::format("{:.6g}", lowest_time[i])});
  }
  const auto passed = passed_gaps(problem, solution.motion);
  for (const int i : info.unilateral) {
    if (passed[i].gap == 0) continue;
    table.rows.push_back({fmt::format("passed over within a step: contact '{}' [m]", info.contacts[i].name),
                          fmt::format("{:.3g}", -passed[i].gap), fmt::format("{:.6g}", passed[i].t)});
  }
  if (first) {
    table.rows.push_back(
        {"largest energy above the initial one [J]", fmt::format("{:.3g}", gain), fmt::format("{:.6g}", gain_time)});
    table.rows.push_back({"energy at the end minus at the start [J]",
                          fmt::format("{:.6g}", *problem.energy(solution.q, solution.v) - *first),
                          fmt::format("{:.6g}", solution.t)});
  }
  return table;
}

}  // namespace

void add_audit_command(CLI::App& app, int& exit_code) {
  static AuditArguments options;
  auto* command =
      app.add_subcommand("audit", "print the residual of every equation of a method and the invariants of the motion");
  options.problem.add_problem(*command);
  options.problem.add_settings(*command);
  command->add_option("problem_id", options.problem_id, "name of a problem");
  command->add_option("method_spec,--method,-m", options.method, "method");
  command->footer(
      "Examples:\n"
      "  ricochet audit two_balls_spring fesd:radau-iia:3 --steps 200\n"
      "  ricochet audit --scene block.json moreau_jean --steps 100");
  command->callback([&exit_code] {
    options.sort();
    const auto problem = options.problem.make_problem();
    const auto method = make_method(options.method);
    Settings settings = options.problem.settings(*problem, *method);
    const bool has_steps = options.problem.is_given("--steps") || options.problem.is_given("--step-length");
    if (!has_steps && !method->info().is_adaptive) settings.steps = 200;
    if (!options.problem.is_given("--tolerance") && method->info().is_adaptive) settings.tolerance = 1e-10;
    settings.audit = true;
    settings.recording = Recording::motion;
    const Solution solution = method->solve(*problem, settings);
    fmt::print("{} on {}, {}\n", options.method, problem->info().id,
               method->info().is_adaptive ? fmt::format("tolerance {:g}", settings.tolerance)
                                          : fmt::format("{} steps", settings.steps));
    fmt::print("status: {}{}\n\n", to_string(solution.status), solution.message.empty() ? "" : ": " + solution.message);
    if (solution.residuals.empty())
      fmt::print("This method reports no equations of its own.\n\n");
    else
      fmt::print("{}\n", residual_table(*problem, solution).text());
    if (!solution.motion.empty()) fmt::print("{}\n", invariant_table(*problem, solution).text());
    if (!solution.succeeded()) exit_code = 1;
  });
}

}  // namespace ricochet
