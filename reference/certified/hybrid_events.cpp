#include "reference/certified/hybrid_motion.h"

// The events of a motion: Decisions gives the modes after each.

namespace ricochet::reference::certified {

void HybridMotion::handle(const EventFunction& event) {
  if (event.kind == EventKind::border) {
    reach_border(event.border);
    return;
  }
  const std::string& contact = scene_.contacts[event.contact].name;
  if (sensitivities_) sensitivities_->reach(event, set_.box(), t_);
  switch (event.kind) {
    case EventKind::impact: {
      last_impact_ = event.contact;
      std::vector<Ball> x = set_.box();
      const std::vector<Mode> before = states_.modes;
      const std::vector<int> candidates = coupled_contacts(scene_, before, {event.contact}, p_);
      const ImpactOutcome outcome = decisions_.close_gaps(x, t_, {event.contact}, states_);
      if (sensitivities_) sensitivities_->strike(set_.box(), t_, event.contact, before, candidates, outcome.modes);
      keep_impact(std::move(x), outcome, contact);
      if (leaves_region()) return;
      if (cut_ > 0)
        pass_group_collapse(event.contact);  // a window, which is proven, would be wider than what is taken as zero
      else if (const auto neighbour = neighbour_of(event.contact))
        pass_accumulation_of_two(event.contact, *neighbour);
      else
        pass_accumulation(event.contact, outcome.modes.front());
      break;
    }
    case EventKind::detach:
      decisions_.open_contact(set_.box(), t_, event.contact, states_);
      record("detach", contact);
      break;
    case EventKind::slip_end:
      record(decisions_.end_slip(set_.box(), t_, event, states_), contact);
      break;
    case EventKind::cone:
      decisions_.begin_slip(set_.box(), t_, event, states_);
      record("stick_to_slip", contact);
      break;
    case EventKind::border:
      break;
  }
  begin_motion();
}

void HybridMotion::keep_impact(std::vector<Ball> x, const ImpactOutcome& outcome, const std::string& contact) {
  set_.set_box(std::move(x));
  record("impact", contact, outcome.Lambda_n);
}

}  // namespace ricochet::reference::certified
