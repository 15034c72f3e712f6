#pragma once

#include <algorithm>
#include <cmath>

#include "methods/modes/mode_dynamics.h"
#include "methods/modes/step_scheme.h"

namespace ricochet {

/// The lengths of steps whose error is estimated:
///
///   h <- h clamp(s e^(-alpha) e_before^beta),  alpha = 1 / (k + 1) - 3/4 beta                          (1)
///
/// e the error of the step as a part of the tolerance, k the order of its estimate (Gustafsson's PI controller; Hairer,
/// Wanner, Solving ODEs II, (IV.2.43)). The digits of (1) do not matter: logarithms of floats are fast.
class StepControl {
 public:
  /// @param error_order  k  @param kept_growth  up to which the length is kept, see StepScheme
  StepControl(int error_order, double kept_growth)
      : exponent_(1.0F / static_cast<float>(error_order + 1) - 0.75F * kBeta), kept_growth_(kept_growth) {}

  /// Whether a step with this error is accepted.
  static bool accepts(double e) { return e <= 1; }
  /// The factor of the length after a step that is not, for its error or for lack of a solution (infinite).
  double factor_of_rejected(double e) const {
    return std::isfinite(e) ? std::max<double>(kMinFactor, kSafety * std::exp2(-exponent_ * log(e))) : 0.1;
  }
  /// The next step repeats the last one with a shorter length, for whatever reason.
  void reject() { was_rejected_ = true; }
  /// The length after an accepted step of length h.
  double next(double h, double e) {
    const float log_e = log(e);
    const double most = was_rejected_ ? 1 : kMaxFactor;
    const double factor = kSafety * std::exp2(kBeta * last_log_error_ - exponent_ * log_e);
    last_log_error_ = std::max(log_e, kLeastLogError);
    was_rejected_ = false;
    const bool keeps_length = factor >= 1 && factor <= kept_growth_;
    return keeps_length ? h : h * std::clamp(factor, kMinFactor, most);
  }

 private:
  static constexpr float kSafety = 0.8F, kBeta = 0.04F;
  static constexpr double kMinFactor = 1.0 / 3, kMaxFactor = 6;
  static constexpr float kLeastLogError = -13;  // of e_before, 1e-4

  static float log(double e) { return std::log2(static_cast<float>(e) + 1e-30F); }

  float exponent_;  // alpha
  double kept_growth_;
  float last_log_error_ = kLeastLogError;  // e_before, binary logarithm
  bool was_rejected_ = false;
};

/// Length of the first step of a run, from two accelerations (Hairer, Norsett, Wanner, Solving ODEs I, section II.4).
/// @param step  its left end is known; the right end is overwritten  @param T  end time [s], at most as long
double first_length(StepScheme& step, ModeDynamics& dynamics, double tolerance, double T);

}  // namespace ricochet
