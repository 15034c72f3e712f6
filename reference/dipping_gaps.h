#pragma once

#include <optional>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"
#include "reference/cvode.h"

namespace ricochet::reference {

/// Gaps that become negative and positive again within one step of CVODE: a grazing impact has no change of sign that
/// CVODE's root finding could see. But the gap has a minimum in between,
///
///   J_n' v = 0, from below                                                              (1)
///
/// which shows as a change of sign of the rate between the ends of the step. There the gap is looked at, by the
/// interpolation of the step.
class DippingGaps {
 public:
  struct Closing {
    int contact = -1;
    double t = 0;  ///< [s]
  };

  /// @param tolerance  of the integration: a minimum less deep than its error is none
  DippingGaps(const Problem& problem, const Cvode& cvode, double tolerance);

  /// The state that the next step starts from.
  void start(const Vector& q, const Vector& v) { set_rates(q, v, rates_); }

  /// The first open contact whose gap closed between `from` and `to`, in the last step of CVODE, where it reached q, v
  /// with an open gap.
  std::optional<Closing> closing(double from, double to, const Vector& q, const Vector& v,
                                 const std::vector<ContactMode>& modes);

 private:
  void set_rates(const Vector& q, const Vector& v, Vector& rates);
  void interpolate(double t, Vector& q, Vector& v) const;

  const Problem& problem_;
  const Cvode& cvode_;
  const double tolerance_;
  Vector packed_n_;
  Vector rates_, before_, rates_t_;  // n_c, J_n' v: at the end and the beginning of the step, and within
};

}  // namespace ricochet::reference
