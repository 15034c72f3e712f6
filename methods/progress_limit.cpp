#include "methods/progress_limit.h"

#include <fmt/format.h>

#include <algorithm>

namespace ricochet {

std::string ProgressLimit::message(std::span<const ContactMode> modes) const {
  const bool any_slips = std::ranges::any_of(modes, is_slipping);
  std::string names;
  for (std::size_t i = 0; i < modes.size(); ++i) {
    const ContactMode mode = modes[i];
    if (problem_.contacts[i].is_bilateral) continue;
    if (any_slips ? !is_slipping(mode) : !is_closed(mode)) continue;
    names += fmt::format("{}'{}' ({})", names.empty() ? "contact " : ", ", problem_.contacts[i].name, to_string(mode));
  }
  return fmt::format("{} steps move the time by {:.3g} s: it is held up by {}", steps_, moved_,
                     names.empty() ? "the smooth motion" : names);
}

}  // namespace ricochet
