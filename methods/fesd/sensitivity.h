#pragma once

#include <memory>
#include <string>
#include <vector>

#include "methods/elements/fesd_step.h"
#include "methods/linear_algebra/rank_revealing.h"
#include "methods/runge_kutta/butcher_tableau.h"
#include "methods/variations/point_variation.h"

namespace ricochet {

/// Derivatives of what FESD-J computes with respect to initial values and parameters theta, by the implicit function
/// theorem on the equations that hold at the solution. Below, d is d/dtheta, one column per theta, and every function
/// also depends on the parameters directly. Starting from dq_0, dv_0 at t = 0, element after element:
///
/// Left end, where an impulse acts: (1), (2), (5) of point_variation.h.
///
/// Element, with the stage equations and modes of stage_equations.h, and its length h as one more theta:
///
///   d[ M(q_j) w_j - f_v(q_j,v_j) - B_u u - J_n lambda_n,j - J_t lambda_t,j ] = 0        (1)
///   d[ f_c^i(q_j) ] = 0,   i closed; friction by (5) of point_variation.h               (2)
///   dq_j = dq_0 + h r_j dv_0 + (r_j v_0 + 2 h sum_k (A^2)_jk w_k) dh + h^2 sum_k (A^2)_jk dw_k,   r = A 1
///   dv_j = dv_0 + (sum_k a_jk w_k) dh + h sum_k a_jk dw_k                               (3)
///
/// (3) with b'A, b' in place of a row of A^2, A gives the right end. There the projection of v_1 (end_projection.h) is an
/// impulse too, with eps_r = 0 for all closed contacts.
///
/// Element lengths. A run of equal elements that a switch ends has d of the switch function at its right end equal to
/// zero, which gives dh. With s the slip velocity:
///
///   f_c^i(q_1),   lambda_n^i,   s^i,   mu lambda_n^i - ||lambda_t^i||                    (4)
///
/// with the forces at the right end, of the stages or of the state there (end_projection.h, 11); where slip in space
/// comes to rest, the last of them, and the contact sticks at the last stage. After the last switch the elements of a
/// step share its remaining time: n dh = dt_end - dt.      (5)
///
/// A switch that falls on the boundary of two steps has no equation there, but it moves off the boundary with theta. It
/// is treated as if an element of length zero led up to it, the limit of (3), with (4) for an impact or for slip that
/// stops; where a contact breaks or begins to slip accelerations are continuous, and only its time would change:
///
///   dq = dq_1 + v- dh,   dv = dv- + a dh,   M a = f_v + B_u u + J_n lambda_n + J_t lambda_t     (6)
///
/// Nothing depends smoothly on theta where the active set is about to change: at a grazing contact the derivatives are
/// not finite. They are those of the solved equations, so they converge with the order of the method.
class Sensitivity {
 public:
  /// @param names  Settings::sensitivities. @throws InputError for a name that the problem does not have, and for one
  /// whose variation of the initial state violates a bilateral constraint
  Sensitivity(const Problem& problem, const ButcherTableau& tableau, const std::vector<std::string>& names)
      : Sensitivity(VariedProblem(problem, names), tableau) {}
  /// Derivatives with respect to the variables of `varied`.
  Sensitivity(VariedProblem varied, const ButcherTableau& tableau);
  Sensitivity(const Sensitivity&) = delete;

  /// Begins again at the end of a step. The variations there are those of the variables, moved to where the contacts that
  /// this step ends with stay closed. @param before  null where a run begins
  void restart(const FesdStep* before);

  /// The contact whose switch falls on the boundary of two steps, (6): it closes with an impulse, or its slip stops without
  /// one. -1 for none. @param before  modes at the end of the step before. @param step  the one that begins there
  static int switch_at_start(const std::vector<ContactMode>& before, const FesdStep& step);

  /// Continues through an accepted step. @param dt_end  derivative of the time where it ends unless a switch ends it
  void add(const FesdStep& step, const Vector& dt_end);
  /// Takes the last add() back.
  void reject() { reached_ = before_; }

  const Matrix& dq() const { return reached_.q; }
  const Matrix& dv() const { return reached_.v; }
  const Vector& dt() const { return reached_.t; }
  /// Derivatives of Element::a of the last element: a column per theta, the columns of a below each other.
  const Matrix& stage_accelerations() const { return stage_accelerations_; }
  /// Derivatives of the values of an element: a column per theta, then one of no use. Stages are below each other.
  struct ElementDerivatives {
    Matrix q, v;              ///< n_s times n_q rows
    Matrix forces;            ///< n_s times n_c + n_lambda_t rows
    Matrix v_minus;           ///< n_q rows, at the left end before an impact there
    Matrix start_q, start_v;  ///< n_q rows each, at the left end after it
    Vector h;                 ///< n_theta, of the length
  };
  /// Writes those of the elements of the next step, in the order of time. @param elements  null for none; else it grows
  /// where the step has more of them, and must outlive that add()
  void write_elements(std::vector<ElementDerivatives>* elements) { kept_ = elements; }
  const PointVariation& point() const { return point_; }
  long factorisations() const { return n_factorisations_; }      ///< of the matrices of elements, so far
  const Vector& dt_final() const { return varied_.dt_final(); }  ///< of the problem's end_time
  /// Derivatives of the time of the left end of an element of the last step.
  const Vector& dt_of_element(int element) const { return dt_elements_[static_cast<std::size_t>(element)]; }

 private:
  /// Variations: n_theta columns, then one per unit of h of the run at hand.
  struct State {
    Matrix q, v;
  };
  using Rows = PointVariation::Rows;
  using Friction = PointVariation::Friction;
  using Numbering = PointVariation::Numbering;

  void through_switch_at_start(const FesdStep& step);
  void through_start(const FesdStep& step, int element, State& state) const;
  static bool stops_in_space(const Element& e, const Switch& end);
  static bool sticks_at_end(const Element& e, const Switch& end, int contact);
  Friction slip_at_end(const Element& e, int contact, double lambda_n) const;
  void set_laws_at_end(const Element& e, const Switch& end, const Eigen::Ref<const Vector>& lambda_n);
  bool needs_forces(const Switch& end) const;
  void set_constrained_forces(const Element& e, const Switch& end, const State& state);
  void through_projection(const Element& e, const Switch& end, State& state);
  void start_stages(const Element& e, const State& start, ElementDerivatives& stages) const;
  void add_stage(const Element& e, const Switch& end, int j, const ElementDerivatives& stages, Eigen::Ref<Matrix> K,
                 Eigen::Ref<Matrix> R);
  void solve(const MatrixMap& K, MatrixMap& R);
  void finish_stages(const Element& e, const MatrixMap& dx, ElementDerivatives& stages) const;
  void remember_end(const FesdStep& step);
  /// @param state  in: at the left end; out: at the right end
  /// @param stages  out: of the element, with a last column per unit of h
  void through_element(const Element& e, const Switch& end, State& state, ElementDerivatives& stages);
  void set_switch_slope(const Element& e, const Switch& end, const State& state, const Matrix& forces);

  const VariedProblem varied_;
  const PointVariation point_;
  const Problem& problem_;
  const ButcherTableau tableau_;
  const Matrix A2_;      // A^2
  const Vector r_, bA_;  // of (3)
  const int n_q_, n_c_, n_t_, n_s_;
  const Eigen::Index n_theta_;

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
  std::vector<ElementDerivatives>* kept_ = nullptr;
  std::vector<ElementDerivatives> elements_;  // one, if they are not kept

  // Scratch.
  State state_;
  /// Variations inside the element at hand, columns as in State.
  struct ElementVariation {
    Matrix forces;         // at the right end, where needs_forces(): n_c, then n_t, rows
    Matrix accelerations;  // of the stages: n_s times n_q rows
  };
  ElementVariation element_;
  Eigen::RowVectorXd slope_;  // of a switch function, n_theta + 1
  Vector dh_;
  Numbering numbering_;  // of the element at hand
  std::vector<Friction> laws_;
  SemidefiniteInverse delassus_;
  /// A matrix and its factorisation, until another matrix of the same size takes their place.
  struct Factors {
    Matrix K;
    ConsistentLu lu;
  };
  std::vector<std::unique_ptr<Factors>> factors_;  // by size
  long n_factorisations_ = 0;
};

}  // namespace ricochet
