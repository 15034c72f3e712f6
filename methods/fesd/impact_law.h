#pragma once

#include <Eigen/Cholesky>
#include <span>
#include <vector>

#include "methods/bilateral_constraints.h"
#include "methods/complementarity/friction_problem.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// What happens at one instant to the contacts that touch:
///
///   M(q) (v+ - v-) = sum_i J_n^i Lambda_n^i + J_t^i Lambda_t^i                          (1)
///   0 <= Lambda_n^i  _|_  J_n^i' (v+ + eps_r^i v-) >= 0,   f_c^i(q) = 0                 (2)
///   Coulomb's law for Lambda_t^i and the slip velocity J_t^i' v+                        (3)
///
/// Source: paper eq. (impulse_eq_comp), with the inequality that keeps contacts without impulse from penetrating
/// (correction 9 of the specification). And which of them stay closed afterwards, and whether they slip:
///
///   M(q) w = f_v + B_u u + sum_i J_n^i lambda_n^i + J_t^i lambda_t^i                    (4)
///   0 <= lambda_n^i  _|_  J_n^i' w + v+' (grad^2 f_c^i) v+ >= 0                         (5)
///   lambda_t^i: opposite to J_t^i' v+ where that is not zero, else Coulomb's law with J_t^i' w + (J_t^i)^. ' v+   (6)
///
/// Friction in space may have a polygon in place of the disc (friction_polygon.h): (6) is then a vertex, or the edge
/// that J_t^i' v+ is normal to.
///
/// Both are friction problems (friction_problem.h) with the Delassus matrix G = D' M^-1 D, D = [J_n, J_t]. Bilateral
/// constraints are eliminated (bilateral_constraints.h): P M^-1 stands for M^-1, and their impulses and forces follow.
class ImpactLaw {
 public:
  ImpactLaw(const Problem& problem, const FrictionPolygon& polygon, Counters& counters);

  /// Evaluates M, J_n and J_t at q for the unilateral contacts in `touching` and the bilateral ones. False when M(q) is
  /// not positive definite, or bilateral constraints depend on each other.
  bool prepare(const Vector& q, std::span<const int> touching);

  /// (1)-(3). @param v  v- in, v+ out; @param Lambda_n  n_c, @param Lambda_t  n_lambda_t, written for touching contacts
  /// and bilateral constraints only
  LcpStatus impact(Eigen::Ref<Vector> v, Eigen::Ref<Vector> Lambda_n, Eigen::Ref<Vector> Lambda_t);

  /// A closed contact, for contact_forces().
  struct Closed {
    int contact = -1;
    bool slides = false;                   ///< its slip direction is known
    double direction[2]{1, 0};             ///< of slip; on a polygon minus the vertex of the force
    bool is_on_edge = false;               ///< on a polygon: it slips normal to edge `facet`
    int facet = 0;                         ///< on a polygon: vertex or edge; out: of `mode`
    ContactMode mode = ContactMode::open;  ///< out
  };

  /// (4)-(6) for a subset of the touching contacts. @param lambda_n  n_c, @param lambda_t  n_lambda_t, written for
  /// them and the bilateral ones. acceleration() holds w afterwards.
  LcpStatus contact_forces(const Vector& q, const Vector& v, std::span<Closed> closed, Eigen::Ref<Vector> lambda_n,
                           Eigen::Ref<Vector> lambda_t);
  const Vector& acceleration() const { return w_; }
  /// M^-1 f_v at (q, v), without contact forces.
  const Vector& free_acceleration(const Vector& q, const Vector& v);

  /// Diagonal Delassus entry of a touching contact that slides along `direction` (n_t):
  /// J_n' M^-1 (J_n - mu J_t d). Not positive in Painleve's region.
  double sliding_delassus(int contact, const double* direction) const;

  /// Diagonal Delassus entry J_n' M^-1 J_n of a touching contact.
  double normal_delassus(int contact) const { return D_.col(contact).dot(MD_.col(contact)); }

  /// J_n^i' v of a touching contact.
  double normal_velocity(int contact, const Eigen::Ref<const Vector>& v) const { return D_.col(contact).dot(v); }
  /// sum_k |J_n,k^i v_k|: what rounding of a normal velocity is measured against.
  double normal_velocity_scale(int contact, const Eigen::Ref<const Vector>& v) const {
    return D_.col(contact).cwiseAbs().dot(v.cwiseAbs());
  }
  /// J_t^i' v of a touching contact, n_t components.
  void slip_velocity(int contact, const Eigen::Ref<const Vector>& v, double* v_t) const;
  /// The contact slides the way it slips at velocity v, if its slip velocity is larger than `rounding`; on a polygon
  /// normal to an edge, if what it has along the edge is not.
  void set_slide(Closed& closed, const Eigen::Ref<const Vector>& v, double rounding) const;
  /// The contact slides with the force at a vertex of the polygon, or normal to an edge.
  void set_vertex(Closed& closed, int vertex) const;
  void set_edge(Closed& closed, int edge) const;
  double slip_velocity_scale(int contact, const Eigen::Ref<const Vector>& v) const;

 private:
  int tangent_column(const ContactInfo& contact, int d) const { return problem_.n_c() + contact.tangent_index + d; }
  void delassus();
  void add_contact(int contact);
  void apply(Eigen::Index n, Eigen::Ref<Vector> motion, Eigen::Ref<Vector> normal) const;

  const Problem& problem_;
  const FrictionPolygon polygon_;
  Counters& counters_;
  std::vector<int> touching_;
  Matrix M_, D_, MD_, G_;  // D_, MD_: n_q x (n_c + n_lambda_t), the latter P M^-1 D
  Eigen::LLT<Matrix> llt_;
  const bool has_bilateral_;
  BilateralConstraints bilateral_;
  Matrix reaction_;  // n_c x (n_c + n_lambda_t): of the bilateral constraints to the columns of D
  Vector packed_n_, packed_t_, f_, w_, bias_, b_, r_;
  Matrix T_;
  std::vector<FrictionProblem::Contact> laws_;
  std::vector<int> columns_;  // of D_, in the order of the friction problem
  FrictionProblem friction_;
};

}  // namespace ricochet
