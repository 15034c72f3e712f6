#pragma once

#include <string>
#include <utility>
#include <vector>

#include "methods/complementarity/mpcc/nlp.h"
#include "methods/contact_laws/friction_cone.h"
#include "problems/derivatives/plant_functions.h"
#include "problems/regions/step_functions.h"

namespace ricochet {

/// Common part of all discretisations of a plant with contacts in an MPCC: points (q, v) with their gaps and slip
/// velocities, forces with their cones, and Coulomb's law between them,
///
///   y = f_c(q),   v_t = J_t' v                                                                            (1)
///
/// In the plane exactly, with xi+ and xi- the parts of v_t,
///
///   v_t = xi+ - xi-,   0 <= xi+  _|_  mu lambda_n + lambda_t >= 0,   0 <= xi-  _|_  mu lambda_n - lambda_t >= 0,
///   xi+  _|_  xi-                                                                                         (2)
///
/// in space
///
///   0 = mu lambda_n v_t + gamma lambda_t,   0 <= gamma  _|_  (mu lambda_n)^2 - ||lambda_t||^2 >= 0        (3)
///
/// Cone::squared, as published: -v_t = 2 gamma lambda_t in place of the first half of (3), in the plane too, and xi+,
/// xi- for every component. Cone::polyhedral, with the directions D of a polygon:
///
///   lambda_t = D l,   0 <= l  _|_  D' v_t + gamma >= 0,   0 <= gamma  _|_  mu lambda_n - sum l >= 0        (4)
///
/// A friction element (Problem (8)) is such a contact without its degenerate parts: its coordinate z and v_z are the
/// constant 0, so that the dynamics state lambda_n = F, and gaps, impulses and laws of impacts are left out.
///
/// Formulas of forces that bend or jump are functions of theta (problems/regions/step_functions.h), with
///
///   psi_k(q, v, theta) = a_k - b_k,   0 <= a_k  _|_  1 - theta_k >= 0,   0 <= b_k  _|_  theta_k >= 0       (5)
///
/// Parts that the scene lacks have no variables: a contact without friction has no tangential ones. Which forces are
/// complementary to which points is up to the discretisation; so it is in (5), with theta at the stages.
class ContactEquations {
 public:
  using Cone = FrictionCone;

  /// Variable numbers of a point of the trajectory.
  struct Point {
    std::vector<int> q, v;
    std::vector<int> gap;                  ///< y, n_c
    std::vector<int> slip;                 ///< v_t, n_lambda_t
    std::vector<int> psi_plus, psi_minus;  ///< a and b of (5), n_s; empty where the point has no stage of its own
  };
  /// Variables of (2)-(4) for a contact with friction at a point; empty where the cone has none.
  struct Slip {
    std::vector<int> xi_plus, xi_minus;  ///< n_t
    std::vector<int> gamma;              ///< 0 or 1
    std::vector<int> rates;              ///< D' v_t + gamma, per facet
  };
  /// The friction force of a contact at a stage, or its impulse.
  struct Force {
    std::vector<int> lambda_t;  ///< n_t
    std::vector<int> slack;     ///< both of (2), or the one of (3), (4)
    std::vector<int> facets;    ///< l
  };
  /// A point with the acceleration w and the forces there.
  struct Stage {
    Point point;
    std::vector<int> w, lambda_n;
    std::vector<Slip> slip;              ///< n_c
    std::vector<Force> force;            ///< n_c
    std::vector<int> theta, theta_rest;  ///< theta and 1 - theta of (5), n_s
  };
  struct StateBounds {
    Vector q_lower, q_upper, v_lower, v_upper;
  };

  /// Guess of forces, impulses and slacks: Ipopt starts inside of their bounds.
  static constexpr double kPositive = 1e-1;

  /// Bounds of q and v at every point but the initial one; none at first.
  void set_bounds(StateBounds bounds) { bounds_ = std::move(bounds); }

  /// (q, v) before an impact at t = 0, as variables that are fixed.
  Point add_initial_state(const Vector& q, const Vector& v);
  /// Another state for the same program. @param is_closed  n_c: contacts that touch, whatever rounding their gap has
  void set_initial_state(const Point& point, const Vector& q, const Vector& v, const std::vector<bool>& is_closed);

  /// The functions of (5); none if the plant has no formulas that bend or jump.
  const StepFunctions& step_functions() const { return step_functions_; }

 protected:
  /// @param mpcc  receives all variables, rows and pairs; must outlive this object, like `plant`
  /// @param eps  see plant_functions()
  /// @throws InputError for bilateral constraints, and as make_step_functions()
  ContactEquations(const Problem& plant, Cone cone, int facets, double eps, Mpcc& mpcc);

  using Terms = std::vector<std::pair<int, double>>;

  bool is_element(int contact) const { return info_.contacts[static_cast<std::size_t>(contact)].is_friction_element; }
  /// The coordinate is the z of a friction element.
  bool is_of_element(int coordinate) const {
    return coordinate >= info_.n_mechanical() && coordinate < info_.n_mechanical() + info_.n_friction_elements;
  }
  /// Makes variables of friction elements the constant 0. @param of_contacts  n_c variables
  void fix_elements(const std::vector<int>& of_contacts);
  /// Leaves the rows of friction elements out, of n_c that begin with `first`.
  void drop_elements(int first);

  int add_variable(double lower, double guess, const std::string& name);
  std::vector<int> add_variables(int count, double lower, double guess, const std::string& name);
  void add_linear(const Terms& terms, double lower, double upper, const std::string& name);
  /// 0 = function(variables) - minus
  void add_equations(const SmoothFunction& function, const std::vector<int>& variables, const std::string& name,
                     const std::vector<int>& minus = {});
  /// 0 = function(variables) - (plus - minus), without minus where its number is -1
  void add_split(const SmoothFunction& function, const std::vector<int>& variables, const std::string& name,
                 const std::vector<int>& plus, const std::vector<int>& minus);
  std::vector<int> add_velocity(const std::string& name);
  Point add_point(const std::string& name);
  void add_gap(Point& point, const std::string& name);
  void add_slip_velocity(Point& point, const std::string& name);
  /// The first of (5). @param theta  of the stage whose formulas hold at the point
  void add_switching(Point& point, const std::vector<int>& theta, const std::string& name);
  std::vector<Slip> add_slips(const Point& point, bool has_force, const std::string& name);
  /// @param is_impulse  friction elements have none: their lambda_t are zero, without slack
  std::vector<Force> add_forces(const std::vector<int>& lambda_n, bool is_impulse, const std::string& name);
  /// A point where the dynamics hold, with the control u. @param has_gap  whether its gaps are variables, >= 0
  Stage add_stage(const std::vector<int>& u, bool has_gap, const std::string& name);
  void add_friction_laws(const Point& point, const std::vector<Slip>& slip, const std::vector<Force>& force,
                         const std::vector<int>& lambda_n, const std::string& name);
  /// The pairs of (2)-(4) between the force and the slip of one contact at one point.
  void add_friction_pairs(const Slip& slip, const Force& force, double bias, const std::string& name);
  static std::vector<int> tangential(const std::vector<Force>& forces);

  // Guesses of what the equations above determine.
  /// The parts of add_split(). Without minus, plus has either sign; both may be -1.
  void guess_split(const Vector& values, const std::vector<int>& plus, const std::vector<int>& minus);
  void guess_point(const Point& point, const Vector& q, const Vector& v, const std::vector<Slip>& slips);
  void guess_forces(const std::vector<Force>& forces, const Vector& lambda_n, const Vector& lambda_t);
  /// a, b of (5) for the sides `theta`, n_s.
  void guess_switching(const Point& point, const Vector& q, const Vector& v, const Vector& theta);
  /// @param w  acceleration; lambda_n, lambda_t: forces; theta: n_s, 0 or 1
  void guess_stage(const Stage& stage, const Vector& q, const Vector& v, const Vector& w, const Vector& lambda_n,
                   const Vector& lambda_t, const Vector& theta);
  /// J_n' (v_plus + eps_r v_minus), n_c.
  Vector restitution(const Matrix& J_n, const Vector& v_plus, const Vector& v_minus) const;
  /// The values of variables in a solution x.
  static Vector values(const Vector& x, const std::vector<int>& variables);

  const StepFunctions step_functions_;
  const Problem& plant_;  // that of step_functions_ if there is one
  const ProblemInfo& info_;
  Mpcc& mpcc_;
  PlantFunctions functions_;
  StateBounds bounds_;

 private:
  const Cone cone_;
  const int facets_;
  int initial_gap_row_ = -1;                           // the first of n_c
  std::vector<SmoothFunction> cone_slack_, cone_law_;  // of (3) or its published form, per contact
};

}  // namespace ricochet
