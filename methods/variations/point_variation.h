#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "methods/linear_algebra/rank_revealing.h"
#include "methods/variations/varied_problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Variations of what happens at one point (q, v) of the motion, by the implicit function theorem on its equations.
/// Below, d is d/dtheta, one column per theta, and every function also depends on theta directly. An impulse, from dv-
/// to dv+:
///
///   d[ M (v+ - v-) - J_n Lambda_n - J_t Lambda_t ] = 0                                  (1)
///   d[ J_n^i' (v+ + eps_r^i v-) ] = 0,   Lambda_n^i > 0 or i bilateral                  (2)
///   with d(eps_r r) = (eps_r - r eps_r'(-r)) dr + r d_theta eps_r where eps_r(-r) depends on r = J_n' v-
///
/// The motion, with the contacts that are closed held by their gaps twice differentiated:
///
///   d[ M a - f_v - B_u u - J_n lambda_n - J_t lambda_t ] = 0                            (3)
///   d[ J_n^i' a + v' (grad^2 f_c^i) v ] = 0,   i closed                                 (4)
///
/// Friction of a contact with slip velocity s = J_t' v (v+ in (1)) and forces lambda_n, lambda_t (in (1) Lambda_n,
/// Lambda_t):
///
///   stick   ds = 0,   in the motion d[ J_t' a + T v ] = 0                               (5a)
///   slip    d[ lambda_t + mu lambda_n s / ||s|| ] = 0; in the plane s / ||s|| is a constant sign     (5b)
///
/// Derivatives of v' (grad^2 f_c) v and T v, third ones of a gap, are differences of fourth order along the variations.
/// Functions share scratch storage, so that an object belongs to one thread; what they did once with the same sizes they do
/// again without allocations.
class PointVariation {
 public:
  /// @param varied  must outlive this object
  explicit PointVariation(const VariedProblem& varied);

  /// Linear equations in the variations of q and v, of the unknowns x of the point and of theta.
  struct Rows {
    Rows(ScratchPool& pool, Eigen::Index n, Eigen::Index n_q, Eigen::Index n_columns)
        : q(pool.zeros(n, n_q)), v(pool.zeros(n, n_q)), x(pool.zeros(n, n)), theta(pool.zeros(n, n_columns)) {}
    MatrixMap q, v, x, theta;
  };
  /// The unknowns: n_q of the motion, then the forces of each contact that acts, the normal one first.
  struct Numbering {
    Numbering() = default;
    Numbering(const ProblemInfo& info, const auto& acts) { set(info, acts); }
    void set(const ProblemInfo& info, const auto& acts) {
      contacts.clear();
      size = info.n_q;
      for (int i = 0; i < info.n_c(); ++i) {
        if (!acts(i)) continue;
        contacts.push_back({i, size});
        size += 1 + info.contacts[i].n_t;
      }
    }
    /// The contacts that are not open.
    void set(const ProblemInfo& info, const std::vector<ContactMode>& modes) {
      set(info, [&](int i) { return is_closed(modes[static_cast<std::size_t>(i)]); });
    }
    struct Contact {
      int contact;
      Eigen::Index row;  ///< of its normal force, and of its first equation
    };
    std::vector<Contact> contacts;
    Eigen::Index size = 0;
  };
  /// Values in the tangent directions of a contact.
  using Tangent = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 2, 1>;
  using TangentMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 2, 2>;
  /// How a contact that carries a force obeys Coulomb.
  struct Friction {
    bool sticks = false;
    Tangent direction{};   ///< n_t, of slip
    TangentMatrix turn{};  ///< n_t x n_t, mu lambda_n times the derivative of the direction by s
    Matrix turned{};       ///< n_t x columns, variation of a direction that does not follow s; empty for none
  };
  struct Impulse {
    Eigen::Ref<const Vector> q, v_minus, v_plus, Lambda_n, Lambda_t;
  };
  /// Directions of all contacts at a state, as they act on rates and on forces.
  struct Jacobians {
    MatrixMap J_n, J_t;  ///< n_q x n_c, n_q x n_lambda_t
    MatrixMap T;         ///< n_lambda_t x n_q, derivative of the slip velocities by q
  };

  ScratchPool& pool() const { return pool_; }
  /// In the pool. T only with a velocity.
  Jacobians jacobians(const Eigen::Ref<const Vector>& q) const;
  Jacobians jacobians(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& v) const;

  /// Slip with the velocity s. @param sign  of it in the plane, 0 in space; @param start  direction of slip in space while
  /// s is zero
  Friction slip(int contact, const Tangent& s, double lambda_n, int sign, const Eigen::Ref<const Vector>& start) const;
  Tangent slip_velocity(int contact, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& v) const;
  Tangent slip_velocity(int contact, const Jacobians& J, const Eigen::Ref<const Vector>& v) const;

  /// change: n_c x columns, d f_c
  void gaps(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Matrix>& dq, Eigen::Ref<Matrix> change) const;
  /// change: n_lambda_t x columns, d s
  void slip_velocities(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& v,
                       const Eigen::Ref<const Matrix>& dq, const Eigen::Ref<const Matrix>& dv,
                       Eigen::Ref<Matrix> change) const;
  /// Moves dq to where df_c of the closed contacts vanishes, and dv to where d(J_n' v), and ds of those that stick, do;
  /// least in the metric of M.
  void project(const std::vector<ContactMode>& modes, const Eigen::Ref<const Vector>& q,
               const Eigen::Ref<const Vector>& v, Matrix& dq, Matrix& dv) const;
  /// Replaces b by M(q)^-1 b.
  void divide_by_mass(const Eigen::Ref<const Vector>& q, Eigen::Ref<Matrix> b) const;
  /// a: n_q, by (2) of problem.h with these forces
  void acceleration(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& v, const Jacobians& J,
                    const Eigen::Ref<const Vector>& lambda_n, const Eigen::Ref<const Vector>& lambda_t,
                    Eigen::Ref<Vector> a) const;

  /// (3) without its derivatives by theta alone, with the accelerations as the first unknowns.
  void set_motion(const Numbering& numbering, const PointOfMotion& at, const Jacobians& J, Rows& rows) const;
  /// (5) of velocities, with ds = 0 where it sticks, at rows of its own.
  /// @param direct  VariedProblem::rows() of the point, which is not read unless parameters vary
  /// @param column  of lambda_n among the unknowns; lambda_t follows
  void add_friction(int contact, const Friction& friction, const Jacobians& J, double lambda_n,
                    const Eigen::Ref<const Matrix>& direct, Eigen::Index column, Eigen::Index row, Rows& rows) const;
  /// forces += weight times the forces among the unknowns. @param forces  n_c, then n_lambda_t, rows
  void add_forces(const Numbering& numbering, const Eigen::Ref<const Matrix>& unknowns, double weight,
                  Eigen::Ref<Matrix> forces) const;

  /// margin: columns, d[ mu lambda_n - ||lambda_t|| ] of a contact. @param lambda_t  its own, n_t; @param forces  n_c,
  /// then n_lambda_t, rows, varied
  void cone_margin(int contact, double lambda_n, const Eigen::Ref<const Vector>& lambda_t,
                   const Eigen::Ref<const Matrix>& forces, Eigen::Ref<Eigen::RowVectorXd> margin) const;

  /// (1), (2), (5) solved for dv+. @param acts  contacts with (2); @param restitutes  whether eps_r counts
  /// @param laws  one per contact of `acts`, of those with tangents
  /// @param dq, dv  n_q x n_theta, or one column more; dv out: after the impulse
  void through_impulse(const Numbering& acts, const Impulse& impulse, bool restitutes,
                       const std::vector<Friction>& laws, const Eigen::Ref<const Matrix>& dq,
                       Eigen::Ref<Matrix> dv) const;
  /// Solves (1), (2), (5) for an impact, with the contacts that press.
  void through_impact(const Impulse& impulse, const Eigen::Ref<const Matrix>& dq, Eigen::Ref<Matrix> dv) const;

  /// (3)-(5) solved for da and the forces. @param direct  VariedProblem::rows() of the point
  /// @param laws  as above; @param h  [s], a time in which the motion changes little
  /// @param change  out: closed.size x columns
  void accelerations(const Numbering& closed, const PointOfMotion& at, const Eigen::Ref<const Matrix>& direct,
                     const std::vector<Friction>& laws, double h, const Eigen::Ref<const Matrix>& dq,
                     const Eigen::Ref<const Matrix>& dv, Eigen::Ref<Matrix> change) const;

 private:
  void add_force_columns(const Numbering& numbering, const Jacobians& J, Rows& rows) const;
  void add_direct_of_velocities(Eigen::Index row, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& v,
                                Eigen::Ref<Matrix> change) const;
  void direct_of_velocities(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& v,
                            Eigen::Ref<Matrix> direct) const;
  void add_bias_derivative(const PointOfMotion& at, double h, const Eigen::Ref<const Matrix>& dq,
                           const Eigen::Ref<const Matrix>& dv, Eigen::Ref<Matrix> bias) const;

  const VariedProblem& varied_;
  const Problem& problem_;
  const int n_q_, n_c_, n_t_;

  // Scratch.
  mutable ScratchPool pool_;
  mutable Eigen::LLT<Matrix> mass_;
  mutable CompletePivotingLu lu_;
  mutable SemidefiniteInverse delassus_;
  mutable Numbering acts_;
  mutable std::vector<Friction> laws_;
  struct Held {
    int contact, tangent;  // component of s, or -1 for its gap
  };
  mutable std::vector<Held> held_;
};

}  // namespace ricochet
