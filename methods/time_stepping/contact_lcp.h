#pragma once

#include <span>
#include <vector>

#include "methods/bilateral_constraints.h"
#include "methods/complementarity/lemke.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// The one-step contact problem of velocity-level time stepping, with the friction disc replaced by a polygon:
///
///   v+ = v_free + W (J_n Lambda_n + D beta + G m)                                        (1)
///   0 <= Lambda_n^i  _|_  J_n^i' v+ + s^i >= 0                                           (2)
///   0 <= beta^i      _|_  D^i' v+ + gamma^i e >= 0                                       (3)
///   0 <= gamma^i     _|_  mu^i (Lambda_n^i + p^i) - e' beta^i >= 0                       (4)
///   G' v+ + s = 0                                                                        (5)
///
/// for the active contacts i; G, m of the bilateral constraints, which (5) eliminates (bilateral_constraints.h). W is
/// the inverse of the iteration matrix of the method, s a shift by the impact law, p a normal impulse that is already
/// there. The columns of D^i are the facet directions: +-J_t in the plane, and in space n_facets directions cos(phi)
/// J_t,1 + sin(phi) J_t,2. A contact without friction has no beta and no gamma. (1)-(4) is a linear complementarity
/// problem with a copositive matrix, which Lemke's method solves.
///
/// Source: Stewart, Trinkle, IJNME 39 (1996), eq. (12)-(16); Anitescu, Potra, Nonlinear Dynamics 14 (1997), section 3.
class ContactLcp {
 public:
  /// @param n_facets  even, at least 4; used for contacts in space only
  ContactLcp(const Problem& problem, int n_facets, Counters& counters);

  /// Contact directions at q. @param active  unilateral contacts, ascending
  void set_active(const Vector& q, std::span<const int> active);

  /// Delassus matrix for W. @param W  n_q x n_q
  /// @return false when the bilateral constraints depend on each other
  bool set_inverse_mass(const Matrix& W);

  const std::vector<int>& active() const { return active_; }
  double normal_velocity(std::size_t k, const Vector& v) const;  ///< J_n' v of the k-th active contact

  /// G' v, n_c; entries of unilateral contacts are left alone.
  void bilateral_velocities(const Vector& v, Vector& rates) const { bilateral_.velocities(v, rates); }

  /// Adds an impulse of the k-th active contact and the reaction of the bilateral constraints. @param Lambda_n  n_c
  void add_normal_impulse(std::size_t k, double impulse, Vector& v, Vector& Lambda_n) const;

  /// Solves (1)-(5) and replaces v_free by v+.
  /// @param shift    s of all contacts, n_c
  /// @param present  p of the active contacts; empty is zero
  LcpStatus solve(Vector& v, const Vector& shift, const Vector& present);

  const Vector& Lambda_n() const { return Lambda_n_; }  ///< n_c, of the last solve(), m included; zero where not active
  const Vector& Lambda_t() const { return Lambda_t_; }  ///< n_lambda_t, D beta in terms of J_t

  /// Largest violation of (2)-(5) at v+, relative to the velocities and impulses in them.
  double residual(const Vector& v_plus, const Vector& shift, const Vector& present) const;

 private:
  const Problem& problem_;
  const int n_facets_;
  Counters& counters_;
  std::vector<int> active_;
  std::vector<int> facets_begin_, facets_count_, gamma_index_;  // per active contact
  int n_active_ = 0, n_facet_total_ = 0, size_ = 0;
  Vector packed_n_, packed_t_, column_;
  const bool has_bilateral_;
  BilateralConstraints bilateral_;
  Matrix directions_, W_directions_;  // n_q x (n_active + facets): J_n, then D; P W in place of W
  Matrix reactions_;                  // n_c x (n_active + facets): of the bilateral constraints to the directions
  Matrix G_, lcp_M_;
  Vector lcp_q_, z_;
  Vector Lambda_n_, Lambda_t_;
  std::vector<int> last_active_;
  LemkeSolver lemke_;
};

}  // namespace ricochet
