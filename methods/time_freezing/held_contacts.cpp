#include "methods/time_freezing/held_contacts.h"

namespace ricochet {

HeldContacts::HeldContacts(const ProblemInfo& info, int n_s) : info_(info), n_s_(n_s) {
  regions_.of.resize(info.contacts.size());
}

bool HeldContacts::has_equations_of(const Regions& regions) const {
  if (regions.is_frozen != regions_.is_frozen) return false;
  for (std::size_t i = 0; i < regions.of.size(); ++i) {
    const ContactRegion &a = regions.of[i], &b = regions_.of[i];
    if (a.region != b.region || a.sticks != b.sticks || a.turns != b.turns) return false;
    if (!a.turns && a.direction != b.direction) return false;
  }
  return true;
}

bool HeldContacts::set(const Regions& regions) {
  const bool is_known = is_set_ && has_equations_of(regions);
  regions_ = regions;
  if (is_known) return false;
  is_set_ = true;
  held_.clear();
  n_rows_ = 0;
  has_curved_ = has_friction_ = false;
  for (int i = 0; i < info_.n_c(); ++i) {
    const ContactInfo& contact = info_.contacts[i];
    if (!contact.is_bilateral && !regions.of[i].is_held()) continue;
    held_.push_back({i, n_rows_, contact.is_bilateral});
    n_rows_ += 1 + (regions.of[i].sticks ? contact.n_t : 0);
    has_curved_ = has_curved_ || !contact.is_affine;
    has_friction_ = has_friction_ || contact.n_t > 0;
  }
  return true;
}

}  // namespace ricochet
