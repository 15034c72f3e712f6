#pragma once

#include <string>
#include <vector>

#include "bench/contact_solutions.h"
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

/// From zero, by a new solver, with its time. What a solver declines, and lemke above
/// kMostContactsOfLemke, is not solved, with the time zero.
ContactSolution solve_of_set(const StoredContactProblem& stored, const std::string& solver,
                             Timer timer = Timer::a_few_runs);

/// What solvers make of a set of contact problems.
struct ContactSetSolutions {
  std::vector<std::string> solvers;
  std::vector<std::vector<ContactSolution>> solutions;  ///< [solver][problem]

  /// CPU time; infinite where it is not solved
  PerformanceProfile profile(double accuracy) const;
};

/// Each solver on each problem, solve_of_set().
ContactSetSolutions solve_set(const std::vector<StoredContactProblem>& problems,
                              const std::vector<std::string>& solvers);

/// Internal forces of the solvers on those problems that have redundant contacts (redundant_contacts.h).
Table internal_force_table(const std::vector<StoredContactProblem>& problems, const ContactSetSolutions& set,
                           double accuracy);

}  // namespace ricochet
