#pragma once

#include <vector>

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
class PointVariation {
 public:
  /// @param varied  must outlive this object
  explicit PointVariation(const VariedProblem& varied);

  /// Linear equations in the variations of q and v, of the unknowns x of the point and of theta.
  struct Rows {
    Matrix q, v, x, theta;
    void reset(Eigen::Index n, Eigen::Index n_q, Eigen::Index n_columns);
  };
  /// The unknowns: n_q of the motion, then the forces of each contact that acts, the normal one first.
  struct Numbering {
    Numbering(const ProblemInfo& info, const auto& acts) : size(info.n_q) {
      for (int i = 0; i < info.n_c(); ++i) {
        if (!acts(i)) continue;
        contacts.push_back({i, size});
        size += 1 + info.contacts[i].n_t;
      }
    }
    struct Contact {
      int contact;
      Eigen::Index row;  ///< of its normal force, and of its first equation
    };
    std::vector<Contact> contacts;
    Eigen::Index size;
  };
  /// Numbering of the contacts that are not open.
  static Numbering numbering(const ProblemInfo& info, const std::vector<ContactMode>& modes) {
    return {info, [&](int i) { return is_closed(modes[static_cast<std::size_t>(i)]); }};
  }
  /// How a contact that carries a force obeys Coulomb.
  struct Friction {
    bool sticks = false;
    Vector direction{};  ///< n_t, of slip
    Matrix turn{};       ///< n_t x n_t, mu lambda_n times the derivative of the direction by s
    Matrix turned{};     ///< n_t x columns, variation of a direction that does not follow s; empty for none
  };
  /// The motion at a point.
  struct Motion {
    const Vector &q, &v, &a, &lambda_n, &lambda_t;
  };
  struct Impulse {
    const Vector &q, &v_minus, &v_plus, &Lambda_n, &Lambda_t;
  };

  /// Slip. @param sign  of it in the plane, 0 in space; @param start  direction of slip in space while s is zero
  Friction slip(int contact, const Vector& s, double lambda_n, int sign, const Vector& start) const;
  Vector slip_velocity(int contact, const Vector& q, const Vector& v) const;

  /// d f_c: n_c x columns.
  Matrix gaps(const Vector& q, const Matrix& dq) const;
  /// d s: n_lambda_t x columns.
  Matrix slip_velocities(const Vector& q, const Vector& v, const Matrix& dq, const Matrix& dv) const;
  /// Moves dq to where df_c of the closed contacts vanishes, and dv to where d(J_n' v), and ds of those that stick, do;
  /// least in the metric of M.
  void project(const std::vector<ContactMode>& modes, const Vector& q, const Vector& v, Matrix& dq, Matrix& dv) const;

  /// (3), with the accelerations as the first unknowns. @param direct  VariedProblem::rows() of the point
  void set_motion(const Numbering& numbering, const Motion& at, const Matrix& direct, Rows& rows) const;
  /// (5) of velocities, with ds = 0 where it sticks, at rows of its own.
  /// @param column  of lambda_n among the unknowns; lambda_t follows
  void add_friction(int contact, const Friction& friction, const Vector& q, const Vector& v, double lambda_n,
                    const Matrix& direct, Eigen::Index column, Eigen::Index row, Rows& rows) const;
  /// forces += weight times the forces among the unknowns. @param forces  n_c, then n_lambda_t, rows
  void add_forces(const Numbering& numbering, const Eigen::Ref<const Matrix>& unknowns, double weight,
                  Eigen::Ref<Matrix> forces) const;

  /// d[ mu lambda_n - ||lambda_t|| ] of a contact. @param lambda_t  its own, n_t; @param forces  n_c, then n_lambda_t,
  /// rows, varied
  Eigen::RowVectorXd cone_margin(int contact, double lambda_n, const Vector& lambda_t, const Matrix& forces) const;

  /// (1), (2), (5) solved for dv+. @param acts  contacts with (2); @param restitutes  whether eps_r counts
  /// @param laws  one per contact of `acts`, of those with tangents
  /// @param dq, dv  n_q x n_theta, or one column more; dv out: after the impulse
  void through_impulse(const Numbering& acts, const Impulse& impulse, bool restitutes,
                       const std::vector<Friction>& laws, const Matrix& dq, Matrix& dv) const;
  /// Solves (1), (2), (5) for an impact, with the contacts that press.
  void through_impact(const Impulse& impulse, const Matrix& dq, Matrix& dv) const;

  /// (3)-(5) solved for da and the forces: closed.size x columns. @param direct  VariedProblem::rows() of the point
  /// @param laws  as above; @param h  [s], a time in which the motion changes little
  Matrix accelerations(const Numbering& closed, const Motion& at, const Matrix& direct,
                       const std::vector<Friction>& laws, double h, const Matrix& dq, const Matrix& dv) const;

 private:
  void add_force_columns(const Numbering& numbering, const Vector& q, Rows& rows) const;
  Matrix direct_of_velocities(const Vector& q, const Vector& v) const;
  Matrix bias_derivative(const Motion& at, double h, const Matrix& dq, const Matrix& dv) const;

  const VariedProblem& varied_;
  const Problem& problem_;
  const int n_q_, n_c_, n_t_;
};

}  // namespace ricochet
