#pragma once

#include <optional>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"
#include "reference/integrator.h"
#include "reference/scales.h"

namespace ricochet::reference {

/// Gaps that become negative and positive again within one step: a grazing impact has no change of sign that root
/// finding could see. But the gap has a minimum in between,
///
///   J_n' v = 0, from below                                                              (1)
///
/// which shows as a change of sign of the rate between pieces of the step. There the gap is looked at, by the
/// interpolation of the step. That steps resolve the gap, not only q and v, is left to the error control.
class DippingGaps {
 public:
  struct Closing {
    int contact = -1;
    double t = 0;  ///< [s]
  };

  /// @param tolerance  of the integration: a minimum less deep than its error is none
  DippingGaps(const Problem& problem, const Scales& scales, Integrator& integrator, double tolerance);

  /// The first open contact whose gap closed and opened again between `from` and `to`, in the last step.
  std::optional<Closing> closing(double from, double to, const std::vector<ContactMode>& modes);

 private:
  std::optional<Closing> dip(int i, double from, double begin, double end);
  void set_rates(double t, Vector& rates);

  const Problem& problem_;
  const Scales& scales_;
  Integrator& integrator_;
  const double tolerance_;
  Vector packed_n_;
  Vector rates_, before_, rates_t_;  // n_c, J_n' v: at the end and the beginning of the step, and within
};

}  // namespace ricochet::reference
