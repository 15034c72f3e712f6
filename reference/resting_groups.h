#pragma once

#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"
#include "reference/contact_laws.h"
#include "reference/scales.h"

namespace ricochet::reference {

/// Groups of contacts that come to rest together, by infinitely many impacts in a finite time. Between the impacts event
/// location ends at flights of the height
///
///   delta_i = tolerance * (size of the gap),   at least its rounding                     (1)
///   v_i = sqrt(2 A delta_i),   A the largest |J_n|' |a| of contacts with such gaps, a by the load      (2)
///
/// A contact is slow if gap_i <= delta_i and |r_i| <= v_i, r_i = J_n^i' v. A group consists of slow and of closed contacts,
/// without friction, that impulses of the others move, with at least two that are open. Let lambda >= 0 be its forces with
/// all gaps kept at zero, P the contacts with lambda > 0, G = N' M^-1 N with the normals N of P, and s_i = sqrt(G_ii).
/// They are closed together if
///
///   r_i^2 <= 2 lambda_i G_ii delta_i    each of them would fall back from no more than delta     (3)
///
/// If all contacts of P are at rest after the impacts, v+ = v + M^-1 N Lambda with Lambda >= 0 and N' v+ = 0. Therefore v+
/// is the projection of v on N' v = 0 in the norm of M, whatever the order of the impacts and their restitution,
///
///   Lambda = -G^-1 r,   q+ = q - M^-1 N G^-1 gap                                         (4)
///
/// Normals of bodies that wedge each other nearly depend on each other, and (4) divides by their angle. (4) is refused if
///
///   r' G^-1 r > 10 n^2 sum_i (r_i / s_i)^2,   the same for gaps                          (5)
///   the least eigenvalue of G_ij / (s_i s_j) is below 10 tolerance                       (6)
///
/// For a chain of n equal bodies between walls the ratio in (5) is at most n^2 / 2; for a wedge of inclination s it is
/// about 1 / s^2. In (6) s is so small that the normals turn by s while the gaps change by delta. The impacts of such
/// a wedge lose their meaning with its gaps. Its open contacts may sink by delta instead, and the body passes between
/// the others.
class RestingGroups {
 public:
  /// All references must outlive this object. @param tolerance  of the integration
  RestingGroups(const Problem& problem, const Scales& scales, const ContactLaws& laws, double tolerance)
      : problem_(problem), scales_(scales), laws_(laws), tolerance_(tolerance) {}

  struct Rest {
    std::vector<int> contacts;  ///< closed by (4)
    std::vector<int> wedged;    ///< open contacts of groups that (5) or (6) refuses
    Vector q, v;                ///< after (4)
    Vector impulse;             ///< n_c; negative where a separating rate is removed [N s]
  };

  /// (4) for all groups in which an open contact approaches. @param modes  of all contacts
  Rest find(const Vector& q, const Vector& v, const std::vector<ContactMode>& modes) const;

  /// For each contact, `factor` v_i if it is open, its gap is at most delta, and its rate at most that; else 0 [m/s]
  Vector slow(const Vector& q, const Vector& v, const std::vector<ContactMode>& modes, double factor = 1) const;

  /// Whether the change of positions q to q_plus, which closes the gaps of these contacts, satisfies (5).
  bool explains(const std::vector<int>& contacts, const Vector& q, const Vector& q_plus) const;

  /// delta of (1) [m]
  Vector heights(const Vector& q) const;

 private:
  /// The contacts near each other, with the matrices of their laws.
  struct Near {
    std::vector<int> contacts;
    std::vector<char> is_open;  // by contact of these
    Matrix J, MJ, G;
    Vector gap, rate, height, a;  // of these; a: of the gaps, by the load
    Vector speed;                 // of these, (2)
    std::vector<std::vector<Eigen::Index>> groups;
  };
  Near near(const Vector& q, const Vector& v, const std::vector<ContactMode>& modes, double factor) const;
  std::vector<Eigen::Index> acting(const Near& near, const std::vector<Eigen::Index>& group, const Vector& b,
                                   Vector* lambda = nullptr) const;
  bool holds(const Near& near, const std::vector<Eigen::Index>& P, Matrix* solved = nullptr) const;
  void close(const Near& near, std::vector<Eigen::Index> group, Rest& rest) const;

  const Problem& problem_;
  const Scales& scales_;
  const ContactLaws& laws_;
  const double tolerance_;
};

}  // namespace ricochet::reference
