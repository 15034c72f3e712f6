#pragma once

#include <span>
#include <vector>

#include "methods/contact_laws/contact_scales.h"
#include "methods/contact_laws/friction_problem.h"
#include "methods/time_freezing/instant_system.h"
#include "methods/time_freezing/region_forces.h"
#include "methods/time_freezing/region_switch.h"
#include "methods/time_freezing/regions.h"

namespace ricochet {

/// The regions that are active after a switch, by pivoting, and the forces in them. At a state (q, v), for the contacts
/// that touch, with w = v' for the time or for the pseudo time:
///
///   time runs    M w = f_v + B_u u + sum_i (J_n^i lambda_n^i + J_t^i lambda_t^i)                           (1)
///                0 <= lambda_n  _|_  J_n' w + v' (grad^2 f_c) v >= 0,   Coulomb's law with (J_t' v)'       (2)
///   frozen       M w = sum_i (J_n^i r_n^i + J_t^i r_t^i)                                                   (3)
///                pushed, bouncing: r_n = push;   J_n' v = 0: 0 <= r_n  _|_  J_n' w >= 0;   Coulomb's law   (4)
///
/// (2) is the choice of a convex combination of f_ODE and of the auxiliary dynamics that keeps J_n' v = 0, divided by the
/// weight of f_ODE, and leaves the surface where that has a negative weight. (4) is the same among auxiliary dynamics; a
/// contact that would need more than its push, beta > 1, is pushed. For a contact that bounces, (4) determines only the
/// direction of its friction; its force is (6) of pseudo_time_equations.h.
class InstantLaw {
 public:
  /// All references must outlive this object. @param system  of the state at hand
  InstantLaw(const InstantSystem& system, const ProblemInfo& info, const AuxiliaryDynamics& auxiliary,
             const ContactScales& scales, Counters& counters);

  /// Speed up to which other slips in space stop together with one that stops: contacts of one body come to rest together.
  void set_resting_speed(double speed) { resting_speed_ = speed; }

  /// (1), (2): sets the regions of the contacts of the system from those before, and the forces.
  /// @param forces  in: those at the end of the element before
  LcpStatus select_sliding(const Vector& v, RegionSwitch cause, Regions& regions, RegionForces& forces);
  /// (3), (4). Pushed and bouncing contacts are set in `regions`. The damper of a bounce pulls at its end; contacts at rest
  /// need no force then. @param y  n_c, of bouncing ones
  LcpStatus select_frozen(const Vector& v, const Vector& y, RegionSwitch cause, Regions& regions, RegionForces& forces);

 private:
  bool separates(int contact, const Vector& v) const;
  void set_law(int contact, const Vector& v, RegionSwitch cause, const ContactRegion& before,
               const RegionForces& forces, FrictionProblem::Contact& law) const;
  static void set_region(const FrictionProblem::Contact& law, const double* r, ContactRegion& region);
  LcpStatus solve(bool is_frozen, const Regions& regions);

  const InstantSystem& system_;
  const ProblemInfo& info_;
  const AuxiliaryDynamics& auxiliary_;
  const ContactScales& scales_;
  Counters& counters_;
  FrictionProblem friction_;
  std::vector<FrictionProblem::Contact> laws_;
  std::vector<int> chosen_;  // contacts of laws_
  Matrix law_G_;
  Vector law_b_, law_r_;
  double resting_speed_ = 0;  // [m/s]
};

}  // namespace ricochet
