#include "bench/contact_solutions.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <limits>

#include "bench/timing.h"

namespace ricochet {
namespace {

constexpr int kMaxContactsOfLemke = 100;  // where its dense pivoting takes about a second
constexpr double kTooLongToRepeat = 1;    // [s]

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

ContactSolution solve_stored(const StoredContactProblem& stored, const std::string& solver, bool from_guess) {
  const ContactProblem& problem = stored.problem;
  const ContactSolverOptions options = contact_solver_options(solver);
  ContactSolution solution;
  solution.solver = solver;
  const bool has_guess = from_guess && stored.guess.size() > 0;
  const auto solve = [&] {
    solution.r = has_guess ? stored.guess : Vector(Vector::Zero(problem.G.n_rows()));
    solution.status = solve_afresh(problem, options, solution.r, solution.work);
    return 0.0;
  };
  const auto begin = std::chrono::steady_clock::now();
  solve();
  solution.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (solution.seconds < kTooLongToRepeat)
    solution.seconds = measure({{solver, solution.seconds, solve}}, true, [](double) {}).front().median;

  const Vector w = velocities(problem, solution.r);
  const ContactScale scale = scale_of(problem, solution.r);
  solution.violation = violation(problem, solution.r, w, scale, FrictionPolygon());
  solution.distance = std::numeric_limits<double>::quiet_NaN();
  if (stored.solution.size() > 0 && scale.velocity > 0)
    solution.distance = (w - velocities(problem, stored.solution)).cwiseAbs().maxCoeff() / scale.velocity;
  return solution;
}

std::vector<std::string> usual_solvers(const ContactProblem& problem) {
  std::vector<std::string> solvers;
  if (problem.G.n_contacts() <= kMaxContactsOfLemke) solvers.push_back("lemke");
  for (const char* solver : {"pgs", "newton", "interior_point"}) solvers.push_back(solver);
  if (has_siconos_contact_solver() && problem.G.n_contacts() <= kMaxContactsOfLemke) solvers.push_back("siconos");
  return solvers;
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
