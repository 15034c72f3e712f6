#pragma once

#include "methods/elements/element_motion.h"
#include "methods/elements/element_solver.h"
#include "methods/time_freezing/pseudo_time_solver.h"
#include "methods/time_freezing/region_forces.h"
#include "methods/time_freezing/region_state.h"

namespace ricochet {

/// An element of constant regions of either kind: of free flight, where pseudo time is time, by methods/elements, else by
/// PseudoTimeSolver.
class RegionElement {
 public:
  /// All references must outlive this object. @param auxiliary  pushes that persistent contact needs are raised in it
  RegionElement(const Problem& problem, const ButcherTableau& tableau, AuxiliaryDynamics& auxiliary,
                double inner_tolerance, Counters& counters);

  /// The regions of the next elements.
  void set_regions(const RegionState& from);
  /// First guess of an element that is no flight, from the forces at its left end. @param length  as of solve()
  void guess(const RegionState& from, const RegionForces& forces, double length);
  void forget_flight() { flight_.forget_guess(); }
  /// Computes one element that starts at this state. @param length  of time, or of pseudo time while time is frozen [s]
  /// @return false if Newton's method fails
  bool solve(const RegionState& from, double length);
  /// An element of length zero.
  void stay(const RegionState& from);

  // The element that was solved last.
  const Vector& q1() const { return q1_; }
  const Vector& v1() const { return v1_; }
  const Vector& y1() const { return y1_; }
  const Vector& Lambda_n() const { return slide_.Lambda_n; }  ///< n_c, of a frozen element [N s]
  const Vector& Lambda_t() const { return slide_.Lambda_t; }
  const Element& flight() const { return flight_; }  ///< its stages, where it is free
  /// Whether the push is so small compared with the force of a contact that time hardly runs.
  bool is_short_of_push() const;
  /// Adds the motion from `from` until t_end [s] to the motion of the run.
  void add_motion(const RegionState& from, double t_end, Motion& motion) const;

 private:
  double speed_of_time(const RegionState& from, const RegionForces& forces) const;

  const ProblemInfo& info_;
  AuxiliaryDynamics& auxiliary_;
  ElementSystem elements_;
  ElementSolver flight_solver_;
  const ElementMotion flight_motion_;
  Element flight_;
  PseudoTimeSolver slide_solver_;
  PseudoTimeElement slide_;
  Vector q1_, v1_, y1_;
};

}  // namespace ricochet
