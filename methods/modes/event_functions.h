#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "methods/contact_laws/contact_scales.h"
#include "methods/contact_laws/gap_search.h"
#include "methods/contact_laws/load_search.h"
#include "methods/contact_laws/switch_kind.h"
#include "methods/modes/mode_dynamics.h"
#include "methods/modes/step_ends.h"
#include "problems/problem.h"

namespace ricochet {

/// The event that ends a phase of motion, or none: a function of a contact falls through zero.
struct DetectedEvent {
  SwitchKind kind = SwitchKind::gap_closes;
  int contact = -1;  ///< -1: no event
  double theta = 1;  ///< part of the step at which it does
  double slope = 0;  ///< of the function there [1/s]
  double level = 0;  ///< of a gap: how far below zero it has fallen [m]
  /// Time below zero if neither the ends of the step nor its stages show that the function is negative; else 0
  double duration = 0;  ///< [s]

  explicit operator bool() const { return contact >= 0; }
  bool is(SwitchKind its_kind, int its_contact) const { return contact == its_contact && kind == its_kind; }
};

/// The functions of (q, v) that are positive while every contact keeps its mode:
///
///   open      f_c(q)                                                                     (1)
///   closed    lambda_n                                                                   (2)
///   sticks    mu lambda_n - ||lambda_t||                                                 (3)
///   slips     d' J_t' v,  in space d' J_t' v - v_stop                                    (4)
///
/// d is the direction of slip: in the plane that of the mode, in space that at the left end of the step. There the
/// direction has no limit at v_t = 0 that a step could cross, so the last v_stop of slip is left to the run. For slip
/// slower than twice that, v_stop is half of its speed.
///
/// A step that has been taken is searched for the first zero: of functions negative at its right end; of gaps, along the
/// whole of it (GapSearch); and of forces negative at a stage, if their interpolation is negative, too. If a function is
/// zero at the left end, since a contact has just closed or begun to slip, the zero that counts is the next one. A step is
/// too long, and not is_exact(), if its interpolation passes a surface, or zero slip, more closely than its accuracy.
///
/// Slip is searched along the whole of a step, too, and so are (2) and (3) where forces depend on time (LoadSearch),
/// for falls by more than the tolerance: a load may rise and fall within a step that nothing else makes short. Forces
/// that do not depend on time vary only with q and v, which the error control resolves, and the stages are enough. If
/// forces have no bounds, such as those of redundant contacts, all are compared at 16 points.
class EventFunctions {
 public:
  /// @param degree  of the polynomial between the ends of a step
  EventFunctions(const Problem& problem, const ContactScales& scales, ModeDynamics& dynamics, int degree);
  /// Before a run. @param tolerance  of the integration
  void start(double tolerance) {
    tolerance_ = tolerance;
    std::ranges::fill(sinks_, 0);
    gaps_.restart();
  }

  /// After an instant: the functions of the modes of the dynamics, with their values at (q, v). The dynamics has the forces
  /// there.
  void begin(const double* q, const double* v);
  bool has_forces() const { return !dynamics_.closed().empty(); }
  /// A contact whose force contradicts its mode at the left end: it pulls, or sticks outside its cone, by more than a
  /// flight below rounding can cause. -1: none.
  int contradicted() const;

  /// Lets the gap of an open contact fall to -capture_height() before it is a closing, until it is above zero again: an
  /// event at zero would change nothing.
  void let_sink(int contact) { sinks_[contact] = 1; }
  /// The same of all contacts. @param sinks  n_c; empty: none
  void set_sinking(std::span<const char> sinks) {
    std::ranges::fill(sinks_, 0);
    std::ranges::copy(sinks, sinks_.begin());
  }
  /// An open contact whose gap at q is below -4 capture_height(); -1: none. Only those that may sink get there.
  int sunk(const double* q);

  /// Before the stages of a step.
  void begin_step() { lowest_stage_ = 2; }
  /// After each of them: the dynamics has its forces. @param c  of the stage
  void record_stage(double c);

  /// The first zero in the step; the dynamics has the forces of the right end. @param beginning  contacts whose slip begins
  /// with the step: its end is not looked for
  DetectedEvent find(const StepEnds& ends, const std::vector<int>& beginning = {});
  /// Whether another function than that of the event is negative at the right end; the dynamics has the forces there.
  bool another_has_fallen(const DetectedEvent& event, const StepEnds& ends);
  /// Whether the interpolation of the step of the last find() is exact enough to exclude that a gap closes.
  bool is_exact() const { return !inexact_; }
  /// The function that may vanish there.
  const DetectedEvent& inexact() const { return inexact_; }
  /// The contact of the slowest slip at velocity v, at the last positions; -1 where none slips.
  int slowest_slip(const Vector& v) const;
  /// The right end of the step of the last find() becomes the left end. @param v  there
  void advance(const Vector& v);

  /// The function whose zero is the event, at (q, v), with forces evaluated there.
  double value(const DetectedEvent& event, const double* q, const double* v);
  /// The same with the forces that the dynamics has.
  double value_with_forces(const DetectedEvent& event, const double* q, const double* v);

  /// Its derivative by time there, negative. For a gap it is that at (q, v): that of find() is inaccurate at grazing contacts.
  double slope(const DetectedEvent& event, const double* q, const double* v);

  /// J_t' v at (q, v), n_t components.
  void slip_velocity(int contact, const double* q, const double* v, double* v_t);
  /// How a contact in space that has slowed down to v_stop would pass zero with its acceleration held.
  struct Rest {
    double speed = 0;         ///< [m/s]
    double duration = 0;      ///< until it is nearest [s]; negative: in the past
    double distance = 0;      ///< from zero there [m/s]
    double turning_time = 0;  ///< distance over acceleration [s]: error bound of the duration
    double rate = 0;          ///< acceleration [m/s^2]
  };
  Rest rest(int contact, const Vector& q, const Vector& v, const Vector& a);
  /// The contacts in space that slip no faster than their v_stop at first, and this one.
  void find_slow(int contact, const Vector& q, const Vector& v, std::vector<int>& slow);
  /// Continues slip that has slowed down to v_stop; the next v_stop is half of its speed.
  void pass_slip(int contact, const Vector& q, const Vector& v);

 private:
  struct Function {
    SwitchKind kind = SwitchKind::gap_closes;
    int contact = -1;
    double left = 0, right = 0;
    bool from_zero = false;  ///< at the left end it is zero up to rounding
    bool is_near = false;    ///< a gap that the ends of the step do not show to stay open
    bool begins = false;     ///< slip that begins with the step
  };

  void pass(const double* q, const double* v);
  void evaluate(const double* q, const double* v);
  double function(const Function& f, const double* v);
  void tangent_dots(const ContactInfo& contact, const double* v, double* v_t) const;
  double slip_speed(int contact, const double* v) const;
  double first_v_stop(int contact) const;
  double rounding(const Function& f) const;
  void set_positions(const double* q);
  void search(const Function& f, double from, double value_from, double to, double value_to, const StepEnds& ends,
              DetectedEvent& first);
  void find_closing(const Function& f, const StepEnds& ends, DetectedEvent& first);
  void find_sunk(const Function& f, const StepEnds& ends, DetectedEvent& first);
  bool stays_open(const Function& f, const StepEnds& ends) const;
  int closed_halves(const StepEnds& ends);
  void find_closings(const StepEnds& ends, DetectedEvent& first);
  void list_loads(const double* q, const double* v);
  void find_hidden(const StepEnds& ends, DetectedEvent& first);
  void find_sampled(const StepEnds& ends, DetectedEvent& first);
  void tell_opening(const StepEnds& ends, DetectedEvent& first);
  double hidden_slack(const Function& f) const;
  double slip_error(int contact, double h) const;
  double at(const Function& f, double theta, const StepEnds& ends);
  double gap_rate(int contact, const Vector& v) const;

  const Problem& problem_;
  const ProblemInfo& info_;
  const ContactScales& scales_;
  ModeDynamics& dynamics_;
  const int degree_;
  double tolerance_ = 0;
  std::vector<Function> functions_;
  bool slips_ = false, has_gaps_ = false;
  bool curved_tangents_ = false;
  GapSearch gaps_;
  /// How (2)-(4) are searched within a step.
  enum class LoadWatch : std::uint8_t { none, bounds, samples };
  LoadWatch watch_ = LoadWatch::none;
  std::optional<LoadSearch> loads_;         // if slip or time requires it
  std::vector<std::size_t> load_function_;  // of functions_, by function of loads_
  Vector path_error_;
  DetectedEvent inexact_;
  static constexpr double kNowhere = -1;
  double forces_at_ = kNowhere;  // where in the step the dynamics has its forces
  double lowest_stage_ = 2;      // c of the first stage with a negative force, above 1: none
  std::vector<char> sinks_;      // n_c
  std::vector<int> closing_;     // contacts whose gaps have closed at some point of the step
  Vector gap_, packed_n_, packed_t_;
  Vector direction_, v_stop_;  // n_lambda_t, n_c
  Vector q_, v_, a_;
  Matrix T_;  // of curved tangents
};

}  // namespace ricochet
