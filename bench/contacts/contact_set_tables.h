#pragma once

#include <string>
#include <vector>

#include "bench/contacts/contact_solutions.h"
#include "reports/performance_profile.h"

namespace ricochet {

/// Conditioning of a contact problem: its size, the condition of the Delassus operator without its null space, and the
/// dimension of the null space, which is due to redundant contacts.
struct Conditioning {
  std::string scene;  ///< the text of the title up to the first comma
  int contacts = 0, rows = 0, redundant = 0;
  double condition = 0;
};
Conditioning conditioning_of(const StoredContactProblem& stored);

/// A line per scene, and one for all scenes.
Table conditioning_table(const std::vector<Conditioning>& problems);

/// Solves a problem with a new solver and measures the time. A problem that the solver declines, or with too many
/// contacts for it, is not solved; the solution has the reason. @throws InputError for an unknown contact solver
ContactSolution solve_of_set(const StoredContactProblem& stored, const std::string& solver, bool from_guess = false,
                             Timer timer = Timer::a_few_runs);

/// Solutions of a set of contact problems by several solvers.
struct ContactSetSolutions {
  std::vector<std::string> solvers;
  std::vector<std::vector<ContactSolution>> solutions;  ///< [solver][problem]

  /// CPU time; infinite if not solved.
  PerformanceProfile profile(double accuracy) const;
  bool all_are_solved() const;  ///< except those that were declined
};

/// Runs each solver on each problem, by solve_of_set().
ContactSetSolutions solve_set(const std::vector<StoredContactProblem>& problems,
                              const std::vector<std::string>& solvers, bool from_guess = false);

/// Internal forces of the solvers on problems with redundant contacts (redundant_contacts.h).
Table internal_force_table(const std::vector<StoredContactProblem>& problems, const ContactSetSolutions& set,
                           double accuracy);

}  // namespace ricochet
