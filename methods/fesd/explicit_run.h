#pragma once

#include <memory>
#include <vector>

#include "methods/contact_laws/contact_scales.h"
#include "methods/fesd/run_solver.h"
#include "methods/fesd/step_buffers.h"
#include "methods/modes/event_functions.h"
#include "methods/modes/mode_dynamics.h"
#include "methods/modes/step_scheme.h"
#include "methods/runge_kutta/embedded_tableau.h"

namespace ricochet {

/// A RunSolver whose elements are steps of an explicit pair, with stages in sequence:
///
///   q_i = q_0 + h sum_j<i A_ij v_j,   v_i = v_0 + h sum_j<i A_ij a_j                       (1)
///   M a_i = f + C lambda_i,   R' a_i + b = 0                                               (2)
///   q_1 = P_q (q_0 + h sum_i b_i v_i),   v_1 = P_v (v_0 + h sum_i b_i a_i)                 (3)
///
/// (2) is that of mode_dynamics.h: closed contacts hold at the level of accelerations. If one of them is curved, P moves
/// q_1 and v_1 to where its gap and its rates vanish (ModeDynamics::project). No system of stages is solved.
///
/// Stages of low order do not show whether a gap is negative. So the sign conditions hold at the right end, and along the
/// polynomial between the ends where it is exact enough to tell (event_functions.h); an element for which it is not is
/// too long. A switch at the right end is solved for by its own equation,
///
///   phi(q_1(h), v_1(h)) = 0,   h <- h - phi / phi'                                         (4)
///
/// from the zero of the polynomial on. The last change dh shifts the right end along its Taylor polynomial of second
/// degree, if what that leaves of (3) is rounding, with e the error estimate of the element:
///
///   |dh| e <= eps h,   dh^2 |a_1 - a_0| <= eps h (1 + |v_1|)                                (5)
///
/// Slip in space has no direction where it stops. An element ends where the slip has slowed down to a small speed
/// (event_functions.h). From there, with its acceleration held, u = J_t' v is nearest to zero after dt, at the distance
/// |u_n|. If that is a stop within the tolerance,
///
///   |u_n| <= (1 + |v|) tolerance / 10   or   |u| |u_n| / |u'| <= (1 + |q|) tolerance / 10,    (6)
///
/// the next element has the direction d of friction held, up to where d' u = 0, and P removes what is left of u there.
/// Else slip goes on, down to half the speed. Contacts that are as slow stop together, if |u + dt u'| of each is below the
/// first bound of (6).
class ExplicitRunSolver final : public RunSolver {
 public:
  /// All arguments must outlive this object.
  ExplicitRunSolver(const Problem& problem, const EmbeddedTableau& pair, ContactScales& scales, StepBuffers& buffers,
                    Counters& counters);

  void set_motion_tolerance(double tolerance) override { tolerance_ = tolerance; }
  void keep_stages(bool keeps) override { keeps_stages_ = keeps; }
  void restart() override;
  void begin_step() override { shortest_load_ = 0; }
  double shortest_load() const override { return shortest_load_; }
  std::optional<Trial> trial() const override { return trial_; }

  /// `count` is 1. In the first element of a run the length may be shorter: first_length().
  StepFailure equal_elements(int first, int count, double h) override;
  bool run_to_switch(int first, int count, Violation violation, double remaining, SearchBudget& budget) override;
  bool run_to_time(int, int, double, SwitchKind, int, SearchBudget&) override { return false; }
  std::int64_t skip_elements(Element&, double, std::int64_t, int) override { return 0; }

 private:
  bool begin(Element& e, const ElementStart& start);
  bool has_right_end_at(const Element& e) const;
  bool set_left_end(Element& e, const ElementStart& start);
  bool take(double h);
  bool reach(DetectedEvent& event, double& h);
  double value_at_end(const DetectedEvent& event);
  bool may_stop(double& duration);
  void hold_directions();
  StepFailure stop_slip(int first, double duration);
  bool end_at_rest(const Element& e);
  bool is_shift(double dh, double h) const;
  bool shift_to(const DetectedEvent& event, double dh, double& h);
  bool run_to_stop(int first, double remaining);
  void end_with(const Switch& end, int element);
  void copy_forces(double* lambda_n, double* lambda_t) const;
  void record_forces(Element& e);
  void record(Element& e);
  void record_stages(Element& e);

  const ProblemInfo& info_;
  const EmbeddedTableau& pair_;
  ContactScales& scales_;
  StepBuffers& buffers_;
  ModeDynamics dynamics_;
  EventFunctions functions_;
  std::unique_ptr<StepScheme> step_;
  double tolerance_ = 0;
  bool is_curved_ = false;  // a closed contact
  bool keeps_stages_ = false;
  /// Ends of the step at which functions and accelerations are known.
  enum class Known : std::uint8_t { nothing, left_end, both_ends };
  Known known_ = Known::nothing;
  bool is_first_ = true;                            // element of a run
  bool is_projected_ = false, is_shifted_ = false;  // the right end
  Trial trial_;
  DetectedEvent event_;  // that the trial passes
  double shortest_load_ = 0;
  std::vector<int> from_rest_;  // contacts in space whose slip begins with the element
  int slow_ = -1;               // contact in space whose slip has slowed down at the end of the last element
  int n_passes_ = 0;            // such elements in turn
  bool passes_ = false;         // the element ends where slip has slowed down, without a switch
  bool stops_ = false;          // slip of these contacts stops in this element, with the directions of friction held:
  std::vector<int> stopping_;
  Vector held_;               // n_lambda_t
  bool is_straight_ = false;  // they stop by the first bound of (6)
  std::vector<ContactMode> modes_;
  Vector law_;
};

}  // namespace ricochet
