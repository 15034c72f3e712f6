#include "problems/derivatives/varying_friction.h"

#include <utility>

namespace ricochet {

SymbolicModel with_varying_friction(SymbolicModel model) {
  for (auto& contact : model.contacts) {
    if (!contact.mu_varies) continue;
    const GiNaC::ex mu = std::exchange(contact.mu, 1);
    for (auto& direction : contact.tangents) {
      for (GiNaC::ex& entry : direction) entry *= mu;
    }
    for (GiNaC::ex& drive : contact.drives) drive *= mu;
  }
  return model;
}

}  // namespace ricochet
