#pragma once

#include <vector>

#include "methods/elements/active_set.h"
#include "methods/elements/stage_coefficients.h"

namespace ricochet {

/// The parts of a Newton matrix: the derivatives of (3), (4) and (7) of stage_equations.h, per stage. Those of a
/// closed contact exist on its support only: entry (row, s) of row < n_rows stands at `entry` + row * support.size() +
/// s. The clock's column of K is left out: its equation says that its acceleration is zero.
struct StageDerivatives {
  bool has_dynamics = false;     ///< Dq or Dv may differ from zero
  std::vector<Matrix> Dq, Dv;    ///< n_q x n_q: of (3) by q_j and v_j; not read unless has_dynamics
  std::vector<Vector> forces;    ///< minus (3) by lambda_j
  std::vector<Vector> Rq, Rv;    ///< of (4), (7) by q_j, v_j
  std::vector<Vector> Rl;        ///< of (7) by lambda_j, 3 x 3 entries per closed contact, row by row
  std::vector<const double*> M;  ///< n_q x n_q
};

/// Workspace that the functions of StageEquations share; each documents what it sets.
struct StageWorkspace {
  StageWorkspace() = default;
  StageWorkspace(const StageWorkspace&) = delete;  // StageDerivatives::M points into it
  StageWorkspace& operator=(const StageWorkspace&) = delete;

  Matrix dq;                   ///< n_q x n_s: q_j - q_0 of (2) without the rounding of q_j
  Vector gap0;                 ///< n_c: f_c(q_0)
  Vector J_n0;                 ///< J_n(q_0), packed
  Vector kept_gap;             ///< n_c: the part of gap0 that (4) removes
  Vector kept_slip;            ///< n_lambda_t: the part of held' J_t' v_0 that (7a) removes
  Vector gap_size;             ///< n_c: largest sum_k |J_n,k q_k| so far, the scale of the rounding of a gap
  std::vector<char> is_short;  ///< n_c: the element is so short that rounding of its gap would show in (4)
  Vector r;                    ///< n_s n_unknowns: residual of (3), (4), (7)
  double load = 0;             ///< largest |f_i| / M_ii of the last residual
  StageDerivatives K;          ///< parts of the Newton matrix
  std::vector<Matrix> M;       ///< n_s times n_q x n_q, where M varies
  Vector x, dx;                ///< n_s n_unknowns: forces among the unknowns, accelerations left out; a correction
};

/// The equations of an element with a fixed mode for every contact, h given:
///
///   v_j = v_0 + h sum_k a_jk w_k                                                                            (1)
///   q_j = q_0 + h (sum_k a_jk) v_0 + h^2 sum_k (A^2)_jk w_k                                                 (2)
///   0   = M(q_j) w_j - f_v(q_j,v_j) - B_u u - sum_{i closed} (J_n^i lambda_n,j^i + J_t^i lambda_t,j^i)      (3)
///   0   = f_c^i(q_j),  i closed                                                                             (4)
///   v_1 = P (v_0 + h sum_k b_k w_k),   q_1 = q_0 + h v_0 + h^2 sum_k (b'A)_k w_k                            (5)
///
/// with P of end_projection.h, and for a contact with friction one of
///
///   stick            0 = J_t^i(q_j)' v_j                                                                    (7a)
///   slip+, slip-     lambda_t,j = -+mu lambda_n,j                                                           (7b)
///   slip in space    0 = lambda_t,j + mu lambda_n,j v_t,j / ||v_t,j||,   v_t = J_t' v                       (7c)
///
/// When slip in space starts from rest, v_t is zero. The direction of v_t in (7c) then has no derivative, which Newton's
/// method needs. The direction of the force has a derivative. In
///
///   0 = ||lambda_t,j|| - mu lambda_n,j,   0 = l_perp' v_t,j / h,   l = lambda_t,j / ||lambda_t,j||            (7d)
///
/// the direction belongs to the force. The solutions with lambda_t' v_t <= 0 are those of (7c). As v_t -> 0 the second row
/// becomes A W times the turning of the forces, which is regular: of all directions that friction could turn from, it is
/// the smooth one (W = J_t' M^-1 J_t).
///
/// Or with a polygon in place of the disc, instead of (7c), lambda_t = -mu lambda_n along + x held and held' v_t = 0
/// (friction_polygon.h): at a vertex like (7b), on an edge like (7b) across it and like (7a) along it. (7a), (7b) have
/// that form, too: TangentialLaw. Slip in space that comes to rest at the right end has (7a) at the last stage instead,
/// see (8), (9) of switch_function.h.
///
/// (1), (2), (5) are the usual q_j = q_0 + h sum a_jk v_k with the stage velocities inserted. Unknowns are the
/// accelerations w_j (Element::a) and the forces lambda_j, without lambda_t where (7b) gives it; rows (4) are divided
/// by h^2 and rows (7a) by h. A contact that is open, or has no friction, has no tangential unknown.
///
/// If a contact moves by itself (problem.h, (7)), the rows of (4), (7) contain the clock, but the forces in (3) do not.
/// A gap or a drive that is not affine in t is curved, whatever it is in the bodies' coordinates.
///
/// (4) is evaluated as f_c(q_j) - f_c(q_0) = 0. Divided by h^2, the rounding of either term would show in the force, so
/// the difference is taken without them: J_n' (q_j - q_0) for an affine gap; else, in elements so short that J_n hardly
/// changes, the integral of J_n' (q_j - q_0) along the chord by Gauss quadrature,
///
///   f_c(q_0 + dq) - f_c(q_0) = int_0^1 J_n(q_0 + s dq)' dq ds.                                              (6)
///
/// f_c(q_0) itself is rounding that one short step could remove only with forces far larger than rounding; it is
/// removed when it has accumulated over many steps to more than 1e-13 of the largest |q| in the run.
class StageEquations {
 public:
  StageEquations(const Problem& problem, const StageTableau& tableau, const ActiveSet& active, Counters& counters);

  /// Allocates in a new workspace what every element needs.
  void prepare(StageWorkspace& work) const;
  /// Makes room for the residual and the derivatives of another active set: only Newton's method needs them.
  void resize(StageWorkspace& work) const;

  /// Decides which part of f_c(q_0) equation (4) removes, and which part of J_t' v_0 equation (7a). Sets gap0, J_n0,
  /// kept_gap, kept_slip, is_short.
  void set_initial_values(const Element& e, double h, StageWorkspace& work);
  /// (1) and (2). Sets dq.
  void set_stages(const StageCoefficients& k, Element& e, StageWorkspace& work) const;
  /// (5) with P = I.
  void set_right_end(const StageCoefficients& k, Element& e) const;
  /// (3), (4) and (7), stage after stage. Sets r, load and, where it varies, M; reads dq and the initial values.
  void residual(const StageCoefficients& k, const Element& e, StageWorkspace& work);
  /// The derivatives of (3), (4), (7) at every stage, and M. Sets K.
  void derivatives(const StageCoefficients& k, const Element& e, StageWorkspace& work);
  /// lambda_t of slip in space by (7c) from the velocities: they are known to the tolerance, the forces in the Newton
  /// correction only to the tolerance divided by h.
  /// @return false where a force of (7d) does not resist its slip
  bool set_slip_in_space(Element& e);
  /// First guess of the forces of (7d). @return whether there are any
  bool start_slip(Element& e) const;

 private:
  /// Contacts at one stage: packed Jacobians of the closed ones, gaps, and d(J_t' v)/dq.
  struct StageContacts {
    Vector J_n, J_t, gap;
    Matrix T;
  };

  void prepare_derivatives(StageWorkspace& work) const;
  static double variation(const ContactInfo& contact, const Vector& J_n, const Vector& other);
  void gap_changes(int stage, const Element& e, const StageContacts& at, const StageWorkspace& work);
  void integrate_chords(int stage, const Element& e, const StageContacts& at, const StageWorkspace& work);
  struct SlipForce {
    double l[2];  // direction of lambda_t
    double size;  // of lambda_t [N]
    double v_t[2];
  };
  SlipForce slip_force(const ActiveContact& active, int j, const Element& e, const double* packed_J_t) const;
  void friction_residual(const StageCoefficients& k, const ActiveContact& active, int stage, const Element& e,
                         const Vector& J_t, const Vector& kept_slip, double* r) const;
  void friction_derivatives(const StageCoefficients& k, const ActiveContact& active, int stage, const Element& e,
                            const StageContacts& at, StageDerivatives& K) const;

  const Problem& problem_;
  const StageTableau& tableau_;
  const ActiveSet& active_;
  Counters& counters_;
  const ProblemInfo::Structure structure_;
  const int n_q_, n_s_;
  const bool is_curved_;           // some contact is
  const bool has_force_jacobian_;  // f_v + B_u u depends on q or v
  Matrix M_;                       // constant mass

  // Scratch of one function at a time.
  Vector f_, lambda_n_, lambda_t_;
  StageContacts at_;
  Matrix Mq_, Fq_, Fv_, Jq_;
  Vector chord_J_, chord_q_, chord_variation_, chord_integral_;
  Vector gap_change_;  // n_c: f_c(q_j) - f_c(q_0) of curved contacts, of the stage at hand
};

}  // namespace ricochet
