#pragma once

#include <span>
#include <vector>

#include "methods/contact_laws/contact_scales.h"
#include "methods/contact_laws/impact_solver.h"
#include "problems/problem.h"

namespace ricochet {

/// Decides whether a group of contacts is at rest. Bodies that settle together hit each other infinitely often in a
/// finite time, at several contacts S, each time lower. With the height delta = ContactScales::capture_height() the bounces end
/// where
///
///   gap_i <= delta,   |r_i| <= v_low = sqrt(2 |a| delta),   r_i = J_n^i' v                                  (1)
///   r_i^2 <= 2 lambda_i G_ii delta                                                                        (2)
///
/// for all i of S: a the acceleration of the load, lambda the forces of all contacts of S if they are closed, and
/// G = N' M^-1 N, N = (J_n^i). Then all are closed, and q and v are moved to where no gap and no rate is left. What
/// follows is within delta of the motion: if all of S come to rest, v+ is unique (impact_sequence.h (2)).
///
/// Normals may nearly depend on each other: a disc sits between two discs that nearly touch. Small rates r and gaps g
/// then belong to large velocities, and the bodies are not at rest. A change of state (dq, dv) is explained by
/// them if
///
///   dv' M dv <= 16 n^2 sum_i r_i^2 / G_ii,    dq' M dq <= 16 n^2 sum_i g_i^2 / G_ii,     i = 1, .., n       (3)
///
/// For a chain of n equal bodies the largest ratio of both sides is of the order of n^2, for a wedge of inclination s it
/// is 1 / s^2. Forces or impulses that hold bodies in such a wedge are 1 / s times what they do: with W those contacts
/// whose lambda_i |J_n^i| is at least a hundredth of the largest,
///
///   | sum over W of lambda_i J_n^i | < s max_i lambda_i |J_n^i|,   s = clamp(10 sqrt(delta / gap), 1e-3, 0.03)     (4)
///
/// with the size of the gap (contact_scales.h): a round body whose height in a cusp is delta has an inclination of the
/// order of sqrt(delta / radius).
class GroupRest {
 public:
  /// All references must outlive this object. @param law  prepared by its owner
  GroupRest(const Problem& problem, const ContactScales& scales, ImpactSolver& law);

  /// Whether a gap is so far below zero that this is no motion of the scene: open contacts may sink by capture_height(), some
  /// by a few of them.
  static bool is_too_low(const ContactScales& scales, int contact, double gap) {
    return gap < -kSunk * scales.capture_height(contact);
  }
  /// v_low of (1) [m/s]; 0 where nothing is captured. @param contacts  those that may be captured
  double low_speed(const Vector& q, const Eigen::Ref<const Vector>& v, std::span<const int> contacts);
  /// (3) for a velocity that an impact of the group changes from v to v_plus.
  bool is_explained_by_rates(std::span<const int> group, const Vector& q, const Eigen::Ref<const Vector>& v,
                             const Eigen::Ref<const Vector>& v_plus);
  /// (3) for velocities v and v_plus at q. @param of_group  the sum on its right side; @param n  number of its terms
  bool is_explained(const Vector& q, const Eigen::Ref<const Vector>& v, const Eigen::Ref<const Vector>& v_plus,
                    double of_group, std::size_t n);
  /// W of (4) among these contacts, empty where (4) does not hold.
  const std::vector<int>& find_wedge(std::span<const int> contacts, const Vector& lambda_n);
  /// (3) for positions q and q_moved. @param gap  n_c, at q
  bool is_explained_by_gaps(std::span<const int> group, const Vector& gap, const Vector& q, const Vector& q_moved);

 private:
  static constexpr double kSunk = 4;

  bool is_explained(const Vector& q, double of_group, std::size_t n);

  const Problem& problem_;
  const ContactScales& scales_;
  ImpactSolver& law_;
  Vector change_, v_;
  std::vector<int> wedge_;
  Matrix M_;
};

}  // namespace ricochet
