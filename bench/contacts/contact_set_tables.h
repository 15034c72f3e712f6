#pragma once

#include <string>
#include <vector>

#include "bench/contacts/contact_solutions.h"
#include "reports/performance_profile.h"

namespace ricochet {

/// How hard a contact problem is: its size, the condition of the Delassus operator without its null space, and how many
/// rows are in that: redundant contacts.
struct Conditioning {
  std::string scene;  ///< the text of the title up to the first comma
  int contacts = 0, rows = 0, redundant = 0;
  double condition = 0;
};
Conditioning conditioning_of(const StoredContactProblem& stored);

/// A line per scene, and one of all.
Table conditioning_table(const std::vector<Conditioning>& problems);

/// By a new solver, with its time. What the solver declines, and problems with more contacts than it is compared on, are
/// not solved: the solution says why. @throws InputError for a name that is no contact solver
ContactSolution solve_of_set(const StoredContactProblem& stored, const std::string& solver, bool from_guess = false,
                             Timer timer = Timer::a_few_runs);

/// What solvers make of a set of contact problems.
struct ContactSetSolutions {
  std::vector<std::string> solvers;
  std::vector<std::vector<ContactSolution>> solutions;  ///< [solver][problem]

  /// CPU time; infinite where it is not solved
  PerformanceProfile profile(double accuracy) const;
  bool all_are_solved() const;  ///< but for those that were declined
};

/// Each solver on each problem, solve_of_set().
ContactSetSolutions solve_set(const std::vector<StoredContactProblem>& problems,
                              const std::vector<std::string>& solvers, bool from_guess = false);

/// Internal forces of the solvers on those problems that have redundant contacts (redundant_contacts.h).
Table internal_force_table(const std::vector<StoredContactProblem>& problems, const ContactSetSolutions& set,
                           double accuracy);

}  // namespace ricochet
