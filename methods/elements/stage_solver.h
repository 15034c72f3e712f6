#pragma once

#include <Eigen/Cholesky>
#include <cstdint>
#include <span>
#include <vector>

#include "methods/contact_laws/friction_polygon.h"
#include "methods/elements/newton_system.h"
#include "methods/linear_algebra/small_inverse.h"
#include "methods/runge_kutta/butcher_tableau.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// One Runge-Kutta step with all its values; a finite element of FESD-J.
struct Element {
  double h = 0;               ///< length [s]
  Vector q0, v0;              ///< left end (after an impact)
  Matrix q, v, a;             ///< n_q x n_s: positions, velocities, accelerations v' at the stages
  Matrix lambda_n;            ///< n_c x n_s; zero for an open contact
  Matrix lambda_t;            ///< n_lambda_t x n_s
  Vector slip_start;          ///< n_lambda_t; in: unit slip direction where slip in space starts from rest, else 0
  Vector q1, v1;              ///< right end
  bool is_projected = false;  ///< StageSolver (10) made v1, and (11) the forces at the right end:
  Vector end_lambda_n, end_lambda_t;  ///< n_c, n_lambda_t; zero if the tableau says nothing about the right end
  std::vector<ContactMode> modes;     ///< n_c
  std::vector<int> facets;            ///< n_c, of vertex_slip and edge_slip, else 0; empty without friction in space

  void resize(const ProblemInfo& info, int n_s);
};

/// Where a run of equal steps ends.
struct Switch {
  enum class Kind : std::uint8_t {
    gap_closes,      ///< f_c = 0
    force_vanishes,  ///< lambda_n = 0
    slip_stops,      ///< v_t = 0 in the plane; in space see StageSolver (8)
    cone_reached,    ///< ||lambda_t|| = mu lambda_n of a sticking contact
    slip_turns,      ///< on a polygon, vertex slip becomes normal to an edge
    edge_left,       ///< on a polygon, the force reaches the end of its edge
  };
  Kind kind = Kind::gap_closes;
  int contact = -1;
  int zeros_at_start = 0;      ///< of the switch function at the left end; these roots h = 0 are divided out
  double left_gap = 0;         ///< [m] of a contact that starts the run touching: its gap closes where it is this again
  bool together = false;       ///< the contacts of the same bodies that slip in space come to rest with this one
  FacetCondition condition{};  ///< on a polygon: the one that becomes zero; its facet is -1 elsewhere

  /// Its function is one of the forces at the right end.
  bool needs_force() const {
    return kind == Kind::force_vanishes || kind == Kind::cone_reached || kind == Kind::edge_left;
  }
  bool on_polygon() const { return condition.facet >= 0; }
  bool is(Kind its_kind, int its_contact) const { return contact == its_contact && kind == its_kind; }
};

/// Solves the stage equations of an implicit Runge-Kutta step with a fixed mode for every contact:
///
///   v_j = v_0 + h sum_k a_jk w_k                                                        (1)
///   q_j = q_0 + h (sum_k a_jk) v_0 + h^2 sum_k (A^2)_jk w_k                              (2)
///   0   = M(q_j) w_j - f_v(q_j,v_j) - B_u u - sum_{i closed} J_n^i lambda_n,j^i + J_t^i lambda_t,j^i     (3)
///   0   = f_c^i(q_j),  i closed                                                         (4)
///   v_1 = P (v_0 + h sum_k b_k w_k),   q_1 = q_0 + h v_0 + h^2 sum_k (b'A)_k w_k        (5)
///
/// and for a contact with friction one of
///
///   stick            0 = J_t^i(q_j)' v_j                                                (7a)
///   slip+, slip-     lambda_t,j = -+mu lambda_n,j                                       (7b)
///   slip in space    0 = lambda_t,j + mu lambda_n,j v_t,j / ||v_t,j||,   v_t = J_t' v   (7c)
///
/// or with a polygon in place of the disc, instead of (7c), lambda_t = -mu lambda_n along + x held and held' v_t = 0
/// (friction_polygon.h): at a vertex like (7b), on an edge like (7b) across it and like (7a) along it. (7a), (7b) have
/// that form, too: TangentialLaw.
///
/// (1), (2), (5) are the usual q_j = q_0 + h sum a_jk v_k with the stage velocities inserted. Unknowns are the
/// accelerations w_j (Element::a) and the forces lambda_j, without lambda_t where (7b) gives it; Newton on (3), (4),
/// (7) with rows (4) divided by h^2 and (7a) by h. A contact that is open, or has no friction, has no tangential
/// unknown.
///
/// Where a contact moves by itself (problem.h, (7)) the rows of (4), (7) and R of (10) have the clock, and the forces
/// in (3) and C of (10) do not. A gap or a drive that is not affine in t is curved, whatever it is in the bodies'
/// coordinates.
///
/// P of (5) is the identity, unless a closed contact is curved. (4) alone leaves a velocity of O(h^n_s) across it,
/// which errors of the forces made. So P, at q_1, takes it away by impulses of all closed contacts, along the
/// directions of their forces:
///
///   P = I - M^-1 C (R' M^-1 C)^-1 R',   R = [J_n closed, J_t held],   C = [J_n - mu J_t d slipping, else as R]
///   (10)
///
/// with d the direction of slip, or `along`. The force of the last stage is of order n_s - 1 only. The forces at the
/// right end, which say when a contact breaks or begins to slip, are those that keep q_1, v_1 on the contacts, as
/// accurate as the state:
///
///   M w = f_v + B_u u + C lambda,   R' w + (d/dt R') v_1 = 0.                             (11)
///
/// Without P they are the stage forces extrapolated to the right end. Tableaus without a stage there leave the curve
/// already with q_1: P = I.
///
/// Slip in space that comes to rest at the right end is singular in (7c). A stage there - the last one of a stiffly
/// accurate tableau - has (7a) instead, and the element length makes its force reach the cone from outside:
///
///   J_t' v_{n_s} = 0,   ||lambda_t,n_s|| = mu lambda_n,n_s.                             (8)
///
/// This force is that of the stage, also where (11) replaces it: (11) sticks already, and lies inside the cone.
/// Other tableaus cannot make both components of v_t at the right end zero with one length. A rigid body that slides
/// and spins on several contacts, all of one support, comes to rest on all of them at once. Then the first half of (8)
/// holds for each, redundant as it is, and instead of the second the power of friction is all that the cones allow,
/// with the slip accelerations in place of the velocities that vanish:
///
///   sum_i lambda_t^i' s^i = sum_i mu^i lambda_n^i ||s^i||,   s = (J_t' v)^. = J_t' w + T v   at stage n_s.      (9)
///
/// Redundant contacts (four corners on a plane) have no unique forces: the smallest are taken, see redundant_system.h;
/// for (9), those nearest to mu^i lambda_n^i s^i / ||s^i||, which is the limit at rest.
///
/// (4) is evaluated as f_c(q_j) - f_c(q_0) = 0. Divided by h^2, the rounding of either term would show in the force, so
/// the difference is taken without them: J_n' (q_j - q_0) for an affine gap; else, as long as J_n hardly changes in the
/// step, the integral of J_n' (q_j - q_0) along the chord by Gauss quadrature (6). f_c(q_0) itself is rounding that one
/// short step could remove only with forces far larger than rounding; it is removed when many steps have gathered more
/// than 1e-13 of the largest size that q had in the run.
///
/// solve() has h given and keeps the factors of the Newton matrix from step to step as long as it contracts: for an
/// affine scene they are exact and one solution of the linear system (newton_system.h) solves the step.
/// solve_to_switch() has h unknown too, with the switch as the additional equation: the square system of FESD-J for a
/// given active set.
class StageSolver {
 public:
  enum class Result : std::uint8_t { converged, no_convergence, singular, left_interval };

  /// @param tolerance  relative size of the last Newton correction
  /// @param polygon  friction in space; the disc is the default
  StageSolver(const Problem& problem, const ButcherTableau& tableau, double tolerance, Counters& counters,
              const FrictionPolygon& polygon = FrictionPolygon());

  const ButcherTableau& tableau() const { return tableau_; }
  bool is_redundant() const { return newton_.is_redundant(); }  ///< the forces of the last step are not the only ones

  /// In: h, q0, v0, modes, and a, lambda_n as first guess. Out: everything else. No allocation, apart from the first
  /// use of an active set.
  Result solve(Element& step);

  /// A run of steps of equal unknown length h, each starting where the one before ended, such that `end` holds at the
  /// right end of the last. In: q0, v0 of the first, modes and guesses of all, h as first guess. Out: the rest.
  /// A root with h <= 0 or h > max_h is refused with left_interval.
  Result solve_to_switch(std::span<Element> run, const Switch& end, double max_h);

  /// Switch function at the right end of a solved step, zeros at the start included. The tableau must reach the right
  /// end (ButcherTableau::right_end) for a switch of forces.
  double switch_value(const Element& last, const Switch& end);

  /// First guess for `to`, of equal length and starting where `from` ends: the stage polynomials of `from`, continued.
  void extrapolate(const Element& from, Element& to) const;

 private:
  void set_length(StageCoefficients& coefficients, double h) const;
  void set_active(const std::vector<ContactMode>& modes, const std::vector<int>& facets);
  void set_initial_values(const Element& step, double h);
  void stage_values(const StageCoefficients& k, Element& step);
  void end_values(const StageCoefficients& k, Element& step);
  void project_end_velocity(Element& step);
  void set_end_system(const Vector& q, const Vector& v, const Element& step);
  void constrained_forces(const Vector& q, const Vector& v);
  void set_end_forces(Element& step);
  void take_away_end_rates(Eigen::Ref<Vector> x);
  void project_variations(const Element& step);
  void gap_changes(int stage, const Element& step);
  bool rests(const ActiveContact& active, int stage) const;
  int n_held(const ActiveContact& active, int stage) const;
  void set_friction(const ActiveContact& active, int stage, const double* dx, Element& step) const;
  /// What (7a) is divided by: h, but 1 for (8), among rows (7c).
  static double tangential_scale(const ActiveContact& active, double h) {
    return active.mode == ContactMode::slip ? 1 : h;
  }
  double slip_direction(const ActiveContact& active, const double* v, const Element& step, double* direction) const;
  void residual(const StageCoefficients& k, const Element& step);
  void friction_residual(const StageCoefficients& k, const ActiveContact& active, int j, const Element& step,
                         double* r);
  void derivatives(const StageCoefficients& k, const Element& step);
  void friction_derivatives(const StageCoefficients& k, const ActiveContact& active, int stage, const Element& step);
  void gather_forces(const Element& step);
  bool is_consistent(const Element& step, double h) const;
  void linearize_step(const StageCoefficients& k, const Element& step, Matrix& response);
  double deflated_switch(const Element& last, const Switch& end, double h, Eigen::RowVector2d& slope);
  void switch_slope(const Element& last, const Switch& end, Eigen::RowVector2d& slope);
  double end_margin(const Switch& end, const Eigen::Ref<const Vector>& lambda_n,
                    const Eigen::Ref<const Vector>& lambda_t) const;
  bool is_of_last_stage(const Switch& end) const;
  static bool slip_that_vanishes(const Element& last, const Switch& end, double* direction);
  void constrained_force_slope(const Element& last, const Switch& end, Eigen::RowVector2d& slope);
  void force_slope(const Element& last, const Switch& end, Eigen::RowVector2d& slope) const;
  double slip_acceleration(const ActiveContact& active, const Element& last, double* s) const;
  void spread_friction(Element& last);
  double missing_power(const Element& last, Eigen::RowVector2d* slope);
  double correct(const double* dx, double h, Element& step) const;
  double velocity_scale(const Element& step, double h) const;
  void set_dependent_forces(Element& step) const;
  void set_slip_in_space(Element& step);
  const StageCoefficients& coefficients_for(double h);
  bool refresh(const StageCoefficients& k, const Element& step, bool again);

  const Problem& problem_;
  const ButcherTableau tableau_;
  const double tolerance_;
  Counters& counters_;
  const FrictionPolygon polygon_;
  const int n_q_, n_s_;
  const ProblemInfo::Structure structure_;
  const bool stiffly_accurate_;

  Matrix A2_;             // A A
  Vector bA_;             // A' b
  Vector rows_;           // row sums of A; equal to c in all but the smallest Radau IA and Lobatto IIIB methods
  Matrix extrapolation_;  // stage values to those of the next step of equal length; empty when c has equal entries
  Matrix M_;              // constant mass

  // The active set.
  std::vector<ContactMode> modes_;
  std::vector<int> facets_;
  std::vector<ActiveContact> closed_;
  std::vector<char> is_closed_;  // n_c: J_n_ and J_t_ at the stages are those of closed contacts only
  int n_x_ = 0;                  // unknowns per stage: n_q accelerations, then the forces of the closed contacts
  bool is_affine_ = false;
  bool has_force_jacobian_ = false;  // f_v + B_u u depends on q or v
  bool has_curved_ = false;          // a closed contact is curved
  bool is_projected_ = false;        // P of (5) is not I
  double predicted_tolerance_ = 0;
  bool has_friction_ = false;   // a closed contact has
  bool is_frozen_ = false;      // (7c) with the direction slip_start
  int resting_contact_ = -1;    // (8) holds for it, in the step at hand
  bool rest_together_ = false;  // and for all of its support that slip in space

  std::vector<StageCoefficients> coefficients_;  // of the last lengths
  std::size_t last_ = 0, oldest_ = 0;            // used last; to be replaced next
  NewtonSystem newton_;

  // (10), (11)
  Eigen::Index n_end_ = 0;  // columns of R, C
  Matrix end_directions_;   // 2 x closed contacts: d, zero where nothing slips
  Vector end_q_, end_v_;
  Matrix M_end_;
  Eigen::LLT<Matrix> llt_;
  Matrix held_, pushed_;             // R; C, then M^-1 C
  Matrix end_system_, end_inverse_;  // R' M^-1 C
  Vector end_rates_, end_impulses_;

  // Work space.
  Vector f_, J_n_, J_t_, gap_, lambda_, lambda_t_, r_, dx_;
  Vector chord_J_, chord_q_, chord_variation_, gap_change_;
  Vector gap0_, kept_gap0_;  // f_c(q_0), and the part of it that (4) removes
  Vector gap_size_;          // largest sum_k |J_n,k q_k| so far: what rounding of a gap is relative to
  Vector kept_slip0_;        // the part of held' J_t' v_0 that (7a) removes
  Matrix dq_;                // q_j - q_0 without the rounding of q_j
  Matrix Mq_, Fq_, Fv_, Jq_, Tq_, Ta_;
  std::vector<Matrix> stage_M_;  // M that varies
  StageDerivatives derivatives_;
  Vector x_;                    // all unknowns, accelerations left out
  std::vector<int> row_power_;  // of the h that a row of (4), (7) is divided by
  double load_ = 0;             // largest |f_i| / M_ii of the last residual
  SmallInverse end_lu_;

  // A run to a switch: variations have two columns, a constant one and one per unit of h.
  StageCoefficients run_coefficients_;
  Matrix incoming_q_, incoming_v_, stage_dq_, stage_dv_;  // n_q x 2: of the left end of a step, of a stage
  Matrix rhs_;                                            // n_s n_x x 2
  std::size_t run_length_ = 0;
  std::vector<Matrix> run_response_;  // per step, n_s n_x x 2: of the unknowns
};

}  // namespace ricochet
