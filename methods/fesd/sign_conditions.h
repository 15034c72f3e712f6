#pragma once

#include <cstdint>
#include <span>

#include "methods/contact_laws/contact_scales.h"
#include "methods/contact_laws/friction_polygon.h"
#include "methods/elements/element.h"
#include "methods/elements/switch.h"
#include "methods/fesd/inequality.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// A sign condition that an element breaks: it goes past a switch, or a closed contact drifts.
struct Violation {
  enum class Kind : std::uint8_t {
    none,
    past_switch,
    drift,    ///< a closed contact has a gap or creeps at a right end that is no stage
    inexact,  ///< the polynomial of an explicit element does not tell whether a contact closes
  };
  Kind kind = Kind::none;
  SwitchKind passed = SwitchKind::gap_closes;  ///< of Kind::past_switch
  int contact = -1;
  double time = 0;           ///< where the quantity crosses zero, interpolated [s]
  double value = 0;          ///< gap [m], force [N], slip velocity [m/s]
  int facet_condition = -1;  ///< on a polygon: number of the FacetCondition
  double level = 0;          ///< of a gap: how far below zero it closes (sunk_closing.h) [m]

  explicit operator bool() const { return kind != Kind::none; }
  bool is_past(SwitchKind its_kind) const { return kind == Kind::past_switch && passed == its_kind; }
};

/// The inequalities of one element (inequality.h), at its stages and its right end:
///
///   f_c^i >= 0                       open
///   lambda_n^i >= 0                  closed
///   ||lambda_t^i|| <= mu lambda_n^i  stick
///   +-v_t^i >= 0                     slip+, slip-
///   v_t,j^i' v_t,j-1^i > 0           slip in space: the direction turns, but does not turn back
///
/// With a polygon in place of the friction disc the last three are replaced by conditions (2) of friction_polygon.h.
/// A bilateral constraint has none of them; only its drift at a right end that is no stage is refused.
class SignConditions {
 public:
  /// @param scales  sizes for rounding errors; read at every call; forces are recorded there
  /// @param gap_tolerance  [m] by which the gap of a contact that has just broken may be negative
  SignConditions(const Problem& problem, const ButcherTableau& tableau, const FrictionPolygon& polygon,
                 ContactScales& scales, double gap_tolerance);

  /// The condition that fails first in time; Violation::time from the left end of the element.
  /// @param just_broken  contact that broke at the left end, or -1
  /// @param unloaded  contacts that the load of the next moment opens: gap, velocity and acceleration start at zero, so
  /// the error of the first stages is a fraction of the gap there, however short the element. It may be negative by
  /// ContactScales::of_positions().
  /// @param sinks  ElementStart::sinks: ElementGaps checks their gaps
  Violation check(const Element& stages, int just_broken, std::span<const int> unloaded = {},
                  std::span<const char> sinks = {});

 private:
  bool is_end_stage(int j) const { return j == n_s_ - 1 && n_points_ == n_s_; }
  bool is_clear(const Element& stages);
  double gap_rounding(const Element& stages, int contact);
  void check_gaps(const Element& stages, int just_broken, std::span<const int> unloaded, std::span<const char> sinks,
                  Violation& first);
  void check_forces(const Element& stages, Violation& first);
  double left_impulse(const Element& stages);
  double slip_rounding(const Element& stages, int contact) const;
  void check_slip(const Element& stages, Violation& first);
  void check_facet_forces(const Element& stages, int contact, Violation& first);
  /// From one point of an element to the next: -1 is the left end, n_s a right end that is no stage.
  struct SlipChange {
    int point;
    double time_before, time;
    const double *slip_before, *slip;
    double rounding;
  };
  void check_facet_velocity(const Element& stages, int contact, const SlipChange& change, Violation& first);
  std::span<const Inequality> inequalities(const Element& stages, int contact) const {
    return inequalities_of(stages.modes[contact], polygon_.applies(problem_.info().contacts[contact].n_t));
  }

  const Problem& problem_;
  const ButcherTableau& tableau_;
  const FrictionPolygon polygon_;
  ContactScales& scales_;
  const double gap_tolerance_;
  const int n_s_, n_points_;    // points: the stages, and the right end when it is none of them
  Vector tangential_delassus_;  // J_t' M^-1 J_t at q0: slip velocity per friction impulse
  Vector gap_, left_gap_, allowed_gap_;
  double absorption_ = 1;  // max_j |(A^-1 1)_j|
  Vector J_n_;             // packed
  Matrix J_t_;             // packed; of the left end, then of every point
};

}  // namespace ricochet
