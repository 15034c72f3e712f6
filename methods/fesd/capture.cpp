#include "methods/fesd/capture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/dense_solve.h"

namespace ricochet {

bool Capture::absorbs() const {
  return std::isfinite(kappa) && std::abs(kept) < 1e-10;  // else it is 1 in size: what lies between is rounding
}

double Capture::rest_time_bound(double h, double e) const {
  return 2 * h / (std::max(2.0, kappa) * (1 - e));  // (4)
}

Capture capture(const ButcherTableau& tableau) {
  const FullPivotingFactors A(tableau.A);
  if (!A.is_invertible()) return {std::numeric_limits<double>::infinity(), 1};
  const Vector rates = A.solve(Vector::Ones(tableau.n_s));
  return {rates.maxCoeff(), 1 - tableau.b.dot(rates)};  // (3), (2)
}

}  // namespace ricochet
