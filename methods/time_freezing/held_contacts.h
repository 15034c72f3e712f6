#pragma once

#include <span>
#include <vector>

#include "methods/time_freezing/regions.h"

namespace ricochet {

/// A contact that a force holds: a bilateral constraint, or a contact that slides, is pushed or bounces.
struct HeldContact {
  int contact = -1;
  int row = 0;  ///< of its first unknown and equation among those of all held contacts
  bool is_bilateral = false;
};

/// The regions of the contacts in an element, and the unknowns and equations that they make at each stage:
///
///   x_j = (w_j, s_j, of every held contact beta_j and, where it sticks, n_t components of tau_j)
///
/// While the clock runs the length h of the element is one more unknown, the last.
class HeldContacts {
 public:
  HeldContacts(const ProblemInfo& info, int n_s);

  /// @return whether the equations differ from before; a turning slip direction does not change them
  bool set(const Regions& regions);

  std::span<const HeldContact> all() const { return held_; }
  const ContactRegion& region(const HeldContact& held) const { return regions_.of[held.contact]; }
  bool is_frozen() const { return regions_.is_frozen; }
  /// Whether J_n' v = 0 holds for the contact.
  bool slides(const HeldContact& held) const { return held.is_bilateral || region(held).region == Region::sliding; }
  bool bounces(const HeldContact& held) const { return !held.is_bilateral && region(held).region == Region::bouncing; }

  int n_rows() const { return n_rows_; }                   ///< unknowns of held contacts, per stage
  int n_stage() const { return info_.n_q + 1 + n_rows_; }  ///< unknowns per stage
  int n_unknowns() const { return n_s_ * n_stage() + (is_frozen() ? 0 : 1); }
  int row_of(const HeldContact& held) const { return info_.n_q + 1 + held.row; }  ///< among the equations of a stage
  bool has_curved() const { return has_curved_; }                                 ///< a held contact is curved
  bool has_friction() const { return has_friction_; }                             ///< a held contact has friction

 private:
  bool has_equations_of(const Regions& regions) const;

  const ProblemInfo& info_;
  const int n_s_;
  Regions regions_;
  std::vector<HeldContact> held_;
  int n_rows_ = 0;
  bool is_set_ = false, has_curved_ = false, has_friction_ = false;
};

}  // namespace ricochet
