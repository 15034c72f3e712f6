#pragma once

#include <span>
#include <vector>

#include "methods/contact_laws/contact_operator.h"
#include "methods/contact_laws/contact_prediction.h"
#include "methods/contact_laws/contact_scales.h"
#include "methods/contact_laws/delassus.h"
#include "methods/contact_laws/friction_problem.h"
#include "methods/contact_laws/mass_inverse.h"
#include "methods/linear_algebra/islands.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// The laws of one instant for the contacts that touch, if the scene states no other law of impacts than Newton's:
///
///   M(q) (v+ - v-) = sum_i (J_n^i Lambda_n^i + J_t^i Lambda_t^i)                        (1)
///   0 <= Lambda_n^i  _|_  J_n^i' (v+ + eps_r^i v-) >= 0,   f_c^i(q) = 0                 (2)
///   Coulomb's law for Lambda_t^i and the slip velocity J_t^i' v+                        (3)
///
/// Source: paper eq. (impulse_eq_comp), with the inequality that keeps contacts without impulse from penetrating
/// (correction 9 in fesd/DIFFERENCES.md); another law of the scene, impact_laws/stated_impact.h, stands in place of (2),
/// (3). The contacts that stay closed afterwards, and their slip, follow from
///
///   M(q) w = f_v + B_u u + sum_i (J_n^i lambda_n^i + J_t^i lambda_t^i)                  (4)
///   0 <= lambda_n^i  _|_  J_n^i' w + v+' (grad^2 f_c^i) v+ >= 0                         (5)
///   lambda_t^i: opposite to J_t^i' v+ where that is not zero, else Coulomb's law with J_t^i' w + (J_t^i)^. ' v+   (6)
///
/// Friction in space may have a polygon in place of the disc (friction_polygon.h): (6) is then a vertex, or the edge
/// that J_t^i' v+ is normal to.
///
/// Both are friction problems (friction_problem.h) with the Delassus matrix of contact_operator.h. They split into
/// islands of contacts that move each other, which are solved separately: an impact affects only its island. In an
/// island of many contacts the modes are predicted first (contact_prediction.h). Bilateral constraints are eliminated
/// (bilateral_constraints.h): P M^-1 stands for M^-1, and their impulses and forces follow; then all contacts are one
/// island.
class ImpactSolver {
 public:
  /// @param scales  sizes for rounding errors; read at every call
  ImpactSolver(const Problem& problem, const FrictionPolygon& polygon, const ContactScales& scales, Counters& counters);

  /// Evaluates M, J_n and J_t at q for the unilateral contacts in `touching` and the bilateral ones. False when M(q) is
  /// not positive definite, or bilateral constraints depend on each other.
  bool prepare(const Vector& q, std::span<const int> touching);

  /// Takes out of `contacts`, which are among those of prepare(), the islands without any of `some` of them. Both ascend.
  void keep_islands_of(std::span<const int> some, std::vector<int>& contacts);

  /// Restitution in (2): that of the scene, or eps_r = 0 for all contacts.
  enum class Rebound : std::uint8_t { of_scene, none };

  /// (1)-(3). @param together  contacts of the impact, ascending, among those of prepare()
  /// @param approaching  those of them that need an impulse: islands without one get none
  /// @param v  v- in, v+ out; @param Lambda_n  n_c, @param Lambda_t  n_lambda_t, written for the contacts of the other
  /// islands and bilateral constraints only
  LcpStatus impact(std::span<const int> together, std::span<const int> approaching, Eigen::Ref<Vector> v,
                   Eigen::Ref<Vector> Lambda_n, Eigen::Ref<Vector> Lambda_t, Rebound rebound = Rebound::of_scene);

  /// sum_i |M^-1 J_n^i| Lambda_n^i + |M^-1 J_t^i| |Lambda_t^i|, the velocities that cancel in (1), n_q: a much smaller
  /// velocity after the impact may be their rounding. @param together  as of impact()
  const Vector& impulse_size(std::span<const int> together, const Eigen::Ref<const Vector>& Lambda_n,
                             const Eigen::Ref<const Vector>& Lambda_t);

  /// A closed contact, for contact_forces().
  struct ClosedContact {
    int contact = -1;
    bool slides = false;                   ///< its slip direction is known
    double direction[2]{1, 0};             ///< of slip; on a polygon minus the vertex of the force
    bool is_on_edge = false;               ///< on a polygon: it slips normal to edge `facet`
    int facet = 0;                         ///< on a polygon: vertex or edge; out: of `mode`
    ContactMode mode = ContactMode::open;  ///< out
  };

  /// (4)-(6) for a subset of the touching contacts. @param lambda_n  n_c, @param lambda_t  n_lambda_t, written for
  /// them and the bilateral ones. acceleration() holds w afterwards.
  LcpStatus contact_forces(const Vector& q, const Vector& v, std::span<ClosedContact> closed,
                           Eigen::Ref<Vector> lambda_n, Eigen::Ref<Vector> lambda_t);
  const Vector& acceleration() const { return w_; }
  /// Decides about contacts that the load at (q, v) neither presses together nor pulls apart, as contact_forces() has
  /// just found, by the load of the next moment, (q + dt v, v + dt w), whatever the order of its first nonzero
  /// derivative. Sets their modes, and their forces to those of the next moment; those of the other contacts stay.
  void decide_unloaded(const Vector& q, const Vector& v, std::span<ClosedContact> closed, Eigen::Ref<Vector> lambda_n,
                       Eigen::Ref<Vector> lambda_t);
  /// |J_n|' |w| of a closed contact with w of the load alone, plus the term of the curvature of the gap [m/s^2];
  /// after contact_forces().
  double load_size(int contact) const { return load_size_[contact]; }
  /// Whether the load and the forces pull a closed contact apart; after contact_forces(). Bodies that fall together
  /// need no force, and still touch.
  bool is_pulled_apart(int contact) const {
    return gap_acceleration(contact) > ContactScales::kStageRounding * load_size_[contact];
  }
  /// Gap acceleration of a closed contact under the load and the contact forces [m/s^2]; after contact_forces().
  double gap_acceleration(int contact) const { return operator_.dot(contact, 0, w_) + bias_[contact]; }
  /// M^-1 f_v at (q, v), without contact forces.
  const Vector& free_acceleration(const Vector& q, const Vector& v);

  /// Diagonal Delassus entry of a touching contact that slides along `direction` (n_t):
  /// J_n' M^-1 (J_n - mu J_t d). Not positive in Painleve's region.
  double sliding_delassus(int contact, const double* direction) const;

  /// Diagonal Delassus entry J_n' M^-1 J_n of a touching contact.
  double normal_delassus(int contact) const { return operator_.own_delassus(contact, 0, 0); }
  /// The largest J_t' M^-1 J_t of its tangents.
  double tangential_delassus(int contact) const;

  const ContactInfo& contact(int i) const { return problem_.info().contacts[i]; }
  /// J_n of a touching contact, packed.
  const double* normal(int contact) const { return operator_.column(contact, 0); }
  /// J_n^i' v of a touching contact.
  double normal_velocity(int contact, const Eigen::Ref<const Vector>& v) const { return operator_.dot(contact, 0, v); }
  /// sum_k |J_n,k^i v_k|, the scale of the rounding error of a normal velocity.
  double normal_velocity_scale(int contact, const Eigen::Ref<const Vector>& v) const {
    return operator_.terms(contact, 0, v);
  }
  /// J_t^i' v of a touching contact, n_t components.
  void slip_velocity(int contact, const Eigen::Ref<const Vector>& v, double* v_t) const;
  /// Sets the direction of sliding to that of the slip at velocity v, if this is larger than `rounding`; on a polygon,
  /// normal to an edge if the component along the edge is not larger.
  void set_slide(ClosedContact& closed, const Eigen::Ref<const Vector>& v, double rounding) const;
  /// Lets the contact slide with the force at a vertex of the polygon, or normal to an edge.
  void set_vertex(ClosedContact& closed, int vertex) const;
  void set_edge(ClosedContact& closed, int edge) const;
  double slip_velocity_scale(int contact, const Eigen::Ref<const Vector>& v) const;

 private:
  int n_t(int contact) const { return problem_.info().contacts[contact].n_t; }
  void set_contacts_of(int island);
  LcpStatus solve_island(double rounding);
  LcpStatus solve_stated(const Eigen::Ref<const Vector>& v);
  void push(Eigen::Ref<Vector> motion, Eigen::Ref<Vector> normal) const;
  bool has_residual(const Eigen::Ref<const Vector>& v) const;
  void refine(Eigen::Ref<Vector> v, Eigen::Ref<Vector> Lambda_n);
  double residual(int k, int row, int d, const Eigen::Ref<const Vector>& v) const;

  const Problem& problem_;
  const FrictionPolygon polygon_;
  const ContactScales& scales_;
  Counters& counters_;
  const bool has_bilateral_;
  MassInverse mass_inverse_;
  ContactOperator operator_;
  Vector f_, w_, size_, bias_, load_size_, b_, r_;
  Vector eps_r_;  // n_c, of the impact at hand
  Matrix T_;
  bool has_turning_friction_ = false;  // some tangents depend on q

  /// Scratch of decide_unloaded().
  struct NextMoment {
    std::vector<char> is_unloaded;
    std::vector<ClosedContact> closed;
    Vector q, v, lambda_n, lambda_t;
    Vector w, bias, load_size;  // of the moment before
  } next_moment_;

  std::vector<int> contacts_;            // of the problem at hand
  Islands islands_;                      // of their numbers
  std::vector<char> has_some_;           // per island
  std::vector<int> contacts_of_island_;  // of the island at hand
  Delassus delassus_;
  Matrix G_;
  std::vector<FrictionProblem::Contact> laws_;
  FrictionProblem friction_;
  ContactPrediction prediction_;
};

}  // namespace ricochet
