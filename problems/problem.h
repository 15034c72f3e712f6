#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "problems/impact_hypothesis.h"
#include "problems/interval.h"

/// @file
/// Problem, the equations of a scene, and ProblemInfo, its sizes, names and properties.

namespace ricochet {

using Vector = Eigen::VectorXd;  ///< A column of doubles.
using Matrix = Eigen::MatrixXd;  ///< Doubles, column-major.

struct Geometry;  // problems/geometry.h
struct SymbolicModel;
class SymbolicProblem;  // both problems/derivatives/symbolic_problem.h

/// Newton's coefficient of restitution as a formula of the approach speed v_n = -J_n' v- > 0 [m/s].
class RestitutionOfSpeed {
 public:
  virtual ~RestitutionOfSpeed() = default;
  /// e at the approach speed `v_n`. @throws InputError with the contact, v_n and e if e is not in [0, 1]
  virtual double value(double v_n) const = 0;
  virtual double slope(double v_n) const = 0;  ///< de/dv_n [s/m]
  /// d: derivatives of e with respect to ProblemInfo::parameters.
  virtual void parameter_derivative(double v_n, double* d) const = 0;
};

/// One unilateral contact, or a bilateral constraint: a contact that is always closed and may pull. Its Jacobian
/// entries live on `support` only, the coordinates that the contact touches.
struct ContactInfo {
  std::string name;                  ///< in messages, events and figures
  bool is_friction_element = false;  ///< friction without a normal contact, Problem (8); eps_r = 0 and mu = 1
  std::optional<double> bound = {};  ///< F of a friction element, if it is a number
  bool is_bilateral = false;         ///< f_c = 0 at all times, lambda_n of either sign; no friction, no restitution
  double eps_r = 0;                  ///< restitution coefficient, in [0, 1]; kVaries if it depends on the speed
  double mu = 0;                     ///< friction coefficient, >= 0; zero exactly when n_t is zero
  bool mu_varies = false;            ///< mu is a formula of q or t, Problem (9)
  double mu_static = 0;              ///< friction coefficient while it sticks, > mu, Problem (10); 0: it is mu
  std::shared_ptr<const RestitutionOfSpeed> eps_r_of_speed = {};  ///< null if eps_r holds at every speed
  int n_t = 0;               ///< tangent directions: 0 frictionless, 1 planar, 2 in space
  std::vector<int> support;  ///< coordinates q_k that occur in the gap or the tangents, ascending
  bool is_moving = false;    ///< it depends on time: the last entry of `support` is the clock
  bool is_affine = false;    ///< J_n and J_t do not depend on q
  bool has_corners = false;  ///< J_n may jump along a motion, as of a gap with max(); not where it is stated in code
  int normal_begin = 0;      ///< first entry of this contact in a packed J_n
  int tangent_begin = 0;     ///< first entry of this contact in a packed J_t, direction after direction
  int tangent_index = 0;     ///< first component of this contact in lambda_t and v_t

  /// In place of eps_r if eps_r depends on the approach speed: neither plastic nor elastic.
  static constexpr double kVaries = 0.5;
  /// eps_r at an impact with the normal velocity `rate` = J_n' v- before it [m/s]. A coefficient that depends on the
  /// speed is zero where `rate` >= 0, without an impact. @throws InputError as RestitutionOfSpeed::value()
  double restitution(double rate) const {
    if (!eps_r_of_speed) return eps_r;
    return rate < 0 ? eps_r_of_speed->value(-rate) : 0;
  }
  /// d(eps_r rate) / d(rate).
  double restitution_slope(double rate) const {
    if (!eps_r_of_speed) return eps_r;
    return rate < 0 ? eps_r_of_speed->value(-rate) - rate * eps_r_of_speed->slope(-rate) : 0;
  }
  /// Whether the slowest impacts lose no energy, so that infinitely many of them take infinitely long.
  bool is_elastic() const { return restitution(-std::numeric_limits<double>::min()) >= 1; }

  /// The entries of `support` that contact forces push: all but the clock.
  std::span<const int> pushed() const { return std::span(support).first(support.size() - (is_moving ? 1 : 0)); }
};

/// A parameter of a scene.
struct ParameterInfo {
  std::string name;  ///< as in `--set NAME=VALUE`
  double value = 0;  ///< in SI units
  std::string unit;  ///< "kg", for reports
};

/// A switching function psi(q, v): where it vanishes, a formula of the scene changes its branch
/// (problems/regions/switching_functions.h).
struct SwitchInfo {
  std::string formula;      ///< psi as text
  bool is_of_time = false;  ///< psi depends on t only, so that its zeros are known before a run
};

/// Properties of a scene that a method may use before it runs. Everything in `structure` and after it is derived from
/// the equations, never declared by hand.
struct ProblemInfo {
  std::string id;                         ///< lower_snake, "bouncing_ball"
  std::string title;                      ///< short description
  std::string source;                     ///< publication, or where the equations come from
  std::string hard_feature;               ///< what the scene tests
  std::vector<ParameterInfo> parameters;  ///< with the values of this problem

  int n_q = 0;     ///< coordinates
  int n_u = 0;     ///< controls
  int clock = -1;  ///< the coordinate that is time, the last one, see Problem (7); -1 if nothing depends on time
  int n_friction_elements = 0;        ///< levers among them; coordinates before the clock, see Problem (8)
  std::vector<ContactInfo> contacts;  ///< n_c, unilateral and bilateral ones
  std::vector<int> unilateral;        ///< contacts that are, ascending
  std::vector<int> bilateral;         ///< constraints, ascending

  std::vector<SwitchInfo> switches;  ///< n_s, of formulas with abs, sign, min, max or if; empty in a region
  std::vector<int> region;  ///< of a problem that is one region of another: n_s signs, 1 where it slides; else empty
  int until = -1;           ///< of `switches`: a run ends where it vanishes first after the start; -1: none

  ImpactLaw impact_law;                      ///< methods support it or decline the scene
  std::shared_ptr<const Geometry> geometry;  ///< the bodies and their shapes; null if the scene states none

  Vector q0;            ///< n_q, initial coordinates
  Vector v0;            ///< n_q, initial velocities, before any impact at t = 0
  Vector u;             ///< n_u, control of the plain simulation, constant in time
  double end_time = 0;  ///< [s]

  /// Properties that let a method skip work, or do it once.
  struct Structure {
    bool constant_mass = false;            ///< M does not depend on q
    bool diagonal_mass = false;            ///< M has no off-diagonal entries
    bool force_uses_position = false;      ///< f_v + B_u u depends on q
    bool force_uses_velocity = false;      ///< f_v + B_u u depends on v
    bool constant_force_jacobian = false;  ///< f_v + B_u u is affine in (q, v)
    bool has_potential = false;            ///< potential_energy() is defined
    bool has_formulas = false;             ///< a SymbolicProblem, which computes with its formulas
    bool has_bounds = false;               ///< the functions named *_bounds are defined, see Problem
    bool force_jumps = false;              ///< f_v + B_u u contains `if` or `sign`, which may jump
    /// Pairs k < l of coordinates that are coupled by an entry (k, l) of M or of a derivative of M a, f_v or B_u u. The
    /// clock is excluded. Contacts couple the coordinates that they push in addition.
    std::vector<std::pair<int, int>> couplings;
  } structure;  ///< properties of this scene

  int n_c() const { return static_cast<int>(contacts.size()); }  ///< Contacts, constraints among them.
  /// Coordinates of bodies, as the scene states them: all but those of friction elements and the clock.
  int n_mechanical() const { return (clock < 0 ? n_q : clock) - n_friction_elements; }
  int n_bilateral() const { return static_cast<int>(bilateral.size()); }  ///< Bilateral constraints.
  /// Time at which a run begins [s]: 0, but for a part of a motion whose clock has run before.
  double start_time() const { return clock < 0 ? 0 : q0[clock]; }
  bool has_friction() const { return n_lambda_t > 0; }       ///< Some contact has friction.
  bool has_static_friction() const;                          ///< Some contact has a mu_static, Problem (10).
  bool has_bilateral() const { return !bilateral.empty(); }  ///< Some contact is a constraint.

  int n_normal_entries = 0;   ///< length of a packed J_n
  int n_tangent_entries = 0;  ///< length of a packed J_t
  int n_lambda_t = 0;         ///< sum of n_t over the contacts
};

/// Complementarity Lagrangian system, equation (1) of [1], in SI units, angles in radians:
///
///     q' = v                                                                             (1)
///     M(q) v' = f_v(q,v) + B_u(q) u + sum_i (J_n^i lambda_n^i + J_t^i lambda_t^i)        (2)
///     0 <= lambda_n^i  _|_  f_c^i(q) >= 0,   J_n^i = grad f_c^i                          (3)
///     J_n^i' v+ = -eps_r^i J_n^i' v-   at an impact of contact i                         (4)
///     ||lambda_t^i|| <= mu^i lambda_n^i, opposite to the slip velocity v_t^i = J_t^i' v  (5)
///     f_c^i(q) = 0, lambda_n^i of either sign, instead of (3)-(5) where i is bilateral   (6)
///
/// [1] is A. Nurkanović, J. Frey, A. Pozharskiy, M. Diehl, *FESD-J: Finite Elements with Switch Detection for Numerical
/// Optimal Control of Rigid Bodies with Impacts and Coulomb Friction*.
///
/// A pure description: no solver, no time step. Where forces, gaps or tangents depend on time, it is one more
/// coordinate, the last:
///
///     q_clock = t,   v_clock = 1,   M entry 1, no force, no initial value but 0          (7)
///
/// Then J_n' v contains df_c/dt, J_t' v contains the drive of a moving surface (the clock's entry of J_t),
/// v' (grad^2 f_c) v contains f_tt + 2 f_tq v, and f_q contains df_v/dt: rates, slopes and derivatives are summed over
/// the whole support. The clock's entries of J_n and J_t are used in rates only. No contact force acts on the clock:
/// (2), impulses and Delassus operators are summed over ContactInfo::pushed(). A scene that does not depend on time has
/// no clock.
///
/// Friction without a normal contact, of a bound F(q, v, t), has one more coordinate z, between those of the bodies and
/// the clock, and one more contact, after those of the scene (derivatives/friction_elements.h):
///
///     z'' = -F(q,v) + lambda_n,   f_c = z,   mu = 1,   eps_r = 0,   z = z' = 0 at t = 0                      (8)
///
/// so that lambda_n = F. It is a contact like others to whoever solves (1)-(7).
///
/// Rolling and drilling friction, of a bound c(q, t) lambda_n with the force of a contact, has the coordinate of a lever
/// in place of z, and one more contact, which is no friction element (derivatives/rolling_friction.h).
///
/// A friction coefficient that is a formula mu(q, t) > 0 multiplies the tangents, and the coefficient in (5) is 1:
///
///     J_t <- mu(q,t) J_t,   mu <- 1,   so that lambda_t is the friction force over mu(q,t), and v_t mu(q,t) times the
///     slip velocity                                                                                          (9)
///
/// The products J_t lambda_t and v_t' lambda_t stay the same, and so does (5), forces and impulses alike
/// (derivatives/varying_friction.h). A coefficient of restitution may be a formula of the approach speed -J_n' v- in
/// (4): ContactInfo::restitution().
///
/// A contact may have a larger coefficient while it sticks (regions/static_friction.h):
///
///     ||lambda_t^i|| <= mu_static^i lambda_n^i instead of (5) where i sticks, mu_static^i > mu^i            (10)
///
/// Arrays are plain pointers because these functions are called once per stage of every time step: no temporary, no
/// allocation. q, v, a (accelerations) and w (weights) have n_q entries, unless stated otherwise for w. u has n_u
/// entries and may be null if n_u is 0; lambda_n has n_c [N]; lambda_t has n_lambda_t [N] and may be null if that is 0.
/// Results come last. Nothing is validated. Matrices are column-major. J_n and J_t are packed: the normal of contact i
/// occupies contacts[i].support.size() entries from contacts[i].normal_begin, in the order of its support; its tangents
/// follow the same rule from tangent_begin, one direction after the other. A scene without friction has no tangential
/// entry at all. Every function is const and may be called from several threads.
class Problem {
 public:
  virtual ~Problem() = default;

  const ProblemInfo& info() const { return info_; }  ///< Sizes, names, initial state, structure.
  int n_q() const { return info_.n_q; }              ///< Coordinates, the clock among them.
  int n_c() const { return info_.n_c(); }            ///< Contacts, constraints among them.
  /// Replaces the initial state by `q0`, `v0`, with the clock. Not validated. Do not call while a method runs.
  void set_initial_state(const Vector& q0, const Vector& v0) {
    if (stated_q0_.size() == 0) {
      stated_q0_ = info_.q0;
      stated_v0_ = info_.v0;
    }
    info_.q0 = q0;
    info_.v0 = v0;
  }
  const Vector& stated_q0() const { return stated_q0_.size() ? stated_q0_ : info_.q0; }  ///< Before it was replaced.
  const Vector& stated_v0() const { return stated_v0_.size() ? stated_v0_ : info_.v0; }  ///< Before it was replaced.

  /// Replaces the `end_time` [s]. Not validated. Do not call while a method runs.
  void set_end_time(double end_time) { info_.end_time = end_time; }
  /// Replaces the impact law. Not validated. Do not call while a method runs.
  void set_impact_law(ImpactLaw law) { info_.impact_law = std::move(law); }

  // Values.
  virtual void mass_matrix(const double* q, double* M) const = 0;  ///< M: n_q x n_q, symmetric positive definite
  /// f: n_q, f_v(q,v) + B_u(q) u. u: n_u, may be null when n_u = 0.
  virtual void force(const double* q, const double* v, const double* u, double* f) const = 0;
  virtual void gap(const double* q, double* f_c) const = 0;               ///< f_c: n_c [m], > 0 when open
  virtual void normal_jacobian(const double* q, double* J_n) const = 0;   ///< packed, n_normal_entries
  virtual void tangent_jacobian(const double* q, double* J_t) const = 0;  ///< packed, n_tangent_entries; (9)
  /// mu: n_c, friction coefficients at q: those of (9) where they vary, else ContactInfo::mu. lambda_t of a contact
  /// times the former is its friction force. Where one that varies is not positive, its entries of J_t are NaN.
  virtual void friction_coefficients([[maybe_unused]] const double* q, double* mu) const {
    for (const ContactInfo& contact : info_.contacts) *mu++ = contact.mu;
  }
  /// f_c of these `contacts`; the other entries may be written or not.
  virtual void gap_of([[maybe_unused]] std::span<const int> contacts, const double* q, double* f_c) const {
    gap(q, f_c);
  }
  /// b of gap_acceleration_bias() of these `contacts`, likewise.
  virtual void gap_acceleration_bias_of([[maybe_unused]] std::span<const int> contacts, const double* q,
                                        const double* v, double* b) const {
    gap_acceleration_bias(q, v, b);
  }
  /// J_n of these `contacts`, likewise.
  virtual void normal_jacobian_of([[maybe_unused]] std::span<const int> contacts, const double* q, double* J_n) const {
    normal_jacobian(q, J_n);
  }
  /// J_t of these `contacts`, likewise.
  virtual void tangent_jacobian_of([[maybe_unused]] std::span<const int> contacts, const double* q, double* J_t) const {
    tangent_jacobian(q, J_t);
  }
  virtual double potential_energy(const double* q) const = 0;  ///< [J]; 0 unless structure.has_potential

  // Bounds over boxes, for proofs that nothing happens within a step. Each result contains the value of the function of
  // the same name for all arguments in the boxes q and v. Sizes are those of that function; time is a coordinate like
  // the others. Defined if structure.has_bounds; they cost about ten times as much as the values. Entries of other
  // contacts than the stated ones are undefined.
  /// M: bounds of mass_matrix() over q.
  virtual void mass_bounds([[maybe_unused]] const Interval* q, [[maybe_unused]] Interval* M) const {}
  /// f: bounds of force() over q and v, at u.
  virtual void force_bounds([[maybe_unused]] const Interval* q, [[maybe_unused]] const Interval* v,
                            [[maybe_unused]] const double* u, [[maybe_unused]] Interval* f) const {}
  /// f_c: bounds of gap() over q, of these `contacts`.
  virtual void gap_bounds([[maybe_unused]] std::span<const int> contacts, [[maybe_unused]] const Interval* q,
                          [[maybe_unused]] Interval* f_c) const {}
  /// J_n: bounds of normal_jacobian() over q, of these `contacts`.
  virtual void normal_bounds([[maybe_unused]] std::span<const int> contacts, [[maybe_unused]] const Interval* q,
                             [[maybe_unused]] Interval* J_n) const {}
  /// J_t: bounds of tangent_jacobian() over q, of these `contacts`.
  virtual void tangent_bounds([[maybe_unused]] std::span<const int> contacts, [[maybe_unused]] const Interval* q,
                              [[maybe_unused]] Interval* J_t) const {}
  /// b: bounds of gap_acceleration_bias() over q and v, of these `contacts`.
  virtual void gap_bias_bounds([[maybe_unused]] std::span<const int> contacts, [[maybe_unused]] const Interval* q,
                               [[maybe_unused]] const Interval* v, [[maybe_unused]] Interval* b) const {}
  /// T: bounds of slip_velocity_derivative() over q and v, of these `contacts`.
  virtual void slip_derivative_bounds([[maybe_unused]] std::span<const int> contacts,
                                      [[maybe_unused]] const Interval* q, [[maybe_unused]] const Interval* v,
                                      [[maybe_unused]] Interval* T) const {}

  /// psi: bounds of switching() over q and v.
  virtual void switching_bounds([[maybe_unused]] const Interval* q, [[maybe_unused]] const Interval* v,
                                [[maybe_unused]] Interval* psi) const {}

  // First derivatives of the dynamics.
  /// f_q, f_v: n_q x n_q, derivatives of force() with respect to q and v.
  virtual void force_jacobians(const double* q, const double* v, const double* u, double* f_q, double* f_v) const = 0;
  /// Ma_q: n_q x n_q, derivative of M(q) a with respect to q at fixed a.
  virtual void mass_derivative(const double* q, const double* a, double* Ma_q) const = 0;
  /// Jl_q: n_q x n_q, derivative of J_n(q) lambda_n + J_t(q) lambda_t with respect to q at fixed forces.
  /// lambda_n: n_c; lambda_t: n_lambda_t, may be null when that is 0.
  virtual void contact_force_derivative(const double* q, const double* lambda_n, const double* lambda_t,
                                        double* Jl_q) const = 0;
  /// b: n_c [m/s^2], the part v' (grad^2 f_c) v of the gap acceleration that does not contain v'.
  virtual void gap_acceleration_bias(const double* q, const double* v, double* b) const = 0;
  /// T: n_lambda_t x n_q, derivative of the slip velocities J_t(q)' v with respect to q at fixed v. T v is the part of
  /// the slip acceleration that does not contain v'.
  virtual void slip_velocity_derivative(const double* q, const double* v, double* T) const = 0;

  // Second derivatives.
  /// H: 2 n_q x 2 n_q, Hessian with respect to (q, v) of w' (M(q) a - f_v(q,v) - B_u(q) u - J_n lambda_n - J_t
  /// lambda_t). a, w: n_q. For exact Hessians of a transcription.
  virtual void dynamics_hessian(const double* q, const double* v, const double* u, const double* a,
                                const double* lambda_n, const double* lambda_t, const double* w, double* H) const = 0;
  /// H: n_q x n_q, Hessian of sum_i w_i f_c^i(q). w: n_c.
  virtual void gap_hessian(const double* q, const double* w, double* H) const = 0;

  // Derivatives with respect to info().parameters, for sensitivities.
  /// D: (n_q + 2 n_c + n_lambda_t) x parameters. Its blocks, from top to bottom, are the derivatives of M(q) a -
  /// f_v(q,v) - B_u(q) u - J_n lambda_n - J_t lambda_t, of f_c(q), of J_n(q)' v and of J_t(q)' v, at fixed arguments.
  /// The control is info().u and varies with its parameters. mu = 0 means no tangents, so that mu changes nothing.
  virtual void parameter_derivative(const double* q, const double* v, const double* a, const double* lambda_n,
                                    const double* lambda_t, double* D) const = 0;
  /// C: (2 n_q + 2 n_c + 1) x parameters: derivatives of q0, v0, all eps_r, all mu, end_time, in this order. Those of an
  /// eps_r that depends on the speed are zero here, see RestitutionOfSpeed.
  virtual void parameter_derivative_of_constants(double* C) const = 0;

  // Regions, for formulas that bend or jump.
  /// psi: n_s, the switching functions at (q, v). In a region, those of its formulas.
  virtual void switching([[maybe_unused]] const double* q, [[maybe_unused]] const double* v,
                         [[maybe_unused]] double* psi) const {}
  /// D: n_s x (2 n_q + parameters), their derivatives with respect to q, v, and info().parameters.
  virtual void switching_derivative([[maybe_unused]] const double* q, [[maybe_unused]] const double* v,
                                    [[maybe_unused]] double* D) const {}
  /// The problem of one region: every formula is smooth, and is that of the `signs` (n_s, each 1 or -1) everywhere; with
  /// 0, that of a motion that slides on psi_k = 0 (regions/sliding.h, which throws InputError where there is none).
  /// Takes milliseconds, and formulas_mutex() to make and to destroy it. Null if the problem has no switching
  /// functions.
  virtual std::unique_ptr<Problem> in_region([[maybe_unused]] std::span<const int> signs) const { return nullptr; }
  /// The problem whose runs end at the end time only. Takes milliseconds, and formulas_mutex(). Null if it has no
  /// formulas.
  virtual std::unique_ptr<Problem> without_until() const { return nullptr; }
  /// The problem without (10), in which contacts whose entry of `sticks` (n_c) is not zero have mu = mu_static, and the
  /// others their mu. Takes milliseconds, and formulas_mutex() to make and to destroy it. Null if it has no formulas.
  virtual std::unique_ptr<Problem> in_friction_state([[maybe_unused]] std::span<const char> sticks) const {
    return nullptr;
  }

  /// The problem of these `coordinates` alone, with these `contacts`, whose supports are among them. Both ascend. The
  /// geometry is that of the whole. Null where constraints or forces may couple coordinates, or where the scene has
  /// formulas only.
  virtual std::unique_ptr<Problem> part([[maybe_unused]] std::span<const int> coordinates,
                                        [[maybe_unused]] std::span<const int> contacts) const {
    return nullptr;
  }

  /// The scene as formulas, which can be varied, written and proven; null where it has none.
  virtual const SymbolicModel* formulas() const { return nullptr; }
  /// The problem itself if it computes with its formulas, so that it can be transcribed; else null.
  virtual const SymbolicProblem* symbolic() const { return nullptr; }
  virtual SymbolicProblem* symbolic() { return nullptr; }  ///< The same, to change its parameters.

  // Dense views for code outside the time step.
  Matrix mass_matrix(const Vector& q) const;                         ///< n_q x n_q
  Vector force(const Vector& q, const Vector& v) const;              ///< n_q, at the control info().u
  Vector free_acceleration(const Vector& q, const Vector& v) const;  ///< n_q, M^-1 f: without contact forces
  Vector gap(const Vector& q) const;                                 ///< n_c [m]
  Matrix normal_jacobian(const Vector& q) const;                     ///< n_q x n_c
  Matrix tangent_jacobian(const Vector& q) const;                    ///< n_q x n_lambda_t
  Vector friction_coefficients(const Vector& q) const;               ///< n_c
  /// Friction forces or impulses of the contacts, n_lambda_t: `lambda_t` at q without (9).
  Vector friction_forces(const Vector& q, Vector lambda_t) const;
  /// Columns of J, which is J_n or J_t, as the directions of their forces: zero at the clock.
  Matrix force_directions(Matrix J) const;
  Vector gap_acceleration_bias(const Vector& q, const Vector& v) const;  ///< n_c [m/s^2]
  /// n_s, sizes of the terms of psi_k in x = (q, v): sum_j |d psi_k / dx_j| (1 + |x_j|), to tell a rounded zero.
  Vector switching_sizes(const Vector& q, const Vector& v) const;
  Vector slip_acceleration_bias(const Vector& q, const Vector& v) const;  ///< n_lambda_t, T v
  double kinetic_energy(const Vector& q, const Vector& v) const;          ///< [J], of the bodies
  /// Kinetic plus potential energy [J]; empty when the scene states no potential.
  std::optional<double> energy(const Vector& q, const Vector& v) const;

 protected:
  ProblemInfo info_;  ///< filled by the constructor of a subclass
  Vector stated_q0_;  ///< that of the formulas; empty until the initial state is replaced
  Vector stated_v0_;  ///< likewise
};

/// Rejects mistakes of a user in a `problem`: wrong sizes, non-finite numbers, eps_r outside [0, 1], mu < 0, end_time
/// <= 0, M(q0) that is not positive definite, initial penetration, an initial state that violates a bilateral
/// constraint, and dependent bilateral constraints. @throws InputError with the field, its value and what is allowed
void validate(const Problem& problem);

}  // namespace ricochet
