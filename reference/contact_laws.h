#pragma once

#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"
#include "reference/coulomb_law.h"
#include "reference/scales.h"

namespace ricochet::reference {

/// The laws that change the modes of contacts. An impact at touching contacts obeys Newton's and Coulomb's laws for
/// impulses and velocities,
///
///   0 <= Lambda_n _|_ J_n'(v+ + eps_r v-) >= 0,  ||Lambda_t|| <= mu Lambda_n, opposite to J_t' v+      (1)
///
/// or the impact law that the scene states (stated_impact.h). Contacts at rest obey (1) for forces and accelerations.
/// Bilateral constraints are closed in every mode, and their forces may pull. All motions satisfy the bilateral
/// constraints: with their Jacobian G, an impulse p changes v- to v+, and a force p leads to v', by
///
///   [ M  -G ] [ v+ ]   [ M v- + p ]       [ M  -G ] [ v' ]   [ f_v + B_u u + p    ]
///   [ G'  0 ] [ m  ] = [ 0        ],      [ G'  0 ] [ m  ] = [ -v' (grad^2 f_c) v ]       (2)
class ContactLaws {
 public:
  /// @param scales  of the problem; both must outlive this object
  ContactLaws(const Problem& problem, const Scales& scales) : problem_(problem), scales_(scales) {}

  /// Result of a law for the given contacts.
  struct Decision {
    std::string failure;             ///< message, if the law decides nothing; else empty
    FailureReason reason;            ///< of the failure
    std::vector<ContactMode> modes;  ///< in the order of the contacts given
    Vector motion;                   ///< n_q, v_plus or v'
    Vector normal, tangential;       ///< n_c and n_lambda_t, impulses or forces of these contacts, else zero; the
                                     ///< impulses of bilateral constraints, too
  };

  /// Solves (1). @param last  by contact (n_c): whether its restitution counts as zero; empty: for none
  Decision impact(const Vector& q, const Vector& v_minus, const std::vector<int>& touching,
                  const std::vector<char>& last = {}) const;

  /// Modes of candidates, touching with zero normal velocity: (1)-(4) of contact_dynamics.h with
  /// 0 <= lambda_n _|_ gap acceleration >= 0.
  /// @param directions by contact (n_c), the direction of slip if it is known; empty if v_t = 0 and the acceleration
  ///   decides. Not read without friction.
  Decision decide(const Vector& q, const Vector& v, const std::vector<int>& candidates,
                  const std::vector<Vector>& directions) const;

  /// Projects q, so that the gaps of `touching` contacts vanish, and v, so that the rates of `closed` contacts and the
  /// slip velocities of resting ones vanish, in the metric of M. @param resting  by contact
  /// @return false if this fails
  bool project(Vector& q, Vector& v, const std::vector<int>& touching, const std::vector<int>& closed,
               const std::vector<char>& resting) const;

  /// v+ or v' of (2) for the columns p, with no bilateral terms on the right
  Matrix response(const Vector& q, const Matrix& p) const;
  /// v' of (2) for p = 0
  Vector free_acceleration(const Vector& q, const Vector& v) const;

 private:
  std::string names(const std::vector<int>& contacts) const;
  Matrix jacobian(const Vector& q, const std::vector<int>& contacts) const;
  /// Solves (2). @return columns (v+ or v', m)
  Matrix under_constraints(const Vector& q, const Matrix& right_hand_side) const;
  Decision stated_law(const Matrix& J, const Matrix& MJ, const Vector& v_minus, const std::vector<int>& touching,
                      const std::vector<char>& last) const;
  void refine_impact(const Matrix& J, const Matrix& MJ, const Vector& v_minus, const Vector& b,
                     const std::vector<int>& touching, Decision& decision) const;
  void add_bilateral_impulses(const Vector& q, const Vector& v_minus, Decision& decision) const;
  /// Adds the laws of the contacts to the problem. @param directions  by contact, or empty
  Decision coulomb_law(ContactQuestion question, const std::vector<int>& contacts,
                       const std::vector<Vector>& directions) const;

  const Problem& problem_;
  const Scales& scales_;
};

}  // namespace ricochet::reference
