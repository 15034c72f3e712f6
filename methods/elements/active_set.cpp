#include "methods/elements/active_set.h"

namespace ricochet {

ActiveSet::ActiveSet(const ProblemInfo& info, const FrictionPolygon& polygon, int n_s)
    : info_(info),
      polygon_(polygon),
      n_s_(n_s),
      n_coordinates_(info.n_q),
      modes_(info.contacts.size(), ContactMode::open) {}

bool ActiveSet::set(const std::vector<ContactMode>& modes, const std::vector<int>& facets) {
  if (modes == modes_ && facets == facets_) return false;
  modes_ = modes;
  facets_ = facets;
  closed_.clear();
  contacts_.clear();
  row_power_.clear();
  n_entries_ = 0;
  has_friction_ = has_curved_ = turns_ = false;
  for (std::size_t i = 0; i < modes.size(); ++i) {
    if (modes[i] == ContactMode::open) continue;
    const auto& contact = info_.contacts[i];
    contacts_.push_back(static_cast<int>(i));
    const bool turns = modes[i] == ContactMode::slip;  // (7c)
    const TangentialLaw law = polygon_.law(modes[i], contact.n_t, facets.empty() ? 0 : facets[i]);
    closed_.push_back({.contact = static_cast<int>(i),
                       .mode = modes[i],
                       .facet = facets.empty() ? 0 : facets[i],
                       .row = n_rows(),
                       .n_rows = 1 + (turns ? contact.n_t : law.n_held),
                       .entry = n_entries_,
                       .law = law});
    n_entries_ += closed_.back().n_rows * static_cast<int>(contact.support.size());
    row_power_.push_back(2);
    for (int d = 1; d < closed_.back().n_rows; ++d) row_power_.push_back(turns ? 0 : 1);
    has_friction_ = has_friction_ || contact.n_t > 0;
    has_curved_ = has_curved_ || !contact.is_affine;
    turns_ = turns_ || turns;
  }
  return true;
}

const ActiveContact& ActiveSet::of(int contact) const {
  return *std::ranges::find(closed_, contact, &ActiveContact::contact);
}

}  // namespace ricochet
