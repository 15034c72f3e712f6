#include "methods/contact_laws/impact_sequence.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

// Impacts at one instant that lose this few of their velocity are not followed to their end.
constexpr int kMaxImpacts = 10000;
constexpr int kFewPlastic = 8;  // impacts before plastic contacts may come to rest together
// A contact that parts faster than that many times the fastest approach is none of S.
constexpr double kParts = 8;
// Rates that are left, over the low speed.
constexpr double kLeft = 8;
constexpr double kLoad = 1e-9;  // of the approach: what a load that is none changes within the end time

}  // namespace

ImpactSequence::ImpactSequence(const Problem& problem, ContactScales& scales, ImpactSolver& law)
    : problem_(problem), scales_(scales), law_(law), rest_(problem, scales, law) {
  const ProblemInfo& info = problem.info();
  for (auto* list : {&approaching_, &candidates_, &together_, &may_open_}) list->reserve(info.contacts.size());
  resting_.reserve(info.contacts.size());
  impulse_n_.setZero(info.n_c());
  impulse_t_.setZero(info.n_lambda_t);
  gap_.setZero(info.n_c());
  v_.setZero(info.n_q);
  v_before_ = v_start_ = v_;
  Lambda_n_start_ = impulse_n_;
  Lambda_t_start_ = impulse_t_;
  for (auto* list : {&group_, &island_}) list->reserve(info.contacts.size());
  is_left_.assign(info.contacts.size(), 0);
}

void ImpactSequence::find_touching(const Vector& q, const std::vector<ContactMode>* before,
                                   std::vector<int>& touching) {
  problem_.gap(q.data(), gap_.data());
  candidates_.clear();
  std::ranges::fill(is_left_, 0);
  for (const int i : problem_.info().unilateral) {
    const bool was_closed = before && is_closed((*before)[i]);
    if (!was_closed && gap_[i] > std::max(scales_.nearly_touching(i), scales_.capture_height(i))) continue;
    candidates_.push_back(i);
    if (was_closed || gap_[i] <= scales_.touching(i)) touching.push_back(i);
  }
}

void ImpactSequence::add_touching(int contact, std::vector<int>& touching) {
  for (auto* list : {&candidates_, &touching}) {
    const auto at = std::ranges::lower_bound(*list, contact);
    if (at == list->end() || *at != contact) list->insert(at, contact);
  }
}

void ImpactSequence::record_touching(const Eigen::Ref<const Vector>& v) {
  for (const int i : candidates_) {
    scales_.record_contact(i, law_.normal(i), law_.normal_delassus(i), law_.tangential_delassus(i));
    scales_.record_approach(i, law_.normal_velocity_scale(i, v));
    scales_.record_slip(i, law_.slip_velocity_scale(i, v));
  }
}

void ImpactSequence::record_load(const Vector& q, const Vector& v, double H) {
  const Vector& w = law_.free_acceleration(q, v);
  for (const int i : candidates_) {
    const double load = law_.normal_velocity_scale(i, w), force = load / law_.normal_delassus(i);
    const double slip =
        law_.slip_velocity_scale(i, w) + problem_.info().contacts[i].mu * force * law_.tangential_delassus(i);
    scales_.record_force(i, force);
    scales_.record_approach(i, H * load);
    scales_.record_slip(i, H * slip);
  }
}

/// Records in the scales what the impact has done to the contacts that touch, with or without an impulse of their own.
void ImpactSequence::record_impact(const Eigen::Ref<const Vector>& v) {
  const Vector& size = law_.impulse_size(together_, impulse_n_, impulse_t_);
  for (const int i : candidates_) {
    scales_.record_approach(i, law_.normal_velocity_scale(i, size));
    scales_.record_slip(i, law_.slip_velocity_scale(i, size));
  }
  for (const int i : together_) {
    scales_.record_approach(i, law_.normal_velocity_scale(i, v));
    scales_.record_slip(i, problem_.info().contacts[i].mu * impulse_n_[i] * law_.tangential_delassus(i));
  }
}

/// Whether a contact needs an impulse. An approach that is only rounding of cancelled velocities does not count.
bool ImpactSequence::approaches(int contact, const Eigen::Ref<const Vector>& v) const {
  return law_.normal_velocity(contact, v) < -scales_.no_approach(contact) && !is_left_[contact];
}

/// The contacts of together_ that need an impulse, in approaching_.
bool ImpactSequence::find_approaching(const Eigen::Ref<const Vector>& v) {
  approaching_.clear();
  for (const int i : together_) {
    if (approaches(i, v)) approaching_.push_back(i);
  }
  return !approaching_.empty();
}

/// Whether a contact that approaches closes at this instant: in its flight no velocity would change.
bool ImpactSequence::closes_now(int contact, const Vector& q, const Eigen::Ref<const Vector>& v) {
  const double gap = gap_[contact];
  if (gap <= scales_.touching(contact)) return true;
  const double flight = gap / -law_.normal_velocity(contact, v);
  v_ = v;
  const Vector& w = law_.free_acceleration(q, v_);
  return flight * law_.normal_velocity_scale(contact, w) <= ContactScales::kStageRounding * scales_.approach(contact);
}

bool ImpactSequence::rests(int contact, const Eigen::Ref<const Vector>& v) const {
  return std::abs(law_.normal_velocity(contact, v)) <= scales_.no_approach(contact) && !is_left_[contact];
}

/// Adds the contacts of may_open_ to together_, unless the load pulls them apart. False when it has no forces. Only the
/// islands of what approaches count: the impact does not change others.
bool ImpactSequence::add_unless_pulled_apart(const Vector& q, const Eigen::Ref<const Vector>& v) {
  if (may_open_.empty()) return true;
  find_approaching(v);
  group_ = together_;
  group_.insert(group_.end(), may_open_.begin(), may_open_.end());
  std::ranges::sort(group_);
  law_.keep_islands_of(approaching_, group_);
  std::erase_if(may_open_, [&](int i) { return !std::ranges::binary_search(group_, i); });
  if (may_open_.empty()) return true;
  resting_.clear();
  for (const int i : group_) {  // those of together_ hold the others
    if (rests(i, v) || std::ranges::binary_search(may_open_, i)) resting_.push_back({.contact = i});
  }
  v_ = v;
  if (law_.contact_forces(q, v_, resting_, impulse_n_, impulse_t_) != LcpStatus::solved) return false;
  for (const auto& closed : resting_) {
    const int i = closed.contact;
    if (!std::ranges::binary_search(may_open_, i)) continue;
    // A load that vanishes is rounding of q; one that presses has the rounding of a light body's acceleration.
    const bool is_load = law_.gap_acceleration(i) * problem_.info().end_time > kLoad * scales_.approach(i);
    const bool opens = closed.mode == ContactMode::open && is_load && law_.is_pulled_apart(i);
    if (!opens) together_.push_back(i);
  }
  std::ranges::sort(together_);
  return true;
}

/// S_1, in together_: empty where nothing approaches. False when the load has no forces.
bool ImpactSequence::find_first(const Vector& q, const Eigen::Ref<const Vector>& v,
                                const std::vector<ContactMode>* before, const std::vector<int>& touching) {
  together_.clear();
  may_open_.clear();
  for (const int i : touching) {
    const bool was_closed = before && is_closed((*before)[i]);
    // Bodies that move side by side without a force drift by rounding of the stages.
    if (!was_closed && law_.normal_velocity(i, v) > scales_.no_drift(i)) continue;
    (was_closed || approaches(i, v) ? together_ : may_open_).push_back(i);
  }
  return !find_approaching(v) || add_unless_pulled_apart(q, v);
}

/// S_k after an impact, in together_. False when the load has no forces.
bool ImpactSequence::find_next(const Vector& q, const Eigen::Ref<const Vector>& v,
                               const Eigen::Ref<const Vector>& Lambda_n, const std::vector<ContactMode>* before,
                               const std::vector<int>& touching) {
  together_.clear();
  may_open_.clear();
  for (const int i : candidates_) {
    if (approaches(i, v) && (Lambda_n[i] > 0 || closes_now(i, q, v))) together_.push_back(i);
  }
  if (together_.empty()) return true;
  for (const int i : candidates_) {
    if (!rests(i, v) || std::ranges::count(together_, i) > 0) continue;
    const bool was_closed = before && is_closed((*before)[i]);
    if (Lambda_n[i] > 0 || (!was_closed && std::ranges::binary_search(touching, i)))
      may_open_.push_back(i);
    else if (was_closed)
      together_.push_back(i);
  }
  std::ranges::sort(together_);
  return add_unless_pulled_apart(q, v);
}

ImpactSequence::Outcome ImpactSequence::apply_impacts(const Vector& q, const std::vector<ContactMode>* before,
                                                      std::vector<int>& touching, Eigen::Ref<Vector> v,
                                                      Eigen::Ref<Vector> Lambda_n, Eigen::Ref<Vector> Lambda_t) {
  v_start_ = v;
  Lambda_n_start_ = Lambda_n;
  Lambda_t_start_ = Lambda_t;
  const std::size_t n_kept = kept_ ? kept_->size() : 0;
  Outcome outcome = follow_impacts(q, before, touching, v, Lambda_n, Lambda_t);
  while (outcome.result == Result::done && outcome.n_impacts > 1) {
    impulse_n_ = Lambda_n - Lambda_n_start_;
    if (!leave_wedge(candidates_, q, v_start_)) break;
    v = v_start_;  // none of its impacts alone showed it
    Lambda_n = Lambda_n_start_;
    Lambda_t = Lambda_t_start_;
    if (kept_) kept_->resize(n_kept);
    outcome = follow_impacts(q, before, touching, v, Lambda_n, Lambda_t);
  }
  if (outcome.result != Result::done || outcome.n_impacts == 0) return outcome;
  for (const int i : candidates_) {
    if (Lambda_n[i] > 0 && std::ranges::count(touching, i) == 0) touching.push_back(i);
  }
  std::ranges::sort(touching);
  return outcome;
}

ImpactSequence::Outcome ImpactSequence::follow_impacts(const Vector& q, const std::vector<ContactMode>* before,
                                                       const std::vector<int>& touching, Eigen::Ref<Vector> v,
                                                       Eigen::Ref<Vector> Lambda_n, Eigen::Ref<Vector> Lambda_t) {
  Outcome outcome;
  const auto failed = [&](Result result) {
    outcome.result = result;
    return outcome;
  };
  bool has_forces = find_first(q, v, before, touching);
  const int most = most_followed(candidates_.size());
  int followed = candidates_are_plastic() ? std::min(kFewPlastic, most) : most;
  while (find_approaching(v)) {
    outcome.failed_contact = approaching_.front();
    if (!has_forces) {
      if (!is_slow(q, v)) return failed(Result::no_forces);
      leave_approaching();
      break;
    }
    if (outcome.n_impacts == followed) {
      if (come_to_rest(q, v, Lambda_n, Lambda_t, outcome.n_impacts < most)) break;
      if (outcome.n_impacts >= most && is_slow(q, v)) {
        leave_approaching();
        break;
      }
      if (outcome.n_impacts >= most && is_wedge_at_last(q, Lambda_n)) break;
      followed = followed < most ? std::min(2 * followed, most) : 2 * followed;
    }
    if (outcome.n_impacts == kMaxImpacts) return failed(Result::accumulates);
    ++outcome.n_impacts;
    impulse_n_.setZero();
    impulse_t_.setZero();
    if (kept_) kept_->push_back({.v_minus = v});
    v_before_ = v;
    const bool is_solved = law_.impact(together_, approaching_, v, impulse_n_, impulse_t_) == LcpStatus::solved;
    if (!is_solved && !is_slow(q, v_before_)) return failed(Result::no_impulse);
    if (!is_solved || leave_wedge(together_, q, v_before_)) {
      v = v_before_;
      if (kept_) kept_->pop_back();
      if (!is_solved) leave_approaching();
      --outcome.n_impacts;
      continue;
    }
    if (kept_) kept_->back() = {kept_->back().v_minus, v, impulse_n_, impulse_t_};
    if (impulse_n_.isZero(0) && impulse_t_.isZero(0)) break;  // the impact law takes what is left for rounding
    record_impact(v);
    Lambda_n += impulse_n_;
    Lambda_t += impulse_t_;
    has_forces = find_next(q, v, Lambda_n, before, touching);
  }
  return outcome;
}

double ImpactSequence::fastest_approach(const Eigen::Ref<const Vector>& v) const {
  double fastest = 0;
  for (const int i : approaching_) fastest = std::max(fastest, -law_.normal_velocity(i, v));
  return fastest;
}

/// The wedge that impulse_n_ shows among `contacts`. Empty where there is none, and where it has been left before.
std::span<const int> ImpactSequence::find_wedge(const std::vector<int>& contacts, const Vector& q,
                                                const Eigen::Ref<const Vector>& v) {
  if (contacts.size() < 2) return {};
  const auto& wedge = rest_.find_wedge(contacts, impulse_n_);
  const bool is_new = std::ranges::any_of(wedge, [&](int i) { return is_left_[i] == 0; });
  return is_new && rest_.low_speed(q, v, candidates_) > 0 ? wedge : std::span<const int>();
}

/// Takes the contacts of a wedge out of the impacts of this instant. False where there is none.
bool ImpactSequence::leave_wedge(const std::vector<int>& contacts, const Vector& q, const Eigen::Ref<const Vector>& v) {
  const auto wedge = find_wedge(contacts, q, v);
  if (wedge.empty()) return false;
  for (const int i : wedge) is_left_[i] = 1;
  std::erase_if(together_, [&](int i) { return is_left_[i] != 0; });
  return true;
}

/// Whether the impacts of the instant together show a wedge: apply_impacts() leaves it.
bool ImpactSequence::is_wedge_at_last(const Vector& q, const Eigen::Ref<const Vector>& Lambda_n) {
  impulse_n_ = Lambda_n - Lambda_n_start_;
  return !find_wedge(candidates_, q, v_start_).empty();
}

/// Leaves the rates of what still approaches.
void ImpactSequence::leave_approaching() {
  for (const int i : approaching_) is_left_[i] = 1;
}

/// Whether what still approaches may be left.
bool ImpactSequence::is_slow(const Vector& q, const Eigen::Ref<const Vector>& v) {
  return fastest_approach(v) <= kLeft * rest_.low_speed(q, v, candidates_);
}

/// Whether all candidates have eps_r = 0 and no friction.
bool ImpactSequence::candidates_are_plastic() const {
  return std::ranges::all_of(candidates_, [&](int i) {
    const auto& contact = law_.contact(i);
    return contact.n_t == 0 && contact.eps_r == 0;
  });
}

/// Whether all islands of group_ that still approach have a contact that is not elastic: else no energy is lost there, and
/// the impacts have no limit.
bool ImpactSequence::loses_energy() {
  return std::ranges::all_of(approaching_, [&](int i) {
    island_ = group_;
    law_.keep_islands_of({&i, 1}, island_);
    return std::ranges::any_of(island_, [&](int k) { return !law_.contact(k).is_elastic(); });
  });
}

/// (2). @param all  only if every contact of the group is at rest then
bool ImpactSequence::come_to_rest(const Vector& q, Eigen::Ref<Vector> v, Eigen::Ref<Vector> Lambda_n,
                                  Eigen::Ref<Vector> Lambda_t, bool all) {
  const double fastest = fastest_approach(v);
  group_.clear();
  for (const int i : candidates_) {
    const bool takes_part = Lambda_n[i] > 0 || std::ranges::binary_search(together_, i);
    if (takes_part && law_.normal_velocity(i, v) <= kParts * fastest) group_.push_back(i);
  }
  if (!loses_energy()) return false;
  v_ = v;
  impulse_n_.setZero();
  impulse_t_.setZero();
  if (law_.impact(group_, approaching_, v_, impulse_n_, impulse_t_, ImpactSolver::Rebound::none) != LcpStatus::solved ||
      !rest_.is_explained_by_rates(group_, q, v, v_) || !rest_.find_wedge(group_, impulse_n_).empty())
    return false;
  const auto rests_now = [&](int i) { return law_.normal_velocity(i, v_) <= scales_.no_drift(i); };
  if (all && !std::ranges::all_of(group_, rests_now)) return false;
  if (kept_) kept_->push_back({v, v_, impulse_n_, impulse_t_});
  v = v_;
  record_impact(v);
  Lambda_n += impulse_n_;
  Lambda_t += impulse_t_;
  return true;
}

bool ImpactSequence::apply_impact(Eigen::Ref<Vector> v, Eigen::Ref<Vector> Lambda_n, Eigen::Ref<Vector> Lambda_t) {
  return !find_approaching(v) || law_.impact(together_, approaching_, v, Lambda_n, Lambda_t) == LcpStatus::solved;
}

}  // namespace ricochet
