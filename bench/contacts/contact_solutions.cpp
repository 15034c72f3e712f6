#include "bench/contacts/contact_solutions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/measure/timing.h"
#include "methods/contact_laws/redundant_contacts.h"
#include "reports/quantile.h"

namespace ricochet {
namespace {

constexpr double kTooLongToRepeat = 1;  // [s]
constexpr int kFewRuns = 3;
constexpr double kLongEnough = 1e-3;       // [s]; shorter solves are timed many together
constexpr double kLeast = 1e-7;            // [s]; of a solve that the clock takes for none
constexpr int kMostRowsOfInternal = 1000;  // above, the eigenvalues take longer than the solvers

Vector velocities(const ContactProblem& problem, const Vector& r) {
  Vector w(problem.G.n_rows());
  problem.G.times(r, problem.b, w);
  return w;
}

}  // namespace

ContactSolverOptions contact_solver_options(const std::string& solver) {
  const MethodSpec spec("contacts,solver=" + solver);
  const ContactSolverOptions options = contact_solver_argument(spec);
  spec.finish(0);
  return options;
}

ContactStatus solve_afresh(const ContactProblem& problem, const ContactSolverOptions& options, Vector& r,
                           Counters& work) {
  const auto fresh = make_contact_solver(options);
  const ContactStatus status = fresh->solve(problem, r);
  work = {};
  fresh->count(work);
  return status;
}

ContactSolution solve_stored(const StoredContactProblem& stored, const std::string& solver, bool from_guess,
                             Timer timer) {
  const ContactProblem& problem = stored.problem;
  const ContactSolverOptions options = contact_solver_options(solver);
  ContactSolution solution;
  solution.solver = solver;
  const bool has_guess = from_guess && stored.guess.size() > 0;
  const auto solve = [&] {
    solution.r = has_guess ? stored.guess : Vector(Vector::Zero(problem.G.n_rows()));
    solution.status = solve_afresh(problem, options, solution.r, solution.work);
  };
  const auto seconds_of = [&](int solves) {
    const double begin = cpu_seconds();
    for (int k = 0; k < solves; ++k) solve();
    return (cpu_seconds() - begin) / solves;
  };
  solution.seconds = seconds_of(1);
  if (solution.seconds < kTooLongToRepeat && timer == Timer::benchmark) {
    const auto run = [&] {
      solve();
      return 0.0;
    };
    solution.seconds = time_runs({{solver, solution.seconds, run}}, true, [](double) {}).front().median;
  } else if (solution.seconds < kTooLongToRepeat / 100 && timer == Timer::a_few_runs) {
    const int together = std::max(1, static_cast<int>(kLongEnough / std::max(solution.seconds, kLeast)));
    std::vector<double> times;
    for (int k = 0; k < kFewRuns; ++k) times.push_back(seconds_of(together));
    solution.seconds = median(times);
  }

  const Vector w = velocities(problem, solution.r);
  const ContactScale scale = scale_of(problem, solution.r);
  solution.violation = violation(problem, solution.r, w, FrictionPolygon());
  solution.residuals = residuals_of(problem, solution.r, w);
  solution.fclib_merit = fclib_merit(problem, solution.r, w);
  solution.internal = std::numeric_limits<double>::quiet_NaN();
  if (timer == Timer::benchmark && problem.G.n_rows() <= kMostRowsOfInternal && solution.r.norm() > 0)
    solution.internal = RedundantContacts(problem).internal_part(solution.r).norm() / solution.r.norm();
  solution.distance = std::numeric_limits<double>::quiet_NaN();
  if (stored.solution.size() > 0 && scale.velocity > 0)
    solution.distance = (w - velocities(problem, stored.solution)).cwiseAbs().maxCoeff() / scale.velocity;
  return solution;
}

std::vector<std::string> usual_solvers(Eigen::Index contacts) {
  std::vector<std::string> solvers;
  for (const auto& entry : contact_solvers()) {
    if (contacts <= entry.most_contacts) solvers.emplace_back(entry.name);
  }
  return solvers;
}

nlohmann::json contact_solution_json(const StoredContactProblem& stored, const ContactSolution& s) {
  if (!s.declined.empty())
    return {{"problem", stored.title},
            {"contacts", stored.problem.G.n_contacts()},
            {"solver", s.solver},
            {"solved", false},
            {"declined", s.declined}};
  return {{"problem", stored.title},
          {"contacts", stored.problem.G.n_contacts()},
          {"solver", s.solver},
          {"solved", s.status == ContactStatus::solved},
          {"violation", s.violation},
          {"signorini", s.residuals.signorini},
          {"pull", s.residuals.pull},
          {"approach", s.residuals.approach},
          {"cone", s.residuals.cone},
          {"dissipation", s.residuals.dissipation},
          {"angle", s.residuals.angle},
          {"fclib_merit", s.fclib_merit},
          {"internal_force", s.internal},
          {"pivots", s.work.pivots},
          {"iterations", s.work.inner_iterations},
          {"factorizations", s.work.matrix_factorizations},
          {"seconds", s.seconds},
          {"velocities_from_file", s.distance}};
}

Table contact_residual_table(const std::vector<ContactSolution>& solutions) {
  using S = ContactSolution;
  const auto law = [](double ContactResiduals::*member) {
    return [member](const S& s) { return s.residuals.*member > 0 ? s.residuals.*member : 0.0; };
  };
  static const std::vector<Column<S>> columns = {
      {"solver", [](const S& s) { return s.solver; }},
      {"|r_n w_n|", "J", "{:.1e}", law(&ContactResiduals::signorini)},
      {"r_n < 0", "N s", "{:.1e}", law(&ContactResiduals::pull)},
      {"w_n < 0", "m/s", "{:.1e}", law(&ContactResiduals::approach)},
      {"cone", "N s", "{:.1e}", law(&ContactResiduals::cone)},
      {"dissipation", "J", "{:.1e}", law(&ContactResiduals::dissipation)},
      {"angle", "rad", "{:.1e}", law(&ContactResiduals::angle)},
      {"violation", "", "{:.1e}", &S::violation},
      {"FCLib's merit", "", "{:.1e}", &S::fclib_merit},
      {"internal force", "", "{:.2g}", &S::internal},
  };
  return table_of("Residuals law by law", columns, solutions,
                  "largest over the contacts; violation: relative, of all laws; internal force: part of the impulses "
                  "that moves nothing");
}

Table contact_solution_table(const StoredContactProblem& stored, const std::vector<ContactSolution>& solutions) {
  Table table;
  table.title = stored.title;
  table.note = stored.math_info + "; violation of the laws with the disc, where lemke has a polygon in space";
  table.columns = {{"solver", true}, {"status", true},   {"violation"}, {"pivots"},
                   {"iterations"},   {"factorizations"}, {"ms"},        {"w from the file's"}};
  const auto count = [](auto n) { return n > 0 ? std::to_string(n) : "-"; };
  for (const auto& s : solutions) {
    table.rows.push_back({s.solver, s.status == ContactStatus::solved ? "solved" : reason_of(s.status),
                          scientific(s.violation), count(s.work.pivots), count(s.work.inner_iterations),
                          count(s.work.matrix_factorizations), fmt::format("{:.3g}", 1e3 * s.seconds),
                          scientific(s.distance)});
  }
  return table;
}

}  // namespace ricochet
