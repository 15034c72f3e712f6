#pragma once

#include <span>
#include <string>
#include <vector>

#include "methods/contact_laws/contact_scales.h"
#include "methods/contact_laws/friction_problem.h"
#include "methods/contact_laws/switch_kind.h"
#include "methods/time_freezing/regions.h"
#include "problems/solution.h"

namespace ricochet {

/// The switch that ends an element before its time. Its function is
///
///   gap_closes      f_c of a free contact; while time is frozen J_n' v of a free contact that touches
///   force_vanishes  lambda_n of a sliding contact, -J_n' v of a pushed one, -y of a bouncing one
///   cone_reached    mu lambda_n - |lambda_t| of a sticking contact
///   slip_stops      d' J_t' v of a slipping contact
struct RegionSwitch {
  SwitchKind kind = SwitchKind::gap_closes;
  int contact = -1;              ///< -1: none
  Region region = Region::free;  ///< of the contact until then
  bool slows = false;            ///< slip in space has not stopped, but become a small part of what it was

  explicit operator bool() const { return contact >= 0; }
  bool is(SwitchKind its_kind, int its_contact) const { return contact == its_contact && kind == its_kind; }
  /// Whether the force of a contact in this region ends.
  bool ends(Region its_region) const {
    return contact >= 0 && kind == SwitchKind::force_vanishes && region == its_region;
  }
  bool ends(Region its_region, int its_contact) const { return contact == its_contact && ends(its_region); }
};

/// Which regions are active behind a switch, by pivoting, and the derivatives there. At a state (q, v), for the contacts
/// that touch, with w = v' for the time or for the pseudo time:
///
///   time runs    M w = f_v + B_u u + sum_i (J_n^i lambda_n^i + J_t^i lambda_t^i)                           (1)
///                0 <= lambda_n  _|_  J_n' w + v' (grad^2 f_c) v >= 0,   Coulomb's law with (J_t' v)'       (2)
///   frozen       M w = sum_i (J_n^i r_n^i + J_t^i r_t^i)                                                   (3)
///                pushed, bouncing: r_n = push;   J_n' v = 0: 0 <= r_n  _|_  J_n' w >= 0;   Coulomb's law   (4)
///
/// (2) is the choice of a convex combination of f_ODE and of the auxiliary dynamics that keeps J_n' v = 0, divided by the
/// weight of f_ODE, and leaves the surface where that has a negative weight. (4) is the same among auxiliary dynamics; a
/// contact that would need more than its push, beta > 1, is pushed. Of a contact that bounces alone (4) says which way its
/// friction acts; its force is that of (6) of pseudo_time_equations.h.
class InstantLaw {
 public:
  InstantLaw(const Problem& problem, const AuxiliaryDynamics& auxiliary, const ContactScales& scales,
             Counters& counters);

  /// Evaluates the scene at (q, v) for unilateral `contacts`. False where M is not positive definite.
  bool prepare(const Vector& q, const Vector& v, std::span<const int> contacts);
  const std::vector<int>& contacts() const { return contacts_; }

  double normal_velocity(int contact, const Vector& v) const;
  void slip_velocity(int contact, const Vector& v, double* v_t) const;
  double normal_terms(int contact, const Vector& x) const;   ///< |J_n|' |x|
  double tangent_terms(int contact, const Vector& x) const;  ///< the largest |J_t|' |x|
  double normal_delassus(int contact) const;
  double tangential_delassus(int contact) const;
  const double* normal(int contact) const;
  const Vector& load() const { return load_; }  ///< M^-1 f_v
  /// Where a slip in space stops, others that are no faster stop with it: contacts of one body come to rest together.
  void set_resting_speed(double speed) { resting_speed_ = speed; }
  double load_rate(int contact) const;  ///< acceleration of the gap by the load alone

  /// (1), (2): sets the regions of the contacts of prepare() from those before. @param v  the velocity there
  LcpStatus select_sliding(const Vector& v, RegionSwitch cause, Regions& regions);
  /// (3), (4). Pushed and bouncing contacts are set in `regions`. The damper of a bounce pulls at its end: what rests then
  /// needs no force. @param y  n_c, of bouncing ones
  LcpStatus select_frozen(const Vector& v, const Vector& y, RegionSwitch cause, Regions& regions);

  /// w and the forces for given regions: by (1) with J_n' w + ... = 0 of sliding contacts, or by (3) with (6) of
  /// pseudo_time_equations.h. @param y  n_c, of bouncing ones
  bool forces(const Regions& regions, const Vector& v, const Vector& y);
  const Vector& acceleration() const { return w_; }
  const Vector& lambda_n() const { return lambda_n_; }  ///< n_c [N]; while time is frozen of the auxiliary dynamics
  const Vector& lambda_t() const { return lambda_t_; }  ///< n_lambda_t [N]

  /// Removes what is left of the velocities of sliding contacts and those that stick. @param v  in and out
  void project(const Regions& regions, Vector& v) const;

 private:
  bool separates(int contact, const Vector& v) const;
  int column(int contact) const { return first_column_[contact]; }
  int n_t(int contact) const { return info_.contacts[contact].n_t; }
  void set_law(int contact, const Vector& v, RegionSwitch cause, const ContactRegion& before,
               FrictionProblem::Contact& law) const;
  void set_region(const FrictionProblem::Contact& law, const double* r, ContactRegion& region) const;
  LcpStatus solve(std::span<const int> chosen, bool is_frozen, const Regions& regions);

  const Problem& problem_;
  const ProblemInfo& info_;
  const AuxiliaryDynamics& auxiliary_;
  const ContactScales& scales_;
  Counters& counters_;
  std::vector<int> contacts_, first_column_;
  Vector q_, v_, f_, gap_bias_, slip_bias_, packed_n_, packed_t_;
  Matrix M_, T_, R_, C_, X_, G_;  // rates, directions of forces, P M^-1 C, R' X
  Vector load_, bias_, w_, lambda_n_, lambda_t_;
  FrictionProblem friction_;
  std::vector<FrictionProblem::Contact> laws_;
  std::vector<int> chosen_;
  double resting_speed_ = 0;  // [m/s]
  Matrix law_G_;
  Vector law_b_, law_r_;
};

}  // namespace ricochet
