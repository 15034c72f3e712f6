#include "reference/mode_changes.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <limits>

#include "problems/join.h"
#include "reference/stop.h"

namespace ricochet::reference {
namespace {

// Longest first step of slip in space, as a fraction of end_time; start_slip() shortens it.
constexpr double kSlipStart = 1e-2;

// Limit of successive impacts of n contacts at one instant. There are few unless they accumulate; in a row of n bodies
// between walls the slowest rate falls by 1 / e in about n^2 / 2 impacts.
constexpr int most_impacts(int n) {
  return 1000 + 20 * n * n;
}

// Successive impacts of n contacts after which groups may be at rest.
constexpr int few_impacts(int n) {
  return 20 + 5 * n;
}

// A contact whose impacts follow each other within the shortest flight may sink, too, if it is this times as fast as a slow
// one.
constexpr double kRattles = 10;

constexpr const char* kNoProjection = "the state cannot be projected onto its contacts";

}  // namespace

ModeChanges::ModeChanges(const Problem& problem, const Scales& scales, double tolerance, ContactDynamics& dynamics,
                         Slips& slips, Flights& flights, SmoothMotion& motion)
    : problem_(problem),
      scales_(scales),
      tolerance_(tolerance),
      n_q_(problem.n_q()),
      n_c_(problem.n_c()),
      laws_(problem, scales),
      groups_(problem, scales, laws_, tolerance),
      dynamics_(dynamics),
      slips_(slips),
      flights_(flights),
      motion_(motion),
      modes_(dynamics.modes()) {}

bool ModeChanges::decide(double& t, const Roots& found, Solution& solution) {
  if (n_c_ == 0) return true;
  if (!check_roots(t, found, solution)) return false;
  Instant instant;
  instant.before = modes_;
  finish_slip(t, found, instant, solution);
  if (problem_.info().has_friction()) motion_.accelerate(solution.q, solution.v);  // forces for the decisions
  instant.v_minus = solution.v;
  find_touching(t, found, instant, solution);
  if (instant.approaches)
    instant.touching.insert(instant.touching.end(), instant.released.begin(), instant.released.end());
  if (!collide(t, instant, solution)) return false;
  if (!decide_candidates(t, instant, solution)) return false;
  motion_.accelerate(solution.q, solution.v);
  if (has_groups_) keep_sunk(solution);
  flights_.start(t, solution.q, solution.v, motion_.acceleration(), modes_);
  return record_events(t, instant, solution) && begin_slip(t, solution);
}

/// Rejects roots for which no decision is possible.
bool ModeChanges::check_roots(double t, const Roots& found, Solution& solution) const {
  for (const int i : dynamics_.closed()) {
    if (found.friction[i] && is_slipping(modes_[i]) && slips_.is_new(i)) {
      return stop(solution, Status::inner_solver_failed, t,
                  fmt::format("inconsistent: contact '{}' began to slip and moves against its slip direction", name(i)),
                  {FailureCode::inconsistent, {name(i)}});
    }
    if (found.normal[i] && !dynamics_.determines_forces(i)) {
      return stop(
          solution, Status::inner_solver_failed, t,
          fmt::format("contact '{}' shares its force with redundant contacts, and no division among them goes on: "
                      "which of them ends mode {} is not determined",
                      name(i), to_string(modes_[i])));
    }
  }
  return true;
}

void ModeChanges::finish_slip(double& t, const Roots& found, Instant& instant, Solution& solution) {
  std::vector<int> at_root;
  for (const int i : dynamics_.closed()) {
    if (is_slipping(modes_[i]) && found.friction[i]) at_root.push_back(i);
  }
  instant.stopped.assign(modes_.size(), false);
  if (at_root.empty()) return;
  double duration = 0;
  for (const int i : slips_.finish(at_root, problem_.info().end_time - t, duration, solution.q, solution.v))
    instant.stopped[i] = true;
  t += duration;
}

/// Finds contacts whose gap is zero, and those that start to close. Opens closed contacts without force.
void ModeChanges::find_touching(double t, const Roots& found, Instant& instant, const Solution& solution) {
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector gap = problem_.gap(solution.q);
  const Vector rate = J.transpose() * solution.v, rate_size = scales_.speed(J, solution.v);
  instant.leaves_cone.assign(modes_.size(), false);
  std::vector<int> bounced;
  int approaching = 0;
  for (const int i : problem_.info().unilateral) {
    // Redundant contacts reach their cones together.
    const bool at_cone = modes_[i] == ContactMode::stick &&
                         (found.friction[i] || (found.any() && !dynamics_.determines_forces(i) &&
                                                motion_.cone_slack(i) <= kSame * motion_.force_size(i)));
    // Without a tangential force the tip of the cone is reached, and rounding decides which of the two roots is found.
    if (is_closed(modes_[i]) &&
        (found.normal[i] || (at_cone && motion_.normal_force(i) <= kSame * motion_.force_size(i)))) {
      modes_[i] = ContactMode::open;  // its force vanishes
      instant.released.push_back(i);
      continue;
    }
    instant.leaves_cone[i] = at_cone;
    if (!is_closed(modes_[i]) && !found.normal[i] && !flights_.touches(i, gap[i])) continue;
    if (found.normal[i]) flights_.end_sinking(i);
    if (flights_.sinks(i, rate[i])) continue;
    instant.touching.push_back(i);
    if (is_closed(modes_[i]) || rate[i] >= -kSame * rate_size[i]) continue;
    ++approaching;
    if (!found.normal[i] && flights_.offset()[i] == 0 && flights_.bounced(i, t)) bounced.push_back(i);
  }
  instant.approaches = approaching > 0;
  if (bounced.empty() || approaching < 2) return;
  const Vector slow = groups_.slow(solution.q, solution.v, modes_);
  instant.is_ambiguous = std::ranges::any_of(bounced, [&](int i) { return slow[i] == 0; });
}

/// Whether (4) of Flights holds for all touching contacts.
bool ModeChanges::end_together(const Instant& instant, const Solution& solution) {
  if (instant.touching.size() < 2) return false;
  const auto modes = dynamics_.modes();
  auto without = modes;
  std::vector<char> all(modes.size(), false);
  for (const int i : instant.touching) {
    without[i] = ContactMode::open;
    all[i] = true;
  }
  dynamics_.set_modes(without);
  const bool is_known = motion_.accelerate(solution.q, instant.v_minus);
  dynamics_.set_modes(modes);
  if (!is_known) return false;
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector a = J.transpose() * motion_.acceleration() + problem_.gap_acceleration_bias(solution.q, instant.v_minus);
  const Vector before = J.transpose() * instant.v_minus;
  const auto stay_low = [&](const Vector& rate) {
    return std::ranges::all_of(instant.touching, [&](int i) { return flights_.stays_low(i, rate[i], a[i]); });
  };
  if (!stay_low(before)) return false;
  const auto plastic = laws_.impact(solution.q, instant.v_minus, instant.touching, all);
  return plastic.failure.empty() && stay_low(J.transpose() * plastic.motion);
}

/// For each contact, whether its impact ends an accumulation, see (3) and (4) of Flights.
std::vector<char> ModeChanges::last_impacts(const Instant& instant, const Solution& solution) {
  if (instant.ends_together) return std::vector<char>(modes_.size(), true);
  motion_.accelerate(solution.q, solution.v);
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector rate = J.transpose() * instant.v_minus,
               a = J.transpose() * motion_.acceleration() + problem_.gap_acceleration_bias(solution.q, instant.v_minus);
  std::vector<char> last(modes_.size(), false);
  for (const int i : instant.touching)
    last[i] = !is_closed(instant.before[i]) && rate[i] < 0 && flights_.is_last(i, rate[i], a[i]);
  return last;
}

/// Closes the groups that are at rest, and leaves wedges to sink. Whether there are any.
bool ModeChanges::settle(Instant& instant, Solution& solution) {
  const auto rest = groups_.find(solution.q, solution.v, modes_);
  leave_to_sink(rest.wedged, solution);
  std::erase_if(instant.touching, [&](int i) { return std::ranges::count(rest.wedged, i) > 0; });
  if (rest.contacts.empty()) return !rest.wedged.empty();
  has_groups_ = true;
  solution.q = rest.q;
  solution.v = rest.v;
  if (instant.impact.normal.size() == 0) instant.impact.normal.setZero(n_c_);
  instant.impact.normal += rest.impulse;
  for (const int i : rest.contacts) {
    flights_.end_sinking(i);
    if (std::ranges::find(instant.touching, i) == instant.touching.end()) instant.touching.push_back(i);
  }
  return true;
}

void ModeChanges::leave_to_sink(const std::vector<int>& contacts, const Solution& solution, double factor) {
  if (contacts.empty()) return;
  has_groups_ = true;
  const Vector gap = problem_.gap(solution.q), depth = groups_.heights(solution.q);
  const Vector speed = groups_.slow(solution.q, solution.v, modes_, factor);
  for (const int i : contacts) {
    flights_.let_sink(i, gap[i], depth[i], speed[i]);
    modes_[i] = ContactMode::open;
  }
}

/// Open contacts that have sunk rise to zero again, or sink by another height.
void ModeChanges::keep_sunk(const Solution& solution) {
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector gap = problem_.gap(solution.q), depth = groups_.heights(solution.q);
  const Vector rate = J.transpose() * solution.v, resting = kSame * scales_.speed(J, solution.v);
  const Vector speed = groups_.slow(solution.q, solution.v, modes_);
  for (const int i : problem_.info().unilateral) {
    const bool has_room = flights_.is_sinking(i) && gap[i] + flights_.offset()[i] > 0.1 * depth[i];
    if (!is_closed(modes_[i]) && std::abs(rate[i]) > resting[i] && gap[i] < -kTouching / tolerance_ * depth[i] &&
        !has_room)
      flights_.let_sink(i, gap[i], depth[i], std::max(speed[i], std::numeric_limits<double>::min()));
  }
}

/// Whether a touching contact approaches.
bool ModeChanges::approaches(const Instant& instant, const Solution& solution) const {
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector rate = J.transpose() * solution.v, rate_size = scales_.speed(J, instant.v_minus);
  return std::ranges::any_of(instant.touching, [&](int i) { return rate[i] < -kSame * rate_size[i]; });
}

/// Whether all contacts with an impulse are at rest: the order of the impacts does not matter then (resting_groups.h).
bool ModeChanges::rest_after_impacts(const Instant& instant, const Solution& solution) const {
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector rate = J.transpose() * solution.v, rate_size = scales_.speed(J, instant.v_minus);
  return std::ranges::all_of(instant.touching,
                             [&](int i) { return instant.impact.normal[i] == 0 || rate[i] <= kSame * rate_size[i]; });
}

/// Removes the rate of closed contacts and the slip of sticking contacts that are errors of the integration. Otherwise
/// an impact would treat them as motion and ignore such a contact.
bool ModeChanges::remove_drift(double t, Instant& instant, Solution& solution) const {
  auto closed = problem_.info().bilateral;
  std::vector<char> sticks(modes_.size(), false);
  for (const int i : instant.touching) {
    if (is_closed(instant.before[i])) closed.push_back(i);
    sticks[i] = instant.before[i] == ContactMode::stick;
  }
  if (!laws_.project(solution.q, solution.v, {}, closed, sticks))
    return stop(solution, Status::inner_solver_failed, t, kNoProjection);
  instant.v_minus = solution.v;
  return true;
}

/// Excludes from the next impact contacts at rest that the load opens, unless they were closed and have had no impulse.
/// The flight before the impact is short, but not zero.
bool ModeChanges::leave_out_opening(double t, const Instant& instant, const Vector& rate, const Vector& rate_size,
                                    std::vector<int>& meeting, Solution& solution) const {
  const auto may_open = [&](int i) { return !is_closed(instant.before[i]) || instant.impact.normal[i] > 0; };
  std::vector<int> resting;
  std::ranges::copy_if(meeting, std::back_inserter(resting),
                       [&](int i) { return std::abs(rate[i]) <= kSame * rate_size[i]; });
  if (std::ranges::none_of(resting, may_open)) return true;
  const Matrix J_t = problem_.tangent_jacobian(solution.q);
  std::vector<Vector> directions(modes_.size());
  for (const int i : resting) {
    if (!slips_.has_friction(i)) continue;
    const Vector slip = slips_.velocity(i, J_t, solution.v);
    if (slip.norm() > kSame * slips_.size(i, J_t, solution.v)) directions[i] = slip.normalized();
  }
  const auto decision = laws_.decide(solution.q, solution.v, resting, directions);
  if (!decision.failure.empty())
    return stop(solution, Status::inner_solver_failed, t, decision.failure, decision.reason);
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector& a = decision.motion;
  const Vector apart = J.transpose() * a + problem_.gap_acceleration_bias(solution.q, solution.v);
  const Vector size = J.cwiseAbs().transpose() * a.cwiseAbs();
  for (std::size_t k = 0; k < resting.size(); ++k) {
    const int i = resting[k];
    // Without a load a gap stays closed, and rounding decides its mode; the same holds for a vanishing load.
    const bool is_load = apart[i] > kSame * std::max(size[i], rate_size[i] / problem_.info().end_time);
    if (may_open(i) && is_load && !is_closed(decision.modes[k])) std::erase(meeting, i);
  }
  return true;
}

/// Applies Newton's law to the touching contacts that do not separate, and again while an impact makes separating
/// contacts approach. Separating contacts are excluded, because their restitution would move them into their surfaces.
bool ModeChanges::follow_impacts(double t, Instant& instant, Solution& solution) {
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector rate_size = scales_.speed(J, instant.v_minus);
  const auto last = last_impacts(instant, solution);
  auto& total = instant.impact;
  total.modes.assign(instant.touching.size(), ContactMode::open);
  if (total.normal.size() == 0) total.normal.setZero(n_c_);
  total.tangential.setZero(problem_.info().n_lambda_t);
  const int n = static_cast<int>(instant.touching.size()), most = most_impacts(n), few = few_impacts(n);
  for (int k = 0; k < most; ++k) {
    if (k >= few && (k - few) % n == 0) settle(instant, solution);
    const Vector rate = J.transpose() * solution.v;
    std::vector<int> meeting;
    bool approaches = false;
    for (const int i : instant.touching) {
      if (rate[i] <= kSame * rate_size[i]) meeting.push_back(i);
      approaches = approaches || rate[i] < -kSame * rate_size[i];
    }
    if (!approaches) return true;
    if (!leave_out_opening(t, instant, rate, rate_size, meeting, solution)) return false;
    const auto impact = laws_.impact(solution.q, solution.v, meeting, last);
    if (!impact.failure.empty()) return stop(solution, Status::inner_solver_failed, t, impact.failure, impact.reason);
    solution.v = impact.motion;
    total.normal += impact.normal;
    if (!problem_.info().has_friction()) continue;
    total.tangential += impact.tangential;
    std::ranges::fill(total.modes, ContactMode::open);  // a later impact may move what stuck in this one
    for (std::size_t m = 0; m < meeting.size(); ++m) {
      const auto at = std::ranges::find(instant.touching, meeting[m]) - instant.touching.begin();
      total.modes[static_cast<std::size_t>(at)] = impact.modes[m];
    }
  }
  return sink_slow(instant, solution) || flights_.stop_accumulation(t, solution);
}

/// Leaves the touching contacts that approach to sink. False if one of them is not slow.
bool ModeChanges::sink_slow(Instant& instant, const Solution& solution) {
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector rate = J.transpose() * solution.v, rate_size = scales_.speed(J, instant.v_minus);
  const Vector slow = groups_.slow(solution.q, solution.v, modes_);
  std::vector<int> approaching;
  std::ranges::copy_if(instant.touching, std::back_inserter(approaching),
                       [&](int i) { return rate[i] < -kSame * rate_size[i]; });
  if (std::ranges::any_of(approaching, [&](int i) { return slow[i] == 0; })) return false;
  leave_to_sink(approaching, solution);
  std::erase_if(instant.touching, [&](int i) { return std::ranges::count(approaching, i) > 0; });
  return true;
}

/// Impacts, if a contact approaches; then candidates for closed contacts, separating contacts, contacts without slip.
bool ModeChanges::collide(double t, Instant& instant, Solution& solution) {
  if (instant.approaches) {
    if (!remove_drift(t, instant, solution)) return false;
    if (!settle(instant, solution) || approaches(instant, solution)) {
      instant.ends_together = end_together(instant, solution);
      if (instant.is_ambiguous && !instant.ends_together && problem_.info().has_friction())
        return flights_.stop_accumulation(t, solution);
      if (!follow_impacts(t, instant, solution)) return false;
      if (instant.is_ambiguous && !instant.ends_together && !rest_after_impacts(instant, solution))
        return flights_.stop_accumulation(t, solution);
    }
  }
  const Matrix J = problem_.normal_jacobian(solution.q), J_t = problem_.tangent_jacobian(solution.q);
  const Vector rate = J.transpose() * solution.v, rate_size = scales_.speed(J, instant.v_minus);
  instant.rests.assign(modes_.size(), false);
  for (std::size_t k = 0; k < instant.touching.size(); ++k) {
    const int i = instant.touching[k];
    const bool was_closed = is_closed(instant.before[i]);
    if (rate[i] > kSame * rate_size[i] && !instant.ends_together &&
        !(was_closed && (!instant.approaches || rate[i] <= kResting * rate_size[i]))) {
      modes_[i] = ContactMode::open;
      continue;
    }
    instant.candidates.push_back(i);
    if (!slips_.has_friction(i)) continue;
    // If an impact ends a slip, the remaining slip velocity is the rounding of its law.
    const double size = slips_.size(i, J_t, instant.v_minus), zero = (instant.approaches ? kSame : kResting) * size;
    instant.rests[i] = slips_.velocity(i, J_t, solution.v).norm() <= zero;
    if (instant.approaches)
      instant.rests[i] = instant.rests[i] || instant.impact.modes[k] == ContactMode::stick;
    else if (was_closed)
      instant.rests[i] = instant.stopped[i] || instant.before[i] == ContactMode::stick;
  }
  return true;
}

/// Determines the modes of the candidates, after a projection that keeps them closed.
bool ModeChanges::decide_candidates(double t, Instant& instant, Solution& solution) {
  // Located roots have errors of 1e-14 in slip and gap, impacts have rounding errors, smooth phases a drift. The state
  // is projected at events and, for bilateral constraints, at the end: within a phase CVODE projects only with BDF, and
  // the drift of a phase is smaller than its integration error.
  const auto touching = join({problem_.info().bilateral, instant.touching, instant.released});
  auto closed = join({problem_.info().bilateral, instant.candidates});
  if (!instant.approaches) closed.insert(closed.end(), instant.released.begin(), instant.released.end());
  const Vector q = solution.q;
  if (!laws_.project(solution.q, solution.v, touching, closed, instant.rests))
    return stop(solution, Status::inner_solver_failed, t, kNoProjection);
  if (has_groups_ && !touching.empty() && !groups_.explains(touching, q, solution.q)) solution.q = q;
  if (instant.candidates.empty()) {
    dynamics_.set_modes(modes_);
    return true;
  }
  find_stopped_along(instant, solution);
  auto directions = known_directions(instant, solution);
  const auto decision = laws_.decide(solution.q, solution.v, instant.candidates, directions);
  if (!decision.failure.empty())
    return stop(solution, Status::inner_solver_failed, t, decision.failure, decision.reason);
  std::vector<char> begins(modes_.size(), false);
  for (std::size_t k = 0; k < instant.candidates.size(); ++k) {
    const int i = instant.candidates[k];
    const auto& contact = problem_.info().contacts[i];
    const bool goes_on = modes_[i] == decision.modes[k] && !instant.approaches && !instant.stopped[i];
    modes_[i] = decision.modes[k];
    begins[i] = instant.rests[i] || (goes_on && slips_.is_new(i));
    if (modes_[i] == ContactMode::slip && directions[i].size() == 0)
      directions[i] = -decision.tangential.segment(contact.tangent_index, 2).normalized();
  }
  dynamics_.set_modes(modes_);
  slips_.renew(directions, begins, solution.q, solution.v);
  return true;
}

/// Contacts whose slip ends with that of another contact, as both ends of a rod that slides on the ground.
void ModeChanges::find_stopped_along(Instant& instant, const Solution& solution) const {
  const Matrix J_t = problem_.tangent_jacobian(solution.q);
  for (const int i : instant.candidates) {
    if (instant.rests[i] || !is_slipping(instant.before[i]) || slips_.is_new(i)) continue;
    instant.stopped[i] = instant.rests[i] =
        slips_.velocity(i, J_t, solution.v).norm() <= kResting * slips_.size(i, J_t, instant.v_minus);
  }
}

/// Slip directions that are known before the accelerations: those of slipping contacts, and those of contacts at the
/// edge of their friction cone, whose slip acceleration is still zero, so that only the force determines its direction.
std::vector<Vector> ModeChanges::known_directions(const Instant& instant, const Solution& solution) const {
  std::vector<Vector> directions(modes_.size());
  const Matrix J_t = problem_.tangent_jacobian(solution.q);
  for (const int i : instant.candidates) {
    if (!slips_.has_friction(i)) continue;
    const bool goes_on = is_slipping(instant.before[i]) && !instant.approaches;
    if (instant.rests[i]) {
      if (instant.leaves_cone[i] && !instant.approaches) directions[i] = -motion_.tangential_force(i).normalized();
    } else if (goes_on && slips_.is_new(i)) {
      directions[i] = slips_.direction(i);
    } else {
      directions[i] = slips_.velocity(i, J_t, solution.v).normalized();
    }
  }
  return directions;
}

/// Slip in space that starts from rest: start_slip() integrates its first moments.
bool ModeChanges::begin_slip(double& t, Solution& solution) {
  const auto beginning = slips_.beginning(solution.q, solution.v);
  const double left = problem_.info().end_time - t;
  if (beginning.empty() || left <= 0) return true;

  Vector y(2 * n_q_), before(motion_.n_roots()), after(before.size());
  y << solution.q, solution.v;
  motion_.roots(y.data(), before.data());
  const auto keeps_modes = [&](const Vector& q, const Vector& v) {
    y << q, v;
    return motion_.roots(y.data(), after.data()) && ((before.array() <= 0) || (after.array() > 0)).all();
  };
  const auto start = start_slip(problem_, scales_, dynamics_, solution.q, solution.v, beginning,
                                {.longest_step = std::min(kSlipStart * problem_.info().end_time, left),
                                 .end = left,
                                 .tolerance = tolerance_,
                                 .keeps_modes = keeps_modes});
  if (!start) {
    return stop(solution, Status::inner_solver_failed, t,
                fmt::format("no motion follows the begin of slip at contact '{}'", name(beginning.back().contact)));
  }
  t += start->duration;
  solution.q = start->q;
  solution.v = start->v;
  slips_.follow(solution.q, solution.v);
  return true;
}

/// Records one event per contact whose mode changed or that received an impulse. False if impacts accumulate.
bool ModeChanges::record_events(double t, const Instant& instant, Solution& solution) {
  const Vector no_normal = Vector::Zero(n_c_), no_tangential = Vector::Zero(problem_.info().n_lambda_t);
  const auto& impact = instant.impact;
  std::vector<int> soon;
  for (const int i : problem_.info().unilateral) {
    const auto record = [&](EventKind kind) {
      const bool is_impact = kind == EventKind::impact;
      solution.events.push_back({t,
                                 kind,
                                 i,
                                 solution.q,
                                 instant.approaches ? instant.v_minus : solution.v,
                                 solution.v,
                                 is_impact ? impact.normal : no_normal,
                                 is_impact && impact.tangential.size() > 0 ? impact.tangential : no_tangential,
                                 modes_,
                                 {}});
    };
    const bool has_impulse = impact.normal.size() > 0 && impact.normal[i] > 0;
    const auto kind = event_kind(instant.before[i], modes_[i], has_impulse, instant.stopped[i]);
    if (!kind) continue;
    record(*kind);
    const bool is_soon = *kind == EventKind::impact && flights_.accumulates(i, t);
    if (is_soon && !is_closed(modes_[i])) soon.push_back(i);
  }
  if (soon.empty()) return true;
  const Vector slow = groups_.slow(solution.q, solution.v, modes_, kRattles);
  if (std::ranges::any_of(soon, [&](int i) { return slow[i] == 0; })) return flights_.stop_accumulation(t, solution);
  leave_to_sink(soon, solution, kRattles);
  return true;
}

}  // namespace ricochet::reference
