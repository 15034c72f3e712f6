#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bench/contact_solutions.h"
#include "reports/performance_profile.h"

namespace ricochet {

/// How hard the contact problems of each scene are: numbers of contacts, condition of the Delassus operator without its
/// null space, and how many have a null space: redundant contacts. A line per scene, the text of titles up to the first
/// comma, and one of all.
Table conditioning_table(const std::vector<StoredContactProblem>& problems);

/// What solvers make of a set of contact problems.
struct ContactSetSolutions {
  std::vector<std::string> solvers;
  std::vector<std::vector<ContactSolution>> solutions;  ///< [solver][problem]

  /// CPU time; infinite where the status is not `solved` or the violation of the laws with the disc above `accuracy`,
  /// whatever the solver's own tolerance
  PerformanceProfile profile(double accuracy) const;
};

/// Each solver on each problem, from zero. What a solver declines, and lemke above 100 contacts, counts as not solved.
/// @param told  is told each share of the work that is done
ContactSetSolutions solve_set(const std::vector<StoredContactProblem>& problems,
                              const std::vector<std::string>& solvers, const std::function<void(double)>& told);

/// Internal forces of the solvers on those problems that have redundant contacts (redundant_contacts.h).
Table internal_force_table(const std::vector<StoredContactProblem>& problems, const ContactSetSolutions& set,
                           double accuracy);

}  // namespace ricochet
