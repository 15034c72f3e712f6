#include "methods/fesd/junction.h"

#include <algorithm>
#include <cmath>

#include "methods/fesd/rounding.h"

namespace ricochet {
namespace {

// A force this near to the cone, as part of the cone, may belong to either side of it.
constexpr double kNearCone = 0.1;

}  // namespace

void Junction::reserve(const ProblemInfo& info) {
  touching.reserve(info.contacts.size());
  alternatives.reserve(info.contacts.size());
  from_rest.reserve(info.contacts.size());
  on_edge.reserve(info.contacts.size());
  acceleration.setZero(info.n_q);
  lambda_n.setZero(info.n_c());
  lambda_t.setZero(info.n_lambda_t);
}

JunctionSolver::JunctionSolver(const Problem& problem, const ButcherTableau& tableau, const FrictionPolygon& polygon,
                               const Vector& gap_size, Counters& counters)
    : problem_(problem),
      tableau_(tableau),
      polygon_(polygon),
      gap_size_(gap_size),
      impact_law_(problem, polygon, counters) {
  closed_.reserve(problem.info().contacts.size());
  approaching_.reserve(problem.info().contacts.size());
  gap_.setZero(problem.n_c());
}

/// A closed contact that stays closed whatever the load says.
ContactMode JunctionSolver::continued_mode(const ImpactLaw::Closed& closed) const {
  const int n_t = problem_.info().contacts[closed.contact].n_t;
  if (n_t > 0 && !closed.slides) return ContactMode::stick;
  if (polygon_.applies(n_t)) return closed.is_on_edge ? ContactMode::edge_slip : ContactMode::vertex_slip;
  return slip_mode(n_t, closed.direction);
}

/// Whether the load of a contact that slides pulls it into its surface: at either end of an edge.
bool JunctionSolver::is_paradox(const ImpactLaw::Closed& closed) const {
  if (!closed.slides) return false;
  if (impact_law_.sliding_delassus(closed.contact, closed.direction) <= 0) return true;
  if (!closed.is_on_edge) return false;
  const auto d = polygon_.vertex(polygon_.next(closed.facet));
  const double direction[2]{-d[0], -d[1]};
  return impact_law_.sliding_delassus(closed.contact, direction) <= 0;
}

/// Whether a contact needs an impulse. What is left across one that was closed in the element before is rounding of
/// velocities before they cancelled, and of what its force took away: a body at rest has no velocity to compare with.
bool JunctionSolver::approaches(int contact, const Eigen::Ref<const Vector>& v, const Stages* left) {
  double size = impact_law_.normal_velocity_scale(contact, v);
  normal_size_ = std::max(normal_size_, size);
  if (left && is_closed(left->modes[contact])) {
    const double stopped = left->h * left->lambda_n.row(contact).maxCoeff() * impact_law_.normal_delassus(contact);
    normal_size_ = size = std::max(normal_size_, stopped);
  }
  return impact_law_.normal_velocity(contact, v) < -kVelocityRounding * size;
}

/// The touching contacts that need an impulse, in approaching_.
void JunctionSolver::find_approaching(const Junction& junction, const Eigen::Ref<const Vector>& v, const Stages* left) {
  approaching_.clear();
  for (const int i : junction.touching) {
    if (approaches(i, v, left)) approaching_.push_back(i);
  }
}

/// Whether a closed contact slides already, and where to.
void JunctionSolver::set_tangential_law(const Stages& element, const Stages* left, const Switch& end, bool is_struck,
                                        ImpactLaw::Closed& closed) {
  const int i = closed.contact;
  const auto& contact = problem_.info().contacts[i];
  const ContactMode before = left ? left->modes[i] : ContactMode::open;
  if (end.contact == i && end.on_polygon() && !is_struck) return set_facet(element, end, closed);
  if (end.is(Switch::Kind::cone_reached, i) && !end.on_polygon()) {  // slip starts against the force
    closed.slides = true;
    double size = 0;
    for (int d = 0; d < contact.n_t; ++d) {
      closed.direction[d] = -left->end_lambda_t[contact.tangent_index + d];
      size = std::hypot(size, closed.direction[d]);
    }
    for (int d = 0; d < contact.n_t; ++d) closed.direction[d] /= size;
    return;
  }
  if (before == ContactMode::stick && !is_struck) return;
  if (end.is(Switch::Kind::slip_stops, i)) return;
  set_slide(element, closed);
}

/// The same on a polygon, where the switch of this contact says it.
void JunctionSolver::set_facet(const Stages& element, const Switch& end, ImpactLaw::Closed& closed) {
  if (end.kind == Switch::Kind::slip_turns) set_slide(element, closed);
  if (end.kind == Switch::Kind::cone_reached || closed.slides) impact_law_.set_edge(closed, end.condition.facet);
  if (end.kind == Switch::Kind::edge_left) impact_law_.set_vertex(closed, end.condition.facet);
}

/// Whether it slides, up to what contacts that come to rest together have left of their slip when the switch of one of
/// them is solved.
void JunctionSolver::set_slide(const Stages& element, ImpactLaw::Closed& closed) {
  slip_size_ = std::max(slip_size_, impact_law_.slip_velocity_scale(closed.contact, element.v0));
  impact_law_.set_slide(closed, element.v0, kSlipRounding * slip_size_);
}

JunctionSolver::Result JunctionSolver::begin(FesdStep& step, int element, const Stages* left, const Switch& end,
                                             bool within_step, Junction& junction) {
  const ProblemInfo& info = problem_.info();
  const int n_c = info.n_c();
  Stages& stages = step.elements[element];
  auto v_minus = step.v_minus.col(element);
  auto Lambda_n = step.Lambda_n.col(element);
  auto Lambda_t = step.Lambda_t.col(element);
  junction.touching.clear();
  junction.alternatives.clear();
  junction.from_rest.clear();
  junction.on_edge.clear();
  junction.has_forces = false;
  stages.v0 = v_minus;
  if (n_c == 0) return Result::done;
  for (int i = 0; i < n_c; ++i) {
    Lambda_n[i] = 0;
    stages.modes[i] = info.contacts[i].is_bilateral ? ContactMode::closed : ContactMode::open;
  }
  if (info.has_friction()) {
    Lambda_t.setZero();
    stages.slip_start.setZero();
    std::fill(stages.facets.begin(), stages.facets.end(), 0);
  }

  const auto was_closed = [&](int i) { return left && is_closed(left->modes[i]); };
  problem_.gap(stages.q0.data(), gap_.data());
  for (const int i : info.unilateral) {
    if (gap_[i] > 0 && gap_[i] > (was_closed(i) ? kClosedGapRounding : kGapRounding) * gap_size_[i]) continue;
    junction.touching.push_back(i);
  }
  if (junction.touching.empty() && !info.has_bilateral()) return Result::done;
  step.touches = step.touches || !junction.touching.empty();
  junction.culprit = junction.touching.empty() ? info.bilateral.front() : junction.touching.front();
  if (!impact_law_.prepare(stages.q0, junction.touching)) return Result::no_impulse;

  // Of a normal velocity behind the impact: an impulse that passes through a contact at rest leaves rounding of its
  // own.
  const auto rounding = [&](int i) {
    const double stopped = Lambda_n[i] * impact_law_.normal_delassus(i);
    return kVelocityRounding * std::max(impact_law_.normal_velocity_scale(i, v_minus), stopped);
  };
  find_approaching(junction, v_minus, left);
  // A contact closes; the impulses of contacts that were closed when they bounced (see carry_on) are no impact.
  bool is_impact = false;
  if (!approaching_.empty()) {
    if (impact_law_.impact(approaching_, stages.v0, Lambda_n, Lambda_t) != LcpStatus::solved) return Result::no_impulse;
    for (const int i : junction.touching) is_impact = is_impact || (Lambda_n[i] > 0 && !was_closed(i));
  }
  // A contact whose bodies it moves; the others go on as if nothing had happened.
  const auto is_struck = [&](int i) {
    const auto& support = info.contacts[i].support;
    return is_impact && std::any_of(support.begin(), support.end(), [&](int k) { return stages.v0[k] != v_minus[k]; });
  };

  // Where a run begins at rest, but for rounding, only the forces say what a velocity is: those along the contact, and
  // the friction that a load makes.
  if (!left && info.has_friction() && !junction.touching.empty()) {
    const Vector& w = impact_law_.free_acceleration(stages.q0, stages.v0);
    for (const int i : junction.touching)
      slip_size_ = std::max({slip_size_, step.H * impact_law_.slip_velocity_scale(i, w),
                             step.H * info.contacts[i].mu * impact_law_.normal_velocity_scale(i, w)});
  }

  closed_.clear();
  for (const int i : junction.touching) {
    if (end.is(Switch::Kind::force_vanishes, i)) continue;
    const bool rested = was_closed(i) && !is_struck(i);
    ImpactLaw::Closed closed{.contact = i};
    if (info.contacts[i].n_t > 0) set_tangential_law(stages, left, end, is_struck(i), closed);
    if (rested || impact_law_.normal_velocity(i, stages.v0) <= rounding(i)) {
      closed_.push_back(closed);
    } else {
      junction.alternatives.push_back(
          {i, continued_mode(closed), ContactMode::open, impact_law_.normal_velocity(i, stages.v0), closed.facet});
    }
  }
  if (closed_.empty() && !info.has_bilateral()) return Result::done;
  for (const auto& closed : closed_) {
    if (closed.is_on_edge) junction.on_edge.push_back({closed.contact, closed.facet});
    if (end.is(Switch::Kind::edge_left, closed.contact))
      junction.on_edge.push_back({closed.contact, left->facets[closed.contact]});
  }
  const auto in_paradox =
      std::find_if(closed_.begin(), closed_.end(), [&](const ImpactLaw::Closed& c) { return is_paradox(c); });
  if (!closed_.empty()) junction.culprit = in_paradox != closed_.end() ? in_paradox->contact : closed_.front().contact;
  if (impact_law_.contact_forces(stages.q0, stages.v0, closed_, junction.lambda_n, junction.lambda_t) !=
      LcpStatus::solved) {
    return Result::no_forces;
  }
  // Where sliding pulls the contact into itself, a load that leaves it open lets it press as well.
  if (in_paradox != closed_.end()) return Result::indeterminate;
  junction.has_forces = true;
  junction.acceleration = impact_law_.acceleration();

  for (const auto& closed : closed_) {
    const int i = closed.contact;
    const auto& contact = info.contacts[i];
    ContactMode mode = closed.mode;
    const bool rested = was_closed(i) && !is_struck(i);
    if (mode == ContactMode::open && within_step && rested) mode = continued_mode(closed);
    stages.modes[i] = mode;
    if (polygon_.applies(contact.n_t)) stages.facets[i] = closed.facet;
    const bool breaks_too = end.kind == Switch::Kind::force_vanishes && end.contact >= 0 && is_closed(mode) && rested &&
                            junction.lambda_n[i] <= kForceRounding * left->lambda_n.row(i).maxCoeff();
    if (breaks_too) junction.alternatives.push_back({i, ContactMode::open, mode, 0, 0, closed.facet});
    if (!is_closed(mode) || contact.n_t == 0) continue;

    const auto lambda_t = junction.lambda_t.segment(contact.tangent_index, contact.n_t);
    const double force = lambda_t.norm(), cone = contact.mu * junction.lambda_n[i];
    const bool from_rest = is_slipping(mode) && (!closed.slides || end.is(Switch::Kind::cone_reached, i));
    if (from_rest) {
      junction.from_rest.push_back(i);
      junction.alternatives.push_back({i, ContactMode::stick, mode, 0, 0, closed.facet});
      if (mode == ContactMode::slip) stages.slip_start.segment(contact.tangent_index, contact.n_t) = -lambda_t / force;
    } else if (mode == ContactMode::vertex_slip && end.is(Switch::Kind::edge_left, i)) {
      junction.alternatives.push_back({i, ContactMode::edge_slip, mode, 0, left->facets[i], closed.facet});
    } else if (mode == ContactMode::stick && force > (1 - kNearCone) * cone && contact.n_t == 1) {
      const double against = -lambda_t[0];
      junction.alternatives.push_back({i, slip_mode(contact.n_t, &against), mode});
    }
  }
  return Result::done;
}

bool JunctionSolver::carry_on(FesdStep& step, int element, Junction& junction) {
  const Stages& before = step.elements[element - 1];
  Stages& stages = step.elements[element];
  stages.q0 = before.q1;
  stages.v0 = before.v1;
  step.v_minus.col(element) = before.v1;
  junction.touching.clear();
  junction.from_rest.clear();
  junction.on_edge.clear();
  junction.has_forces = false;
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
    if (is_closed(stages.modes[i])) junction.touching.push_back(i);
  }
  if (junction.touching.empty()) return true;
  if (!impact_law_.prepare(stages.q0, junction.touching)) return false;
  find_approaching(junction, stages.v0, &before);
  return approaching_.empty() || impact_law_.impact(approaching_, stages.v0, step.Lambda_n.col(element),
                                                    step.Lambda_t.col(element)) == LcpStatus::solved;
}

bool JunctionSolver::is_pressed(const Stages& element, int contact) {
  ImpactLaw::Closed closed{.contact = contact};
  Vector lambda_n(problem_.n_c()), lambda_t(problem_.info().n_lambda_t);
  return impact_law_.contact_forces(element.q0, element.v0, {&closed, 1}, lambda_n, lambda_t) == LcpStatus::solved &&
         is_closed(closed.mode);
}

int JunctionSolver::first_to_stop(const Stages& element, double& time) {
  closed_.clear();
  std::vector<int> touching;
  for (const int i : problem_.info().unilateral) {
    if (is_closed(element.modes[i])) touching.push_back(i);
  }
  if (!impact_law_.prepare(element.q0, touching)) return -1;
  for (const int i : touching) {
    ImpactLaw::Closed closed{.contact = i};
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
