#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "methods/contact_laws/contact_file.h"
#include "methods/contact_laws/contact_residuals.h"
#include "methods/contact_laws/solvers/contact_solver.h"
#include "reports/table.h"

namespace ricochet {

/// Result of one solver on one contact problem.
struct ContactSolution {
  std::string solver;
  std::string declined;  ///< reason, if it was not solved at all; the other members are then meaningless
  ContactStatus status = ContactStatus::iteration_limit;
  double violation = 0;        ///< relative violation of the laws with the exact cone
  ContactResiduals residuals;  ///< residual of each law, with units
  double fclib_merit = 0;
  double internal = 0;  ///< ||r_0|| / ||r|| of redundant_contacts.h; NaN if not requested
  double distance = 0;  ///< relative distance of the velocities from the stored solution; NaN if there is none
  Counters work;
  double seconds = 0;  ///< CPU time, median
  Vector r;
};

/// @param solver  as in the option `solver=` of a method: "lemke,facets=16"; @throws InputError
ContactSolverOptions contact_solver_options(const std::string& solver);

/// Solves once, with a new solver, because solvers keep data.
/// @param r  G.n_rows(): in the guess, out the solution  @param work  of this solve
ContactStatus solve_afresh(const ContactProblem& problem, const ContactSolverOptions& options, Vector& r,
                           Counters& work);

/// Accuracy of a time: by Google Benchmark; or, for many problems, the median of three samples of a millisecond, or of
/// one solve that takes more than 10 ms; or one solve, if the time is not needed. It includes the construction of the
/// solver.
enum class Timer { benchmark, a_few_runs, one_run };

/// Solves repeatedly and measures the time.
/// @param from_guess  start from the stored guess instead of zero
ContactSolution solve_stored(const StoredContactProblem& stored, const std::string& solver, bool from_guess,
                             Timer timer = Timer::benchmark);

/// The solvers of this build that end in reasonable time for this number of contacts; all solvers without a number.
std::vector<std::string> usual_solvers(Eigen::Index contacts = 0);

nlohmann::json contact_solution_json(const StoredContactProblem& stored, const ContactSolution& solution);
/// Residuals of each solution, law by law.
Table contact_residual_table(const std::vector<ContactSolution>& solutions);
Table contact_solution_table(const StoredContactProblem& stored, const std::vector<ContactSolution>& solutions);

}  // namespace ricochet
