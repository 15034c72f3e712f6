#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <string>

namespace ricochet {

/// Metrics of a motion beside its final error: distance to a reference motion, conserved quantities, and residuals by law
/// of contact. NaN if a quantity does not exist: no reference motion, no geometry, no potential, no impact.
struct Metrics {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  bool are_known = false;  ///< false: the run was not looked at
  std::string reason;  ///< why it was not; of a known one, why there is no reference motion; empty where all is there

  // Against the reference motion.
  double position_error = kNone;      ///< max-norm over the time of q
  double velocity_error = kNone;      ///< integral of the max-norm of v over the time, which a late impact hardly hurts
  double end_velocity_error = kNone;  ///< max-norm at the end; none with an impact within the last 1 % of the time
  double event_time_error = kNone;    ///< largest over the events that both have [s]
  double impulse_error = kNone;       ///< largest normal impulse difference over the impacts that both have [N s]
  int missed_events = 0;              ///< events that the reference alone has
  int spurious_events = 0;            ///< events that the run alone has
  double energy_error = kNone;        ///< at the end, with its sign, as all that follow away from impacts [J]
  double momentum_error = kNone;      ///< Euclidean norm, linear momentum of the bodies [N s]
  double angular_momentum_error = kNone;  ///< the same about the origin [N m s]

  // Metrics without a reference motion.
  double penetration = kNone;       ///< deepest, as bench/measure/penetration.h [m]
  double constraint_drift = kNone;  ///< largest |g| of bilateral constraints [m]

  // Residuals of the laws in the impacts that it tells (bench/measure/metrics/law_residuals.h).
  double signorini = kNone;    ///< largest distance at which an impulse acts [m]
  double restitution = kNone;  ///< largest |min(v_n+ + e v_n-, W Lambda_n)| under Newton's hypothesis [m/s]
  double cone = kNone;         ///< largest W max(0, |Lambda_t| - mu Lambda_n) [m/s]
  double dissipation = kNone;  ///< largest |v_t| + Lambda_t' v_t / (mu Lambda_n) [m/s]

  // The same in persistent contact, where the reference has one, by the forces that the interpolated motion needs.
  double contact_gap = kNone;          ///< largest distance of a closed contact [m]
  double contact_pull = kNone;         ///< integral of W max(0, -lambda_n) over the time [m/s]
  double contact_cone = kNone;         ///< integral of W max(0, |lambda_t| - mu lambda_n) [m/s]
  double contact_dissipation = kNone;  ///< integral of |mu lambda_n |v_t| + lambda_t' v_t| [J]
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Metrics, are_known, reason, position_error, velocity_error,
                                                end_velocity_error, event_time_error, impulse_error, missed_events,
                                                spurious_events, energy_error, momentum_error, angular_momentum_error,
                                                penetration, constraint_drift, signorini, restitution, cone,
                                                dissipation, contact_gap, contact_pull, contact_cone,
                                                contact_dissipation)

}  // namespace ricochet
