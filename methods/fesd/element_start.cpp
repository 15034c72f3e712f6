#include "methods/fesd/element_start.h"

#include <algorithm>
#include <cmath>

#include "problems/packed_column.h"

namespace ricochet {
namespace {

// A force this near to the cone, as part of the cone, may belong to either side of it.
constexpr double kNearCone = 0.1;
// A force larger than this, as part of what it was in the element before, is not about to vanish.
constexpr double kClear = 1e-6;
// Of the end time: an element this short moves nothing.
constexpr double kStandstill = 1e-13;
// Such elements in turn that may end with impacts; after them the contact that closes may sink.
constexpr int kFewStandstills = 4;

// A capture stands for infinitely many impacts: for more than one.
constexpr int kImpactsOfCapture = 2;
// Newton's iterations that remove gaps of a capture height; normals that nearly depend on each other need several.
constexpr int kMaxMoves = 8;

/// Whether the friction force at the right end of an element is clear of its cone. @param force  lambda_n there
bool is_inside_cone(const ContactInfo& contact, const Element& left, double force) {
  return left.end_lambda_t.segment(contact.tangent_index, contact.n_t).norm() < (1 - kNearCone) * (contact.mu * force);
}

/// Every contact open but bilateral ones, and nothing known of forces.
void clear_modes(const ProblemInfo& info, Element& stages, ElementStart& start) {
  start.from_rest.clear();
  start.unloaded.clear();
  start.on_edge.clear();
  start.has_forces = false;
  std::fill(stages.modes.begin(), stages.modes.end(), ContactMode::open);
  for (const int i : info.bilateral) stages.modes[i] = ContactMode::closed;
  if (!info.has_friction()) return;
  stages.slip_start.setZero();
  std::fill(stages.facets.begin(), stages.facets.end(), 0);
}

}  // namespace

void ElementStart::reserve(const ProblemInfo& info) {
  touching.reserve(info.contacts.size());
  closed.reserve(info.contacts.size());
  alternatives.reserve(2 * info.contacts.size());
  from_rest.reserve(info.contacts.size());
  unloaded.reserve(info.contacts.size());
  on_edge.reserve(info.contacts.size());
  sinks.reserve(info.contacts.size());
  acceleration.setZero(info.n_q);
  lambda_n.setZero(info.n_c());
  lambda_t.setZero(info.n_lambda_t);
  v_open = acceleration;
}

ElementStartSolver::ElementStartSolver(const Problem& problem, const ButcherTableau& tableau,
                                       const FrictionPolygon& polygon, ContactScales& scales, Counters& counters)
    : problem_(problem),
      tableau_(tableau),
      polygon_(polygon),
      scales_(scales),
      impact_law_(problem, polygon, scales, counters),
      impacts_(problem, scales, impact_law_),
      counters_(counters),
      groups_(problem, scales, impact_law_, impacts_,
              [this](std::span<const ContactMode> modes, Vector& q, Vector& v) { return move_to(modes, q, v); }) {
  const ProblemInfo& info = problem.info();
  after_.reserve(info.contacts.size());
  closed_.reserve(info.contacts.size());
  let_go_.reserve(info.contacts.size());
  gap_.setZero(info.n_c());
  v_minus_.setZero(info.n_q);
  u_ = u_next_ = info.u;
  J_t_.setZero(info.n_tangent_entries);
  coupled_.reset(info.n_q);
  coupled_.join(info.structure.couplings);
  if (info.has_bilateral()) coupled_.join_all();
  islands_ = coupled_;
  for (auto* list : {&jumps_, &keeps_}) list->resize(static_cast<std::size_t>(info.n_q));
}

/// The coordinates that M, forces and touching contacts couple, and where their forces jump: an impulse, a contact that
/// was open, slip that stops. Elsewhere forces are continuous, also where a contact breaks or begins to slip.
void ElementStartSolver::set_islands(const LeftEnd& at) {
  const auto& contacts = problem_.info().contacts;
  const Vector& v = at.stages().v0;
  const auto v_minus = at.v_minus();
  islands_ = coupled_;
  for (const int i : at.start.touching) islands_.join(contacts[i].pushed());
  std::fill(jumps_.begin(), jumps_.end(), false);
  for (int k = 0; k < problem_.n_q(); ++k) {
    if (v[k] != v_minus[k]) jumps_[islands_.of(k)] = true;
  }
  for (const int i : at.start.touching) {
    if (!at.was_closed(i) || at.end.is(SwitchKind::slip_stops, i))
      jumps_[islands_.of(contacts[i].support.front())] = true;
  }
}

bool ElementStartSolver::force_jumps(int contact) {
  return jumps_[island_of(contact)];
}

ContactMode ElementStartSolver::continued_mode(const ImpactSolver::ClosedContact& closed) const {
  const int n_t = problem_.info().contacts[closed.contact].n_t;
  if (n_t > 0 && !closed.slides) return ContactMode::stick;
  if (polygon_.applies(n_t)) return closed.is_on_edge ? ContactMode::edge_slip : ContactMode::vertex_slip;
  return slip_mode(n_t, closed.direction);
}

/// Whether the load of a contact that slides pulls it into its surface: at either end of an edge.
bool ElementStartSolver::is_paradox(const ImpactSolver::ClosedContact& closed) const {
  if (!closed.slides) return false;
  if (impact_law_.sliding_delassus(closed.contact, closed.direction) <= 0) return true;
  if (!closed.is_on_edge) return false;
  const auto d = polygon_.vertex(polygon_.next(closed.facet));
  const double direction[2]{-d[0], -d[1]};
  return impact_law_.sliding_delassus(closed.contact, direction) <= 0;
}

/// Records in the scales the speeds of contacts that touch, and the impulses of the element before.
void ElementStartSolver::record_sizes(const LeftEnd& at) {
  impacts_.record_touching(at.v_minus());
  if (!at.left) return impacts_.record_load(at.stages().q0, at.stages().v0, at.step.H);
  const auto largest_force = [&](int i) {
    return tableau_.holds_accelerations ? at.left->end_lambda_n[i] : at.left->lambda_n.row(i).maxCoeff();
  };
  for (const int i : impacts_.candidates()) {
    scales_.record_approach(i, impact_law_.normal_velocity_scale(i, at.left->v0));
    scales_.record_slip(i, impact_law_.slip_velocity_scale(i, at.left->v0));
    if (at.was_closed(i)) scales_.record_approach(i, at.left->h * largest_force(i) * impact_law_.normal_delassus(i));
  }
}

/// Slip on a polygon of a contact whose switch ended the element before.
void ElementStartSolver::set_facet(const Element& element, const Switch& end, ImpactSolver::ClosedContact& closed) {
  closed = {.contact = closed.contact};
  if (end.kind == SwitchKind::slip_turns) impact_law_.set_slide(closed, element.v0, scales_.no_slip(closed.contact));
  if (end.kind == SwitchKind::cone_reached || closed.slides) impact_law_.set_edge(closed, end.condition.facet);
  if (end.kind == SwitchKind::edge_left) impact_law_.set_vertex(closed, end.condition.facet);
}

void ElementStartSolver::restart(bool captures) {
  groups_.restart();
  let_go_.clear();
  settles_ = false;
  standstills_ = standstills_next_ = 0;
  const std::size_t n = captures && problem_.info().unilateral.size() > 1 ? problem_.info().contacts.size() : 0;
  for (auto* flags : {&sinks_, &sinks_next_}) flags->assign(n, 0);
}

void ElementStartSolver::accept() {
  groups_.accept();
  u_ = u_next_;
  let_go_.clear();
  settles_ = false;
  sinks_ = sinks_next_;
  standstills_ = standstills_next_;
}

int ElementStartSolver::sunk(const ElementStart& start, const Vector& q) {
  if (start.sinks.empty()) return -1;
  problem_.gap(q.data(), gap_.data());
  for (const int i : problem_.info().unilateral) {
    if (start.sinks[static_cast<std::size_t>(i)] != 0 && GroupRest::is_too_low(scales_, i, gap_[i])) return i;
  }
  return -1;
}

bool ElementStartSolver::settle() {
  if (!has_groups() || settles_) return false;
  settles_ = true;
  return true;
}

bool ElementStartSolver::is_let_go(int contact) const {
  return std::ranges::count(let_go_, contact) > 0;
}

bool ElementStartSolver::let_go(int contact) {
  if (!has_groups() || contact < 0 || problem_.info().contacts[contact].is_bilateral || is_let_go(contact))
    return false;
  let_go_.push_back(contact);
  return true;
}

ElementStartSolver::Result ElementStartSolver::begin(const LeftEnd& at) {
  const ProblemInfo& info = problem_.info();
  clear(at);
  if (has_groups() && at.left) at.stages().q0 = at.left->q1;  // an attempt before may have moved it
  if (info.n_c() == 0) return Result::done;
  ElementStart& start = at.start;
  groups_.begin();
  impacts_.find_touching(at.stages().q0, at.before(), start.touching);
  if (has_groups()) gap_ = impacts_.gaps();
  u_next_ = info.u;
  if (goes_on(at)) {
    at.step.touches = at.step.touches || !start.touching.empty();
    at.stages().modes = at.left->modes;
    return Result::done;
  }
  if (start.touching.empty() && has_groups()) set_sinking(at);
  if (start.touching.empty() && !info.has_bilateral()) return Result::done;
  at.step.touches = at.step.touches || !start.touching.empty();
  start.failed_contact = start.touching.empty() ? info.bilateral.front() : start.touching.front();
  if (!impact_law_.prepare(at.stages().q0, impacts_.candidates())) return Result::no_impulse;
  if (!start.touching.empty()) {
    record_sizes(at);
    const auto impacts = impacts_.apply_impacts(at.stages().q0, at.before(), start.touching, at.stages().v0,
                                                at.step.Lambda_n.col(at.element), at.step.Lambda_t.col(at.element));
    at.step.n_impacts[static_cast<std::size_t>(at.element)] = impacts.n_impacts;
    if (impacts.failed_contact >= 0) start.failed_contact = impacts.failed_contact;
    switch (impacts.result) {
      case ImpactSequence::Result::done:
        break;
      case ImpactSequence::Result::no_impulse:
        return Result::no_impulse;
      case ImpactSequence::Result::no_forces:
        return Result::no_forces;
      case ImpactSequence::Result::accumulates:
        return Result::accumulates;
    }
    if (has_groups() && !come_to_rest(at)) return Result::no_impulse;
  }
  divide_touching(at);
  const Result result = set_modes(at, 0);
  if (result != Result::done || !has_groups()) return result;
  if (!remove_gaps(at)) return Result::no_impulse;
  set_sinking(at);
  return Result::done;
}

/// |J_t' v| at the left end of an element.
double ElementStartSolver::slip_speed(int i, const Element& stages) {
  const auto& contact = problem_.info().contacts[i];
  problem_.tangent_jacobian_of({&i, 1}, stages.q0.data(), J_t_.data());
  double v_t[2]{0, 0};
  packed_tangent_dots(contact, J_t_.data(), stages.v0.data(), v_t);
  return std::hypot(v_t[0], v_t[1]);
}

/// Whether nothing has happened at the end of the element before: the control is the same, and the forces of its closed
/// contacts and their slip are not near their bounds. Then its modes go on without a contact problem. Not with friction in
/// space.
bool ElementStartSolver::goes_on(const LeftEnd& at) {
  const ProblemInfo& info = problem_.info();
  const bool is_same_control = u_ == info.u;
  const Element* left = at.left;
  if (!left || !is_same_control || at.start.touching.empty() || at.end.contact >= 0 || !left->has_end_forces ||
      !left->facets.empty() || info.has_bilateral() || left->h <= kStandstill * info.end_time)
    return false;
  if (settles_ || !let_go_.empty() || std::ranges::any_of(sinks_, [](char sinks) { return sinks != 0; })) return false;
  const bool is_clear = std::ranges::all_of(at.start.touching, [&](int i) {
    const auto& contact = info.contacts[i];
    const double force = left->end_lambda_n[i];
    if (!is_closed(left->modes[i]) || force <= kClear * scales_.force(i)) return false;
    if (is_slipping(left->modes[i]) && slip_speed(i, at.stages()) <= kClear * scales_.slip(i)) return false;
    return left->modes[i] != ContactMode::stick || is_inside_cone(contact, *left, force);
  });
  if (!is_clear) return false;
  sinks_next_ = sinks_;
  standstills_next_ = 0;
  return true;
}

/// Whether the gap that closes at a switch has sunk.
bool ElementStartSolver::has_sunk(const Switch& end) const {
  return end.contact >= 0 && end.kind == SwitchKind::gap_closes && end.left_gap < -scales_.nearly_touching(end.contact);
}

/// Closes a group that is at rest. False where the laws of an instant cannot be evaluated at the place where it rests.
bool ElementStartSolver::come_to_rest(const LeftEnd& at) {
  int& n_impacts = at.step.n_impacts[static_cast<std::size_t>(at.element)];
  const bool closes = at.end.contact >= 0 && at.end.kind == SwitchKind::gap_closes;
  if (n_impacts == 0 && !closes && !settles_) return true;
  Element& stages = at.stages();
  v_minus_ = at.v_minus();
  // A gap that is below rounding may close without a switch.
  const auto is_struck = [&](int i) { return !at.was_closed(i) && at.step.Lambda_n(i, at.element) > 0; };
  const auto struck = std::ranges::find_if(at.start.touching, is_struck);
  const int cause = closes ? at.end.contact : struck != at.start.touching.end() ? *struck : -1;
  if (!groups_.apply({.contact = cause, .has_sunk = has_sunk(at.end), .at_once = settles_}, at.before(), v_minus_,
                     at.start.touching, stages.q0, stages.v0)) {
    gap_ = impacts_.gaps();
    if (n_impacts == 0 || !groups_.raise_sunk(at.start.touching, stages.q0, stages.v0)) return true;
    problem_.gap(stages.q0.data(), gap_.data());
  }
  n_impacts += kImpactsOfCapture;
  return impact_law_.prepare(stages.q0, impacts_.candidates());
}

/// Moves q0, v0 to where contacts that close have no gaps: they have sunk, or an impact at this instant closed them.
/// Those that open again have none to close at once.
bool ElementStartSolver::remove_gaps(const LeftEnd& at) {
  Element& stages = at.stages();
  const auto has_gap = [&](int i) { return std::abs(gap_[i]) > scales_.nearly_touching(i) && !at.was_closed(i); };
  const auto closes = [&](int i) { return is_closed(stages.modes[i]) && has_gap(i); };
  const bool moves = std::ranges::any_of(at.start.touching, closes);
  std::erase_if(at.start.touching, [&](int i) { return !is_closed(stages.modes[i]) && gap_[i] > 0 && has_gap(i); });
  return !moves || move_to(stages.modes, stages.q0, stages.v0);
}

/// GroupCapture::Move. Sets gap_.
bool ElementStartSolver::move_to(std::span<const ContactMode> modes, Vector& q, Vector& v) {
  if (!dynamics_) dynamics_ = std::make_unique<ModeDynamics>(problem_, counters_);  // most runs need none
  const auto has_gap = [&](int i) {
    return is_closed(modes[static_cast<std::size_t>(i)]) && std::abs(gap_[i]) > scales_.touching(i);
  };
  bool has_gaps = true;
  for (int k = 0; k < kMaxMoves && has_gaps; ++k) {
    problem_.gap(q.data(), gap_.data());
    has_gaps = std::ranges::any_of(problem_.info().unilateral, has_gap);  // where not, v is left to be projected here
    dynamics_->set_modes(modes, q.data(), v.data());
    if (!dynamics_->project(q.data(), v.data())) return false;
  }
  return true;
}

/// Whether the switch before this instant follows the one before it at once, and changes nothing.
bool ElementStartSolver::stands_still(const LeftEnd& at) {
  const bool is_soon = at.left && at.left->h <= kStandstill * problem_.info().end_time;
  standstills_next_ = is_soon ? standstills_ + 1 : 0;
  const bool opens_or_closes = at.end.kind == SwitchKind::gap_closes || at.end.kind == SwitchKind::force_vanishes;
  if (!is_soon || at.end.contact < 0 || !opens_or_closes) return false;
  const bool changes =
      at.step.n_impacts[static_cast<std::size_t>(at.element)] > 0 || at.left->modes != at.stages().modes;
  return !changes || standstills_ >= kFewStandstills;
}

/// Which contacts may sink. One that overlaps without having been refused has been let go while it sank.
void ElementStartSolver::set_sinking(const LeftEnd& at) {
  at.start.sinks.clear();
  sinks_next_ = sinks_;
  groups_.add_left(at.stages().v0);
  for (const int i : groups_.refused()) sinks_next_[i] = 1;
  for (const int i : impacts_.candidates()) {
    if (still_approaches(at, i)) sinks_next_[i] = 1;
  }
  for (const int i : let_go_) sinks_next_[i] = 1;
  if (stands_still(at)) sinks_next_[at.end.contact] = 1;
  bool sinks = false;
  for (const int i : problem_.info().unilateral) {
    if (is_closed(at.stages().modes[i]) || gap_[i] > scales_.nearly_touching(i)) sinks_next_[i] = 0;
    if (!is_closed(at.stages().modes[i]) && gap_[i] < -scales_.nearly_touching(i)) sinks_next_[i] = 1;
    sinks = sinks || sinks_next_[i] != 0;
  }
  if (!sinks) return;
  at.start.sinks.assign(sinks_next_.begin(), sinks_next_.end());
}

/// Nothing touches, and no impulse acts.
void ElementStartSolver::clear(const LeftEnd& at) const {
  at.start.touching.clear();
  at.start.closed.clear();
  at.start.alternatives.clear();
  at.start.sinks.clear();
  at.start.closed_instead = 0;
  at.stages().v0 = at.v_minus();
  at.stages().closes_bounce = false;
  clear_modes(problem_.info(), at.stages(), at.start);
  at.step.n_impacts[static_cast<std::size_t>(at.element)] = 0;
  if (problem_.n_c() > 0) at.step.Lambda_n.col(at.element).setZero();
  if (problem_.info().has_friction()) at.step.Lambda_t.col(at.element).setZero();
}

/// After the impacts: contacts that do not separate, and as alternatives those that have bounced.
void ElementStartSolver::divide_touching(const LeftEnd& at) {
  ElementStart& start = at.start;
  const Element& stages = at.stages();
  const auto Lambda_n = at.step.Lambda_n.col(at.element);
  // A contact closes; the impulses of contacts that were closed when they bounced (see continue_modes) are no impact.
  const bool is_impact =
      std::ranges::any_of(start.touching, [&](int i) { return Lambda_n[i] > 0 && !at.was_closed(i); });
  const double* force = nullptr;
  if (at.left && at.end.contact >= 0)
    force = at.left->end_lambda_t.data() + problem_.info().contacts[at.end.contact].tangent_index;
  contacts_after_impact(impact_law_, scales_, start.touching,
                        {at.before(), at.v_minus(), stages.v0, is_impact, at.end.kind, at.end.contact, force, {}},
                        after_);
  for (ContactAfterImpact& contact : after_) {
    const int i = contact.closed.contact;
    if (impacts_.is_left(i) || is_let_go(i) || still_approaches(at, i)) continue;
    if (i == at.end.contact && at.end.on_polygon() && !contact.is_struck) set_facet(stages, at.end, contact.closed);
    if (contact.rests || !contact.separates) {
      start.closed.push_back(contact.closed);
    } else if (!at.left || at.was_closed(i) || (Lambda_n[i] > 0 && !is_above(i))) {
      start.alternatives.push_back({i, continued_mode(contact.closed), ContactMode::open,
                                    impact_law_.normal_velocity(i, stages.v0), contact.closed.facet, 0, contact.closed,
                                    Lambda_n[i] > 0});
    }
  }
}

/// Whether a contact that an impact of a group has struck is above its surface, by no more than the capture height.
bool ElementStartSolver::is_above(int contact) const {
  return has_groups() && impacts_.gaps()[contact] > scales_.nearly_touching(contact);
}

/// Whether impacts that have come to their end as a group let a contact approach that parted from it: it stays open.
bool ElementStartSolver::still_approaches(const LeftEnd& at, int contact) const {
  return has_groups() && at.step.n_impacts[static_cast<std::size_t>(at.element)] > 1 &&
         at.step.Lambda_n(contact, at.element) > 0 &&
         impact_law_.normal_velocity(contact, at.stages().v0) < -scales_.no_drift(contact);
}

/// The bounces whose contacts the others hold: they neither part nor approach.
unsigned ElementStartSolver::bounces_at_rest(const LeftEnd& at) const {
  unsigned set = 0;
  const auto& alternatives = at.start.alternatives;
  for (std::size_t k = 0; k < std::min(alternatives.size(), kMaxAlternatives); ++k) {
    const int i = alternatives[k].contact;
    const bool rests = std::abs(impact_law_.normal_velocity(i, at.stages().v0)) <= scales_.no_drift(i);
    if (alternatives[k].bounced() && rests) set |= 1U << k;
  }
  return set;
}

/// Stages take the velocity of a closed bounce away where forces hold gaps; where they hold accelerations, it is taken
/// away here, as a capture.
ElementStartSolver::Result ElementStartSolver::close_instead(const LeftEnd& at, unsigned closed_instead) {
  ElementStart& start = at.start;
  Element& stages = at.stages();
  int& n_impacts = at.step.n_impacts[static_cast<std::size_t>(at.element)];
  const bool captures = tableau_.holds_accelerations;
  clear_modes(problem_.info(), stages, start);
  if (captures && start.closed_instead == 0) {
    start.v_open = stages.v0;
  } else if (captures) {
    stages.v0 = start.v_open;
    n_impacts -= kImpactsOfCapture;
    start.closed_instead = 0;
  }
  if (!impact_law_.prepare(stages.q0, start.touching)) return Result::no_impulse;
  const std::size_t n_alternatives = start.alternatives.size();
  const Result result = set_modes(at, closed_instead);
  start.alternatives.resize(n_alternatives);
  start.closed_instead = closed_instead;
  stages.closes_bounce = closed_instead != 0;
  if (!captures || closed_instead == 0) return result;
  n_impacts += kImpactsOfCapture;
  if (result != Result::done) return result;
  q_ = stages.q0;  // only the velocity changes
  if (!move_to(stages.modes, q_, stages.v0)) return Result::no_impulse;
  const unsigned at_rest = bounces_at_rest(at) | closed_instead;
  return at_rest == closed_instead ? Result::done : close_instead(at, at_rest);
}

/// Modes from the forces right after the start, and the alternatives to them.
ElementStartSolver::Result ElementStartSolver::set_modes(const LeftEnd& at, unsigned closed_instead) {
  const ProblemInfo& info = problem_.info();
  if (at.start.closed.empty() && closed_instead == 0 && !info.has_bilateral()) return Result::done;
  set_islands(at);
  std::fill(keeps_.begin(), keeps_.end(), false);
  if (at.within_step && at.left && !info.has_bilateral()) find_kept(at);
  collect_closed(at, closed_instead);
  const Result result = find_forces(at);
  if (result != Result::done) return result;
  for (const auto& closed : closed_) set_mode(at, closed);
  return Result::done;
}

/// Contacts whose modes the load decides, in closed_; islands that are kept have theirs.
void ElementStartSolver::collect_closed(const LeftEnd& at, unsigned closed_instead) {
  ElementStart& start = at.start;
  closed_.clear();
  for (const auto& closed : start.closed) {
    if (keeps_[island_of(closed.contact)])
      at.stages().modes[closed.contact] = at.left->modes[closed.contact];
    else
      closed_.push_back(closed);
  }
  for (std::size_t k = 0; k < std::min(start.alternatives.size(), kMaxAlternatives); ++k) {
    if (closed_instead >> k & 1U) closed_.push_back(start.alternatives[k].closed);
  }
  for (const auto& closed : closed_) {
    if (closed.is_on_edge) start.on_edge.push_back({closed.contact, closed.facet});
    if (at.end.is(SwitchKind::edge_left, closed.contact))
      start.on_edge.push_back({closed.contact, at.left->facets[closed.contact]});
  }
}

/// Forces and accelerations of closed_ and of what is kept.
ElementStartSolver::Result ElementStartSolver::find_forces(const LeftEnd& at) {
  ElementStart& start = at.start;
  const Element& stages = at.stages();
  const auto in_paradox =
      std::find_if(closed_.begin(), closed_.end(), [&](const ImpactSolver::ClosedContact& c) { return is_paradox(c); });
  const bool has_paradox = in_paradox != closed_.end();
  if (!closed_.empty()) start.failed_contact = has_paradox ? in_paradox->contact : closed_.front().contact;
  do {
    if (impact_law_.contact_forces(stages.q0, stages.v0, closed_, start.lambda_n, start.lambda_t) != LcpStatus::solved)
      return Result::no_forces;
  } while (groups_.leave_wedge(closed_, start.lambda_n));
  impact_law_.decide_unloaded(stages.q0, stages.v0, closed_, start.lambda_n, start.lambda_t);
  // Where sliding pulls the contact into itself, a load that leaves it open lets it press as well.
  if (has_paradox) return Result::indeterminate;
  for (const auto& closed : closed_)
    scales_.record_force(closed.contact,
                         impact_law_.load_size(closed.contact) / impact_law_.normal_delassus(closed.contact));
  start.has_forces = true;
  start.acceleration = impact_law_.acceleration();
  if (std::find(keeps_.begin(), keeps_.end(), true) != keeps_.end()) keep_forces(*at.left, start);
  return Result::done;
}

void ElementStartSolver::set_mode(const LeftEnd& at, const ImpactSolver::ClosedContact& closed) {
  const int i = closed.contact, n_t = problem_.info().contacts[i].n_t;
  ContactMode mode = closed.mode;
  const bool rested = at.was_closed(i) && !force_jumps(i);
  // Bodies that move side by side without a force go on to touch.
  const bool is_unloaded = mode == ContactMode::open && !impact_law_.is_pulled_apart(i);
  if (mode == ContactMode::open && rested && (at.within_step || is_unloaded)) mode = continued_mode(closed);
  if (is_unloaded) at.start.unloaded.push_back(i);
  at.stages().modes[i] = mode;
  if (polygon_.applies(n_t)) at.stages().facets[i] = closed.facet;
  if (!is_closed(mode)) return;
  if (is_unloaded)
    at.start.alternatives.push_back({i, ContactMode::open, mode, 0, 0, closed.facet});
  else
    offer_break(at, closed, mode, rested);
  if (n_t > 0) offer_slip_or_stick(at, closed, mode);
}

/// If another contact breaks, one that the load leaves without a force may break as well.
void ElementStartSolver::offer_break(const LeftEnd& at, const ImpactSolver::ClosedContact& closed, ContactMode mode,
                                     bool rested) const {
  const bool breaks_too = at.end.kind == SwitchKind::force_vanishes && at.end.contact >= 0 && rested &&
                          at.start.lambda_n[closed.contact] <= scales_.no_force(closed.contact);
  if (breaks_too) at.start.alternatives.push_back({closed.contact, ContactMode::open, mode, 0, 0, closed.facet});
}

/// At the boundary of the cone a contact may stick or slip. After leaving an edge of its polygon it may be there still.
void ElementStartSolver::offer_slip_or_stick(const LeftEnd& at, const ImpactSolver::ClosedContact& closed,
                                             ContactMode mode) const {
  const int i = closed.contact;
  const auto& contact = problem_.info().contacts[i];
  ElementStart& start = at.start;
  const auto lambda_t = start.lambda_t.segment(contact.tangent_index, contact.n_t);
  const double force = lambda_t.norm(), cone = contact.mu * start.lambda_n[i];
  const bool from_rest = is_slipping(mode) && (!closed.slides || at.end.is(SwitchKind::cone_reached, i));
  if (from_rest) {
    start.from_rest.push_back(i);
    start.alternatives.push_back({i, ContactMode::stick, mode, 0, 0, closed.facet});
    if (mode == ContactMode::slip)
      at.stages().slip_start.segment(contact.tangent_index, contact.n_t) = -lambda_t / force;
  } else if (mode == ContactMode::vertex_slip && at.end.is(SwitchKind::edge_left, i)) {
    start.alternatives.push_back({i, ContactMode::edge_slip, mode, 0, at.left->facets[i], closed.facet});
  } else if (mode == ContactMode::stick && force > (1 - kNearCone) * cone && contact.n_t == 1) {
    const double against = -lambda_t[0];
    start.alternatives.push_back({i, slip_mode(contact.n_t, &against), mode});
  }
}

/// Islands that go on as they are: their forces are continuous, the switch is none of theirs, and none of their
/// contacts is about to break or to slip at the same time.
void ElementStartSolver::find_kept(const LeftEnd& at) {
  const ElementStart& start = at.start;
  const Element& left = *at.left;
  if (tableau_.right_end.size() == 0) return;
  const auto& contacts = problem_.info().contacts;
  for (const auto& closed : start.closed) keeps_[island_of(closed.contact)] = true;
  for (const int i : start.touching) {
    if (force_jumps(i)) keeps_[island_of(i)] = false;
  }
  if (at.end.contact >= 0) keeps_[island_of(at.end.contact)] = false;
  for (const auto& closed : start.closed) {
    const auto& contact = contacts[closed.contact];
    const double force = left.end_lambda_n[closed.contact];
    bool goes_on = force > kClear * left.lambda_n.row(closed.contact).maxCoeff() && !polygon_.applies(contact.n_t);
    if (contact.n_t > 0 && left.modes[closed.contact] == ContactMode::stick)
      goes_on = goes_on && is_inside_cone(contact, left, force);
    else if (contact.n_t > 0)
      goes_on = goes_on && closed.slides && left.slip_start.segment(contact.tangent_index, contact.n_t).isZero(0);
    if (!goes_on) keeps_[island_of(closed.contact)] = false;
  }
}

/// The forces and accelerations at the right end of the element before, where they are kept.
void ElementStartSolver::keep_forces(const Element& left, ElementStart& start) {
  for (const auto& closed : start.closed) {
    const auto& contact = problem_.info().contacts[closed.contact];
    if (!keeps_[island_of(closed.contact)]) continue;
    start.lambda_n[closed.contact] = left.end_lambda_n[closed.contact];
    for (int d = contact.tangent_index; d < contact.tangent_index + contact.n_t; ++d)
      start.lambda_t[d] = left.end_lambda_t[d];
  }
  for (int k = 0; k < problem_.n_q(); ++k) {
    if (!keeps_[islands_.of(k)]) continue;
    start.acceleration[k] = 0;
    for (Eigen::Index j = 0; j < left.a.cols(); ++j) start.acceleration[k] += tableau_.right_end[j] * left.a(k, j);
  }
}

bool ElementStartSolver::continue_modes(FesdStep& step, int element, ElementStart& start) {
  const Element& before = step.elements[element - 1];
  Element& stages = step.elements[element];
  stages.q0 = before.q1;
  stages.v0 = before.v1;
  stages.closes_bounce = false;
  step.v_minus.col(element) = before.v1;
  step.n_impacts[static_cast<std::size_t>(element)] = 0;
  start.touching.clear();
  start.from_rest.clear();
  start.unloaded.clear();
  start.on_edge.clear();
  start.has_forces = false;
  const int n_c = problem_.n_c();
  if (n_c == 0) return true;
  if (problem_.info().has_friction()) {
    step.Lambda_t.col(element).setZero();
    stages.slip_start.setZero();
  }
  for (int i = 0; i < n_c; ++i) {
    step.Lambda_n(i, element) = 0;
    stages.modes[i] = before.modes[i];
  }
  std::copy(before.facets.begin(), before.facets.end(), stages.facets.begin());
  if (!step.touches) return true;
  for (const int i : problem_.info().unilateral) {
    if (is_closed(stages.modes[i])) start.touching.push_back(i);
  }
  if (start.touching.empty()) return true;
  if (!impact_law_.prepare(stages.q0, start.touching)) return false;
  impacts_.set_touching(start.touching);
  record_sizes({step, element, &before, {}, true, start});
  return impacts_.apply_impact(stages.v0, step.Lambda_n.col(element), step.Lambda_t.col(element));
}

bool ElementStartSolver::is_pressed(const Element& element, int contact) {
  ImpactSolver::ClosedContact closed{.contact = contact};
  Vector lambda_n(problem_.n_c()), lambda_t(problem_.info().n_lambda_t);
  return impact_law_.contact_forces(element.q0, element.v0, {&closed, 1}, lambda_n, lambda_t) == LcpStatus::solved &&
         is_closed(closed.mode);
}

int ElementStartSolver::first_to_stop(const Element& element, double& time) {
  closed_.clear();
  std::vector<int> touching;
  for (const int i : problem_.info().unilateral) {
    if (is_closed(element.modes[i])) touching.push_back(i);
  }
  if (!impact_law_.prepare(element.q0, touching)) return -1;
  for (const int i : touching) {
    ImpactSolver::ClosedContact closed{.contact = i};
    if (is_slipping(element.modes[i])) impact_law_.set_slide(closed, element.v0, 0);
    closed_.push_back(closed);
  }
  Vector lambda_n(problem_.n_c()), lambda_t(problem_.info().n_lambda_t);
  if (impact_law_.contact_forces(element.q0, element.v0, closed_, lambda_n, lambda_t) != LcpStatus::solved) return -1;
  int first = -1;
  for (const auto& closed : closed_) {
    if (element.modes[closed.contact] != ContactMode::slip) continue;
    double v_t[2], w_t[2];
    impact_law_.slip_velocity(closed.contact, element.v0, v_t);
    impact_law_.slip_velocity(closed.contact, impact_law_.acceleration(), w_t);
    const double work = v_t[0] * w_t[0] + v_t[1] * w_t[1];
    if (work >= 0) continue;
    const double stop = -(v_t[0] * v_t[0] + v_t[1] * v_t[1]) / work;
    if (first < 0 || stop < time) {
      first = closed.contact;
      time = stop;
    }
  }
  return first;
}

}  // namespace ricochet
