#pragma once

#include <array>
#include <vector>

#include "methods/contact_laws/contact_operator.h"
#include "methods/contact_laws/mass_inverse.h"
#include "methods/time_stepping/common/fixed_step_run.h"

namespace ricochet {

/// Contacts as game engines treat them: one after the other, each with its own block of the Delassus matrix only, and
/// bilateral constraints as contacts among the others that may pull.
class SequentialContacts {
 public:
  explicit SequentialContacts(FixedStepRun& run);

  /// The contacts of a step from (q, v): constraints, then the unilateral contacts that can close in it,
  ///
  ///   f_c(q) <= 2 h |J_n|' (|v| + |dv|),                                                   (1)
  ///
  /// so that the terms of the gap's rate have to double before one is missed, for that step. With the associated law,
  /// under which slip opens a gap, mu |J_t|' (|v| + |dv|) is added to the rate. @param dv  h M^-1 f
  void choose(const Vector& q, const Vector& v, const Vector& dv, double h, FrictionLaw law = FrictionLaw::coulomb);
  /// M^-1 at q. @return false, and the run fails, when M is singular
  bool set_mass(const Vector& q);
  /// M^-1, and J_n, J_t and the blocks of the chosen contacts, at q.
  bool set_position(const Vector& q);

  /// The chosen contacts.
  const std::vector<int>& list() const { return list_; }
  bool is_chosen(int contact) const { return is_chosen_[contact] != 0; }
  int n_t(int contact) const { return info_.contacts[contact].n_t; }

  double normal_velocity(int contact, const Vector& v) const { return operator_.dot(contact, 0, v); }
  /// J_t' v; the second is 0 in the plane.
  std::array<double, 2> slip(int contact, const Vector& v) const {
    return {operator_.dot(contact, 1, v), n_t(contact) == 2 ? operator_.dot(contact, 2, v) : 0};
  }
  /// 1 / (J_n' M^-1 J_n), the effective mass of the contact.
  double mass(int contact) const { return blocks_[contact].mass; }
  /// (J_t' M^-1 J_t)^-1 w: the impulse that changes the slip by w.
  std::array<double, 2> slip_impulse(int contact, const std::array<double, 2>& w) const {
    const Block& b = blocks_[contact];
    return {b.tangent[0] * w[0] + b.tangent[1] * w[1], b.tangent[1] * w[0] + b.tangent[2] * w[1]};
  }
  /// Trace of the block of the Delassus matrix, per direction.
  double mean_delassus(int contact) const { return blocks_[contact].mean_delassus; }

  /// v += M^-1 J_n r
  void push(int contact, double r, Vector& v) { operator_.push(contact, 0, r, v, none_); }
  /// v += M^-1 J_t r
  void push_tangent(int contact, const std::array<double, 2>& r, Vector& v) {
    for (int d = 0; d < n_t(contact); ++d) operator_.push(contact, 1 + d, r[d], v, none_);
  }
  /// h M^-1 f(q, v), with M of the last set_mass() or set_position().
  const Vector& free_change(const Vector& q, const Vector& v, double h);
  const ContactOperator& directions() const { return operator_; }

 private:
  struct Block {
    double mass = 0, tangent[3]{0, 0, 0}, mean_delassus = 0;
  };
  void set_block(int contact);

  FixedStepRun& run_;
  const ProblemInfo& info_;
  const bool is_constant_;  // neither M nor a direction depends on q
  MassInverse mass_;
  ContactOperator operator_;
  bool has_directions_ = false, has_blocks_ = false;
  std::vector<int> list_, last_;
  std::vector<char> is_chosen_;
  std::vector<Block> blocks_;
  Vector gap_, change_, none_;
};

/// Coulomb's disc: the impulse nearest to r within it, where slip has one mass. @param radius  mu times the normal impulse
inline std::array<double, 2> in_disc(const std::array<double, 2>& r, double radius) {
  const double size = std::hypot(r[0], r[1]);
  if (size <= radius) return r;
  return {r[0] * (radius / size), r[1] * (radius / size)};
}

}  // namespace ricochet
