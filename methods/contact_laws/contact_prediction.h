#pragma once

#include <span>
#include <vector>

#include "methods/contact_laws/delassus.h"
#include "methods/contact_laws/friction_problem.h"
#include "methods/linear_algebra/band_lu.h"

namespace ricochet {

/// Solves the contact laws of one instant, (1)-(4) of friction_problem.h, for many contacts that move each other and
/// are nearly all closed, as in a column of blocks or a row of beads. Predicts the mode of every contact, solves
///
///   closed: w_n = 0,   open: r = 0,   stick: w_t = 0,   slip: r_t = -mu r_n d                            (1)
///
/// and corrects modes until none has a wrong sign: closed with r_n <= 0, open with w_n < 0, stick outside of the cone,
/// slip in the plane against its friction. The first prediction is that all are closed and stick, but for those that
/// slide already. With G as sparse as the contacts are far apart, (1) is a band matrix when contacts are numbered along
/// their breadth-first levels: the cost is in proportion to their number.
///
/// Ends without a solution where the modes do not settle, where contacts are redundant, and where friction in space is
/// not linear: slip that begins, and friction polygons.
class ContactPrediction {
 public:
  /// @param b  rows of G; @param rounding  error bound of b
  /// @param r  overwritten; contacts: modes are set. @return whether r is the solution
  bool solve(const Delassus& G, const Eigen::Ref<const Vector>& b, double rounding,
             std::span<FrictionProblem::Contact> contacts, Eigen::Ref<Vector> r);

 private:
  void order_by_levels(const Delassus& G);
  bool solve_linear(const Delassus& G, const Eigen::Ref<const Vector>& b,
                    std::span<const FrictionProblem::Contact> contacts, Eigen::Ref<Vector> r);

  std::vector<int> order_, place_, first_;  // contacts along the levels, where each stands, its first unknown
  BandLu band_;
  std::vector<double> x_;
  Vector w_;
};

}  // namespace ricochet
