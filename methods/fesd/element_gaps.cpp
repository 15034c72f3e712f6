#include "methods/fesd/element_gaps.h"

#include <algorithm>
#include <cmath>

#include "methods/contact_laws/sunk_closing.h"

namespace ricochet {
namespace {

constexpr double kOfFirstStage = 0.01;  // of the gap there, that q(s) may be wrong by before it

}  // namespace

ElementGaps::ElementGaps(const Problem& problem, const ButcherTableau& tableau, const ContactScales& scales)
    : problem_(problem),
      scales_(scales),
      path_(tableau),
      search_(problem, path_.degree()),
      is_set_(static_cast<std::size_t>(problem.n_q()), 0),
      J_n_(Vector::Zero(problem.info().n_normal_entries)) {}

/// Sets the paths of the coordinates that gaps of open contacts depend on.
void ElementGaps::set_path(const Element& stages) {
  const auto& info = problem_.info();
  std::ranges::fill(is_set_, 0);
  for (const int i : info.unilateral) {
    if (is_closed(stages.modes[static_cast<std::size_t>(i)])) continue;
    for (const int k : info.contacts[static_cast<std::size_t>(i)].support) {
      if (is_set_[static_cast<std::size_t>(k)]) continue;
      is_set_[static_cast<std::size_t>(k)] = 1;
      path_.set_position(stages, k, search_.path());
    }
  }
}

Violation ElementGaps::check(const Element& stages, std::span<const int> unloaded, std::span<const char> sinks) {
  Violation first;
  const auto& info = problem_.info();
  const auto is_open = [&](int i) { return !is_closed(stages.modes[static_cast<std::size_t>(i)]); };
  if (std::ranges::none_of(info.unilateral, is_open)) return first;
  set_path(stages);
  search_.begin(stages.modes);
  if (!unloaded.empty()) problem_.normal_jacobian(stages.q0.data(), J_n_.data());
  for (const int i : info.unilateral) {
    if (!is_open(i)) continue;
    double touching = std::max(scales_.touching(i), -2 * search_.left_gap(i));
    if (std::ranges::find(unloaded, i) != unloaded.end())
      touching += ContactScales::of_positions(info.contacts[static_cast<std::size_t>(i)], J_n_.data(), stages.q0);
    GapSearch::Allowance allowed{.gap = touching, .rounding = touching};
    if (search_.left_gap(i) <= scales_.nearly_touching(i)) {
      allowed.until = path_.first_point();
      allowed.square = path_.nodes() * search_.begin_error(i);
      allowed.most = kOfFirstStage * search_.gap(i, path_.first_point());
    }
    const bool may_sink = !sinks.empty() && sinks[static_cast<std::size_t>(i)] != 0;
    SunkClosing closing;
    if (may_sink) {
      closing = find_sunk_closing(search_, i, scales_.capture_height(i), search_.left_gap(i), scales_.touching(i),
                                  scales_.touching(i));
    } else {
      closing.piece = search_.first_closing(i, allowed);
      if (closing) closing.theta = search_.zero(i, closing.piece);
    }
    const double time = closing.theta * stages.h;
    if (!closing || (first && time >= first.time)) continue;
    first = {.kind = Violation::Kind::past_switch,
             .passed = SwitchKind::gap_closes,
             .contact = i,
             .time = time,
             .value = search_.gap(i, closing.piece.to),
             .level = closing.level};
  }
  return first;
}

}  // namespace ricochet
