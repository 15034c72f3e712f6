#pragma once

#include <string>
#include <vector>

#include "reports/chart.h"
#include "reports/section.h"
#include "reports/table.h"

namespace ricochet {

/// Performance profiles of solvers s over the same problems p, from the cost t of each, infinity for a failure:
///
///   rho_s(tau) = share of all p with t_ps <= tau min_s' t_ps'                                            (1)
///
/// rho_s(1) is how often s is cheapest, rho_s(infinity) what it solves at all. Problems that nobody solves count, so that
/// no curve reaches 1 then. Which solver is second does not follow from the order of the curves where the first is far
/// ahead (Gould, Scott, ACM TOMS 43 (2016), note): a profile of two answers that.
///
/// Source: Dolan, More, Math. Program. 91 (2002) 201-213.
class PerformanceProfile {
 public:
  /// @param costs  [solver][problem], positive or infinite
  PerformanceProfile(std::vector<std::string> solvers, std::vector<std::vector<double>> costs);

  std::size_t n_problems() const { return ratios_.empty() ? 0 : ratios_.front().size(); }
  double share(std::size_t solver, double tau) const;  ///< (1)
  double solved(std::size_t solver) const;             ///< rho_s(infinity)
  double largest_ratio() const;                        ///< that is finite; 1 where there is none

  /// A line per solver: what it solves, and rho at 1, 2, 5, 10, 100.
  Table table(const std::string& title) const;
  /// rho over tau, logarithmic: a step for every problem that a solver solves. A picture shows the kMostCurves solvers that
  /// solve most.
  Chart chart(const std::string& name, const std::string& file, const std::string& title,
              const std::string& caption) const;
  /// The chart, and below it the table, as NAME_shares.
  void show(Section& section, const std::string& name, const std::string& title, const std::string& caption,
            const std::string& file) const;

 private:
  static constexpr std::size_t kMostCurves = 12;

  std::vector<double> finite_ratios(std::size_t solver) const;  // ascending

  std::vector<std::string> solvers_;
  std::vector<std::vector<double>> ratios_;  // [solver][problem]
};

}  // namespace ricochet
