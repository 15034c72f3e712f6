#include "methods/fesd/element_loads.h"

#include <algorithm>
#include <cmath>

#include "methods/contact_laws/falling_zero.h"
#include "problems/packed_column.h"

namespace ricochet {
namespace {

constexpr double kSameTime = 1e-8;  // of an element

}  // namespace

ElementLoads::ElementLoads(const Problem& problem, const ButcherTableau& tableau, const ContactScales& scales)
    : problem_(problem), scales_(scales), path_(tableau), J_t_(Vector::Zero(problem.info().n_tangent_entries)) {
  const ProblemInfo& info = problem.info();
  modes_.reserve(info.contacts.size());
  if ((info.clock >= 0 || info.has_friction()) && info.structure.has_bounds) search_.emplace(problem, path_.degree());
}

/// The functions of the modes of an element.
void ElementLoads::list(const Element& stages) {
  const ProblemInfo& info = problem_.info();
  modes_ = stages.modes;
  search_->set_modes(modes_);
  auto& functions = search_->functions();
  const bool is_on_polygon = std::ranges::any_of(
      modes_, [](ContactMode m) { return m == ContactMode::vertex_slip || m == ContactMode::edge_slip; });
  const bool has_forces =
      !is_on_polygon && search_->depends_on_time() && search_->is_known_at(stages.q0.data(), stages.v0.data());
  for (const int i : info.unilateral) {
    const ContactMode mode = modes_[i];
    if (!is_closed(mode)) continue;
    if (has_forces) functions.push_back({.kind = SwitchKind::force_vanishes, .contact = i});
    if (has_forces && mode == ContactMode::stick) functions.push_back({.kind = SwitchKind::cone_reached, .contact = i});
    if (is_slipping(mode) && mode != ContactMode::vertex_slip && mode != ContactMode::edge_slip)
      functions.push_back({.kind = SwitchKind::slip_stops, .contact = i});
  }
}

double ElementLoads::slack(const LoadSearch::Function& f) const {
  const int i = f.contact;
  if (f.kind == SwitchKind::slip_stops) return std::max(scales_.no_slip(i), tolerance_ * scales_.slip(i));
  const double force = std::max(scales_.no_force(i), tolerance_ * scales_.force(i));
  return f.kind == SwitchKind::cone_reached ? problem_.info().contacts[i].mu * force : force;
}

/// Along the mode in the plane; in space along the slip of the left end, or of where it starts from rest.
void ElementLoads::set_slip(const Element& stages, LoadSearch::Function& slip) {
  const auto& contact = problem_.info().contacts[slip.contact];
  if (contact.n_t == 1) {
    slip.direction[0] = slip_sign(modes_[slip.contact]);
    return;
  }
  const auto start = stages.slip_start.segment(contact.tangent_index, 2);
  const bool is_held = !start.isZero(0);
  for (int d = 0; d < 2; ++d) {
    const double* column =
        J_t_.data() + contact.tangent_begin + d * static_cast<std::ptrdiff_t>(contact.support.size());
    slip.direction[d] = is_held ? start[d] : packed_dot(contact, column, stages.v0);
  }
  const double size = std::hypot(slip.direction[0], slip.direction[1]);
  for (double& d : slip.direction) d = size > 0 ? d / size : 0;
}

void ElementLoads::set_path(const Element& stages) {
  const int n_q = problem_.n_q();
  const auto set_velocity = [&](int k) { path_.set_velocity(stages, k, search_->path(), n_q + k); };
  if (!search_->needs_boxes()) {
    for (const auto& f : search_->functions()) {
      for (const int k : problem_.info().contacts[f.contact].support) set_velocity(k);
    }
    return;
  }
  for (int k = 0; k < n_q; ++k) {
    path_.set_position(stages, k, search_->path());
    set_velocity(k);
  }
}

Violation ElementLoads::check(const Element& stages) {
  const ProblemInfo& info = problem_.info();
  const auto may_switch = [&](ContactMode mode) { return info.clock >= 0 ? is_closed(mode) : is_slipping(mode); };
  if (!info.structure.has_bounds || std::ranges::none_of(stages.modes, may_switch)) return {};
  if (!search_) search_.emplace(problem_, path_.degree());  // most scenes need none
  if (modes_ != stages.modes) list(stages);
  auto& functions = search_->functions();
  if (functions.empty()) return {};
  set_path(stages);
  if (info.has_friction()) problem_.tangent_jacobian(stages.q0.data(), J_t_.data());
  for (auto& f : functions) {
    f.slack = slack(f);
    if (f.kind == SwitchKind::slip_stops) set_slip(stages, f);
  }
  const auto fall = search_->first_fall();
  Violation first;
  for (std::size_t k = 0; fall && k < functions.size(); ++k) {
    if (!search_->has_fallen(k)) continue;
    const double zero = falling_zero(fall.from, fall.to, [&](double s) { return search_->value(k, s); });
    // Where the force of a contact vanishes, its cone is reached as well, up to the accuracy of located zeros.
    const bool opens = first.is_past(SwitchKind::force_vanishes) && first.contact == functions[k].contact;
    if (first && (zero + (opens ? kSameTime : 0)) * stages.h >= first.time) continue;
    first = {.kind = Violation::Kind::past_switch,
             .passed = functions[k].kind,
             .contact = functions[k].contact,
             .time = zero * stages.h,
             .value = search_->value(k, fall.to)};
  }
  const double duration = fall.duration * stages.h;
  if (first) shortest_ = shortest_ > 0 ? std::min(shortest_, duration) : duration;
  return first;
}

}  // namespace ricochet
