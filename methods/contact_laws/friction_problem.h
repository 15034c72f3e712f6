#pragma once

#include <Eigen/LU>
#include <span>
#include <vector>

#include "methods/complementarity/lemke.h"
#include "methods/contact_laws/friction_polygon.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// The contact laws at one instant, for impulses or for forces. r_n^i, r_t^i are impulses and w the velocities after
/// them, or r forces and w accelerations:
///
///   w = G r + b                                                                         (1)
///   0 <= r_n^i  _|_  w_n^i >= 0                                                         (2)
///   ||r_t^i|| <= mu^i r_n^i,   ||w_t^i|| r_t^i + mu^i r_n^i w_t^i = 0                   (3)
///
/// or, for a contact that slides in a known direction d^i already,
///
///   r_t^i = -mu^i r_n^i d^i   instead of (3).                                           (4)
///
/// G is the Delassus matrix of the contact directions, contact after contact: normal, then tangents. Without friction
/// (1), (2) are a linear complementarity problem with G itself. In the plane (3) is polyhedral: the problem is an LCP
/// with two facets beta+- >= 0 and a speed gamma >= 0 per contact, which Lemke's method solves,
///
///   r_t = beta+ - beta-,   0 <= beta+-  _|_  +-w_t + gamma >= 0,   0 <= gamma  _|_  mu r_n - beta+ - beta- >= 0.   (5)
///
/// In space (5) with eight facets is the first guess of a semismooth Newton method on the projection form of (2), (3),
///
///   0 = r_n - max(0, r_n - rho_n w_n)                                                   (6)
///   0 = r_t - P(r_t - rho_t w_t),   P: projection onto the disc of radius mu max(0, r_n - rho_n w_n),   (7)
///
/// with a line search on the norm of both. Where friction in space has a polygon (friction_polygon.h) instead of the
/// disc, (5) with its facets is the law itself; and (4) is a vertex d_k, or for a contact that slides normal to an edge
/// already
///
///   r_t = mu r_n d_k + l (d_k+1 - d_k),   0 <= l  _|_  (d_k+1 - d_k)' w_t + gamma >= 0,
///   0 <= gamma  _|_  mu r_n - l >= 0.                                                   (8)
///
/// One contact alone, without friction or with friction in the plane, is solved in closed form: where
///
///   G_nn -+ mu G_nt > 0                                                                 (9)
///
/// holds for both directions of slip, or for the one that is known, it has exactly one solution, open, stick or slip.
///
/// If the normals are dependent, as for a box on four corners, r is not unique: the smallest r is taken.
///
/// The solvers of contact_problem.h solve the same law for the many contacts of a time step, but cannot be used here.
/// They do not support contacts that already slide, (4) and (8). They return impulses, to a tolerance and depending on
/// the previous step; an element needs modes, decided to the rounding of b and determined by the state alone. If r is
/// not unique, they return the first solution that they find.
///
/// Sources: (5) Stewart, Trinkle, IJNME 39 (1996), eq. (12)-(16); (6), (7) Alart, Curnier, CMAME 92 (1991).
class FrictionProblem {
 public:
  struct Contact {
    double mu = 0;
    int n_t = 0;                           ///< tangent directions
    bool slides = false;                   ///< (4) instead of (3)
    double direction[2]{1, 0};             ///< d, a unit vector; with (8) it is -d_k
    bool is_on_edge = false;               ///< (8) instead of (4)
    int facet = 0;                         ///< with a polygon: input k of (8), output vertex or edge that carries r_t
    ContactMode mode = ContactMode::open;  ///< out: decided by (1)-(4)
  };

  /// @param most_contacts, most_tangents  up to which solve() allocates nothing when no contact is in space
  /// @param polygon  friction in space; the disc is the default
  void resize(int most_contacts, int most_tangents, const FrictionPolygon& polygon = FrictionPolygon());

  /// @param G  n x n, b  n with n = sum (1 + n_t); @param rounding  error bound of b
  /// @param r  n, overwritten with the solution; contacts: modes are set
  LcpStatus solve(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b, double rounding,
                  std::span<Contact> contacts, Eigen::Ref<Vector> r);

  int pivots() const { return lemke_.pivots(); }

 private:
  int columns_of(const Contact& contact) const;
  std::array<double, 2> column_direction(const Contact& contact, int f) const;
  void set_slip_mode(Contact& contact, const double* r) const;
  LcpStatus solve_polyhedral(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b,
                             std::span<Contact> contacts, Eigen::Ref<Vector> r);
  bool solve_cones(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b, std::span<Contact> contacts,
                   Eigen::Ref<Vector> r);
  bool newton(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b, std::span<Contact> contacts,
              Eigen::Ref<Vector> r);
  double projections(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b, std::span<Contact> contacts,
                     const Eigen::Ref<const Vector>& r, bool jacobian);
  void sweep(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b, std::span<const Contact> contacts,
             Eigen::Ref<Vector> r) const;

  bool solve_alone(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b, Contact& contact,
                   Eigen::Ref<Vector> r) const;
  bool has_dependent_normals(const Eigen::Ref<const Matrix>& G, std::span<const Contact> contacts);
  LcpStatus lcp(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q, Eigen::Ref<Vector> z) {
    return is_redundant_ ? lemke_.solve_smallest(M, q, z) : lemke_.solve(M, q, z);
  }

  int most_contacts_ = 0, most_tangents_ = 0;
  FrictionPolygon polygon_;
  int facets_in_space_ = 0;
  LemkeSolver lemke_;
  bool is_redundant_ = false;
  double rounding_ = 0;  // of r
  Matrix normals_;
  Matrix M_, directions_, effects_;  // LCP matrix; D, facet directions in terms of (n, t) columns; G D
  Vector q_, z_, w_, residual_, step_, trial_;
  Matrix jacobian_;
};

}  // namespace ricochet
