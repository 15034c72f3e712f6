#pragma once

#include <optional>
#include <string>
#include <vector>

#include "methods/contact_laws/impact_sequence.h"
#include "methods/method.h"
#include "methods/modes/event_functions.h"
#include "methods/modes/mode_dynamics.h"
#include "methods/modes/step_ends.h"
#include "methods/runge_kutta/embedded_tableau.h"
#include "methods/variations/point_variation.h"

namespace ricochet {

/// Derivatives of an event-driven run with respect to initial values and parameters theta: S = d(q, v)/d theta at a
/// fixed time, one column per theta. Between events, with the derivatives of a by (3)-(5) of point_variation.h,
///
///   S' = d(v, a) = (S_v, a_q S_q + a_v S_v + a_theta)                                    (1)
///
/// is integrated by the pair and the steps of the motion, so S is the derivative of the steps that are taken, at fixed
/// lengths:
///
///   S_i = S_0 + h sum_j A_ij S'_j,   S_1 = S_0 + h sum_i b_i S'_i,   error h sum_i e_i S'_i      (2)
///
/// An event is where its function g of event_functions.h vanishes, at t(theta):
///
///   dt = -(g_q S_q + g_v S_v + g_theta) / (g_q v + g_v a)                                (3)
///
/// Where slip in space stops, g is the slip velocity, whose components vanish together, and dt is the least error of
/// both. With the map R of the event and f = (v, a) before and after it,
///
///   S+ = d[R](S- + f- dt) - f+ dt                                                        (4)
///
/// R is the identity where contacts break, stick or slip: then S jumps by (f- - f+) dt, zero where accelerations are
/// continuous. Impacts are (1), (2), (5) of point_variation.h, one after the other where they follow each other. S+ is
/// projected onto the closed contacts, like the state.
///
/// Slip in space that begins from rest has the direction n of its slip velocity s in the middle of a short step, held
/// over the whole of it (EventDrivenRun::start_slip). It turns by
///
///   d phi = n_perp' ds_mid / |s_mid|,   ds_mid affine in d phi                           (5)
///
/// At the end of the run dq = S_q + v dT, dv = S_v + a dT.                                (6)
class EventSensitivity {
 public:
  /// All references must outlive this object. @throws InputError as VariedProblem
  EventSensitivity(const Problem& problem, const EmbeddedTableau& pair, const ContactScales& scales,
                   ModeDynamics& dynamics, const Settings& settings);
  EventSensitivity(const EventSensitivity&) = delete;

  /// (2) from the left end of a step of length h. @return the largest error of a column, in parts of the tolerance;
  /// infinite when there is no acceleration somewhere. The dynamics has the forces of the last stage.
  double take(const StepEnds& ends, double h);
  /// Accepts the last take().
  void accept();
  /// (5) and (2) for the step in which these contacts, whose directions the dynamics holds, begin to slip.
  bool take_slip_start(const StepEnds& ends, double h, const std::vector<int>& contacts);
  /// The last dt [s] of a slip that stops, with the acceleration held.
  void move_at_constant_acceleration(const Vector& q, const Vector& v, const Vector& a, double dt);

  /// (3) and S- + f- dt, at a point whose forces the dynamics has. @return why there is no derivative, or nothing
  std::optional<std::string> reach(const DetectedEvent& event, const Vector& q, const Vector& v, const Vector& a);
  /// The impacts there. @param before  modes of the contacts
  std::optional<std::string> apply_impacts(const std::vector<ImpactSequence::Impact>& impacts,
                                           const std::vector<ContactMode>& before, const Vector& q);
  /// (4) after it, in the modes of the dynamics. @param a  of the new modes
  std::optional<std::string> leave(const std::vector<ContactMode>& before, const Vector& q, const Vector& v,
                                   const Vector& a);
  const Vector& dt() const { return dt_; }  ///< n_theta, of the last event

  /// (6), into the solution.
  void finish(const Vector& q, const Vector& v, const Vector& a, Solution& solution);

 private:
  struct Variation {
    Matrix q, v;  // n_q x columns
  };
  bool integrate(const StepEnds& ends, double h, const Variation& from);
  Matrix accelerations(const Vector& q, const Vector& v, const Vector& a, const Variation& S);
  void set_forces();
  double error(double h) const;
  Eigen::RowVectorXd gap_variation(int contact, const Vector& q, const Matrix& dq) const;
  std::optional<std::string> closes_apart(int contact, const Vector& q) const;

  const Problem& problem_;
  const ProblemInfo& info_;
  const EmbeddedTableau& pair_;
  const ContactScales& scales_;
  ModeDynamics& dynamics_;
  const double tolerance_;
  const VariedProblem varied_;
  const PointVariation point_;
  Variation S_, next_;                     // next_: at the right end of the step at hand
  std::vector<Matrix> stage_v_, stage_a_;  // S'_j of (2), n_q x n_theta each
  Matrix v_, a_;                           // stages of the motion, n_q x n_s
  Vector q1_, v1_;                         // right end of the motion
  Vector lambda_n_, lambda_t_;             // of the dynamics
  Vector dt_;
  Matrix size_q_;  // what cancels in S_q at an event
  Matrix turns_;   // (5), n_c x n_theta
  double h_ = 0;   // [s], of the last step
};

}  // namespace ricochet
