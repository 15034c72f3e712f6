#pragma once

#include <functional>
#include <string>
#include <vector>

#include "methods/elements/fesd_step.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// Derivatives of what FESD-J computes with respect to initial values and parameters theta, by the implicit function
/// theorem on the equations that hold at the solution. Below, d is d/dtheta, one column per theta, and every function
/// also depends on the parameters directly. Starting from dq_0, dv_0 at t = 0, element after element:
///
/// Left end, where an impulse acts, from dv- to dv+:
///
///   d[ M (v+ - v-) - J_n Lambda_n - J_t Lambda_t ] = 0                                  (1)
///   d[ J_n^i' (v+ + eps_r^i v-) ] = 0,   Lambda_n^i > 0 or i bilateral                  (2)
///
/// Element, with the stage equations and modes of stage_equations.h, and its length h as one more theta:
///
///   d[ M(q_j) w_j - f_v(q_j,v_j) - B_u u - J_n lambda_n,j - J_t lambda_t,j ] = 0        (3)
///   d[ f_c^i(q_j) ] = 0,   i closed                                                     (4)
///   dq_j = dq_0 + h r_j dv_0 + (r_j v_0 + 2 h sum_k (A^2)_jk w_k) dh + h^2 sum_k (A^2)_jk dw_k,   r = A 1
///   dv_j = dv_0 + (sum_k a_jk w_k) dh + h sum_k a_jk dw_k                               (5)
///
/// (5) with b'A, b' in place of a row of A^2, A gives the right end. There the projection of v_1 (end_projection.h) is an
/// impulse too, with (1), (6) and eps_r = 0 in (2) for all closed contacts. Friction in (1) and (3), of a contact with
/// slip velocity s = J_t' v (v+ in (1)) and forces lambda_n, lambda_t (in (1) Lambda_n, Lambda_t):
///
///   stick   ds = 0                                                                      (6a)
///   slip    d[ lambda_t + mu lambda_n s / ||s|| ] = 0; in the plane s / ||s|| is a constant sign     (6b)
///
/// Element lengths. A run of equal elements that a switch ends has d of the switch function at its right end equal to
/// zero, which gives dh:
///
///   f_c^i(q_1),   lambda_n^i,   s^i,   mu lambda_n^i - ||lambda_t^i||                    (7)
///
/// with the forces at the right end, of the stages or of the state there (end_projection.h, 11); where slip in space
/// comes to rest, the last of them, and (6a) at the last stage. Behind the last switch the elements of a step share its
/// remaining time: n dh = dt_end - dt.      (8)
///
/// A switch that falls on the boundary of two steps has no equation there, but it moves off the boundary with theta. It
/// is treated as if an element of length zero led up to it, the limit of (5), with (7) for an impact or for slip that
/// stops; where a contact breaks or begins to slip accelerations are continuous, and only its time would change:
///
///   dq = dq_1 + v- dh,   dv = dv- + a dh,   M a = f_v + B_u u + J_n lambda_n + J_t lambda_t     (9)
///
/// Nothing depends smoothly on theta where the active set is about to change: at a grazing contact the derivatives are
/// not finite. They are those of the solved equations, so they converge with the order of the method.
class Sensitivity {
 public:
  /// Why a run with sensitivities ends where impacts follow each other at one instant: their number and their order
  /// change with any perturbation.
  static constexpr const char* kNoDerivative =
      "the impacts of several contacts accumulate, and the motion behind them has no derivative";

  /// @param names  Settings::sensitivities. @throws InputError for a name that the problem does not have, and for one
  /// whose variation of the initial state violates a bilateral constraint
  Sensitivity(const Problem& problem, const ButcherTableau& tableau, const std::vector<std::string>& names);

  /// Continues through an accepted step. @param dt_end  derivative of the time where it ends unless a switch ends it
  void add(const FesdStep& step, const Vector& dt_end);
  /// Takes the last add() back.
  void reject() { reached_ = before_; }

  const Matrix& dq() const { return reached_.q; }
  const Matrix& dv() const { return reached_.v; }
  const Vector& dt() const { return reached_.t; }
  /// Derivatives of Element::a of the last element: a column per theta, the columns of a below each other.
  const Matrix& stage_accelerations() const { return stage_accelerations_; }
  const Vector& dt_final() const { return dt_final_; }  ///< of the problem's end_time
  /// Of the left end of an element of the last step.
  const Vector& dt_of_element(int element) const { return dt_elements_[static_cast<std::size_t>(element)]; }

 private:
  /// Variations: n_theta columns, then one per unit of h of the run at hand.
  struct State {
    Matrix q, v;
  };
  /// Linear equations in the variations of q and v of a point, of its unknowns x and of theta.
  struct Rows {
    Matrix q, v, x, theta;
    void reset(Eigen::Index n, Eigen::Index n_q, Eigen::Index n_columns);
  };
  struct Numbering {
    Numbering(const ProblemInfo& info, const std::function<bool(int)>& acts);
    struct Contact {
      int contact;
      Eigen::Index row;  ///< of its normal force, and of its first equation
    };
    std::vector<Contact> contacts;
    Eigen::Index size;
  };
  /// How a contact that carries a force obeys Coulomb.
  struct Friction {
    int contact = -1;
    bool sticks = false;
    Vector direction;  // of slip
    Matrix turn;       // mu lambda_n times the derivative of the direction by s
  };

  void through_switch_at_start(const FesdStep& step);
  void through_start(const FesdStep& step, int element, State& state) const;
  /// An impulse at q: of the contacts that press, or of the projection of v_1.
  struct Impulse {
    const Vector &q, &v_minus, &v_plus, &Lambda_n, &Lambda_t;
    const Element* projected = nullptr;  ///< the element that ends with it
    const Switch* end = nullptr;         ///< and the switch there
  };
  Numbering closed_contacts(const Element& e) const;
  void add_force_columns(const Numbering& numbering, const Vector& q, Rows& rows) const;
  void set_motion(const Numbering& numbering, const Vector& q, const Vector& v, const Vector& a, const Vector& lambda_n,
                  const Vector& lambda_t, const Matrix& parameters, Rows& rows) const;
  void add_forces(const Numbering& numbering, const Eigen::Ref<const Matrix>& unknowns, double weight,
                  Matrix& forces) const;
  void through_impulse(const Impulse& impulse, State& state) const;
  static bool stops_in_space(const Element& e, const Switch& end);
  static bool sticks_at_end(const Element& e, const Switch& end, int contact);
  Friction slip_at_end(const Element& e, int contact, double lambda_n) const;
  Matrix constrained_forces(const Element& e, const Switch& end, const State& state) const;
  void through_projection(const Element& e, const Switch& end, State& state) const;
  void require_consistent_start(const std::vector<std::string>& names) const;
  /// Variations inside an element, columns as in State.
  struct ElementVariation {
    Matrix forces;         // at the right end: n_c, then n_t, rows
    Matrix accelerations;  // of the stages: n_s times n_q rows
  };
  ElementVariation through_element(const Element& e, const Switch& end, State& state) const;
  Eigen::RowVectorXd switch_slope(const Element& e, const Switch& end, const State& state, const Matrix& forces) const;
  Matrix parameter_rows(const Vector& q, const Vector& v, const Vector& a, const Vector& lambda_n,
                        const Vector& lambda_t) const;
  Friction slip(int contact, const Vector& s, double lambda_n, int sign, const Vector& start) const;
  void add_friction(const Friction& friction, const Vector& q, const Vector& v, double lambda_n,
                    const Matrix& parameters, Eigen::Index column, Eigen::Index row, Rows& rows) const;
  Vector slip_velocity(int contact, const Vector& q, const Vector& v) const;
  Eigen::RowVectorXd gap_curvature(int contact, const Vector& q, const Vector& v) const;

  const Problem& problem_;
  const ButcherTableau tableau_;
  const int n_q_, n_c_, n_t_, n_s_;
  Eigen::Index n_theta_;
  Matrix parameters_;  // parameters x (n_theta + 1): which column varies which parameter
  Matrix deps_, dmu_;  // n_c x (n_theta + 1)
  Vector dt_final_;

  /// At the right end of the last step; no modes before the first.
  struct Reached {
    Matrix q, v;  // n_q x n_theta
    Vector t;
    bool is_at_switch = false;  // its equation has been used
    std::vector<ContactMode> modes;
    Vector lambda_n, lambda_t;
  };
  Reached reached_, before_;
  std::vector<Vector> dt_elements_;
  Matrix stage_accelerations_;
};

}  // namespace ricochet
