#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/contacts/contact_set_tables.h"
#include "reports/performance_profile.h"
#include "reports/table.h"

namespace ricochet {

/// Result of one solver on one recorded contact problem, with the conditioning of the problem.
struct ContactSolve : Conditioning {
  static constexpr const char* kKind = "contact_solve";

  std::string problem;  ///< its title: scene, method, step
  std::string solver;
  std::string status;    ///< "solved", or the reason why not; "declined"
  double violation = 0;  ///< of the laws with the disc, relative; NaN where there is no solution
  double seconds = 0;    ///< CPU time from zero, median, with the making of the solver; NaN where it is not measured
  std::int64_t pivots = 0, iterations = 0, factorizations = 0;

  bool is_timed() const { return seconds > 0; }
  bool is_solved(double accuracy) const { return status == "solved" && violation <= accuracy; }
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ContactSolve, problem, scene, contacts, rows, redundant, condition,
                                                solver, status, violation, seconds, pivots, iterations, factorizations)

/// CPU time of all solvers on the problems with at least so many contacts; infinite where one is not solved.
PerformanceProfile contact_profile(const std::vector<ContactSolve>& solves, int least_contacts, double accuracy);

/// One line per problem's scene: conditioning_table().
Table recorded_conditioning(const std::vector<ContactSolve>& solves);
/// One line per solver: solved, violation, work and time.
Table solver_table(const std::vector<ContactSolve>& solves, double accuracy);
/// One line per scene and solver.
Table solver_scene_table(const std::vector<ContactSolve>& solves, double accuracy);

}  // namespace ricochet
