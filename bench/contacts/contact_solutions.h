#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "methods/contact_laws/contact_file.h"
#include "methods/contact_laws/contact_residuals.h"
#include "methods/contact_laws/solvers/contact_solver.h"
#include "reports/table.h"

namespace ricochet {

/// What one solver makes of one contact problem.
struct ContactSolution {
  std::string solver;
  std::string declined;  ///< why it was not solved at all; what follows is then as it is here, without a meaning
  ContactStatus status = ContactStatus::iteration_limit;
  double violation = 0;        ///< of the laws with the exact cone, relative
  ContactResiduals residuals;  ///< the same law by law, in units
  double fclib_merit = 0;
  double internal = 0;  ///< ||r_0|| / ||r|| of redundant_contacts.h; NaN where it is not asked for
  double distance = 0;  ///< of the velocities from those of the stored solution, relative; NaN where there is none
  Counters work;
  double seconds = 0;  ///< CPU time, median
  Vector r;
};

/// @param solver  as behind `solver=` of a method: "lemke,facets=16"; @throws InputError
ContactSolverOptions contact_solver_options(const std::string& solver);

/// Once, by a new solver, since solvers remember.
/// @param r  G.n_rows(): in a guess, out the solution  @param work  of this solve
ContactStatus solve_afresh(const ContactProblem& problem, const ContactSolverOptions& options, Vector& r,
                           Counters& work);

/// How well a time is to be known: by Google Benchmark, or as the median of three samples of a millisecond, or of one solve
/// from 10 ms on, where there are many problems; or of one solve, where nobody asks. The making of the solver is part of
/// it.
enum class Timer { benchmark, a_few_runs, one_run };

/// The same again and again, with its time.
/// @param from_guess  start from the stored guess, instead of zero
ContactSolution solve_stored(const StoredContactProblem& stored, const std::string& solver, bool from_guess,
                             Timer timer = Timer::benchmark);

/// The solvers of this build, of those that end in reasonable time with so many contacts; all of them without a number.
std::vector<std::string> usual_solvers(Eigen::Index contacts = 0);

nlohmann::json contact_solution_json(const StoredContactProblem& stored, const ContactSolution& solution);
/// Law by law: how far each solution is from each of them.
Table contact_residual_table(const std::vector<ContactSolution>& solutions);
Table contact_solution_table(const StoredContactProblem& stored, const std::vector<ContactSolution>& solutions);

}  // namespace ricochet
