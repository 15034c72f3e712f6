#include "methods/contact_laws/group_capture.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ricochet {
namespace {

constexpr double kRaised = 0.5;  // heights
constexpr int kLowBounces = 16;  // of a contact with friction, before its group is captured

}  // namespace

GroupCapture::GroupCapture(const Problem& problem, const ContactScales& scales, ImpactSolver& law,
                           ImpactSequence& impacts, Move move)
    : info_(problem.info()),
      scales_(scales),
      law_(law),
      impacts_(impacts),
      move_(std::move(move)),
      held_(info_.contacts.size(), ContactMode::open),
      low_bounces_(info_.contacts.size(), 0) {
  for (auto* list : {&group_, &refused_, &instant_.wedge, &instant_.refused}) list->reserve(held_.size());
  instant_.rates.reserve(held_.size());
  closed_.reserve(held_.size());
  lambda_n_.setZero(info_.n_c());
  lambda_t_.setZero(info_.n_lambda_t);
  q_before_.setZero(info_.n_q);
  v_before_ = q_before_;
}

void GroupCapture::restart() {
  std::ranges::fill(low_bounces_, 0);
  begin();
}

void GroupCapture::begin() {
  refused_.clear();
  instant_.capture = {};
  for (auto* list : {&instant_.wedge, &instant_.refused}) list->clear();
  instant_.rates.clear();
  counted_ = -1;
}

void GroupCapture::accept() {
  if (counted_ >= 0) low_bounces_[static_cast<std::size_t>(counted_)] = bounces_;
  counted_ = -1;
}

/// Whether a contact is slow in the sense of group_rest.h (1).
bool GroupCapture::is_slow(int contact, const Eigen::Ref<const Vector>& v) const {
  return std::abs(law_.normal_velocity(contact, v)) <= low_speed_;
}

/// Whether a candidate is above its surface, or its gap changes.
bool GroupCapture::flies(int contact, const std::vector<int>& touching, const Vector& v) const {
  return !std::ranges::binary_search(touching, contact) ||
         std::abs(law_.normal_velocity(contact, v)) > scales_.no_approach(contact);
}

/// Whether the group need not bounce any more. With friction, the impulses of lower bounces turn its slip: then it is
/// enough when the contact that closes has bounced so often that the rules of single contacts do not end that.
bool GroupCapture::is_followed_enough(const Closing& cause, const Vector& v_minus) {
  if (cause.at_once) return true;
  if (cause.contact < 0) return false;
  counted_ = cause.contact;
  bounces_ = is_slow(counted_, v_minus) ? low_bounces_[static_cast<std::size_t>(counted_)] + 1 : 0;
  const bool is_left = std::ranges::any_of(impacts_.candidates(), [&](int i) { return impacts_.is_left(i); });
  const bool has_friction = std::ranges::any_of(group_, [&](int i) { return info_.contacts[i].n_t > 0; });
  return !has_friction || bounces_ > kLowBounces || is_left || cause.has_sunk;
}

/// Lets a contact sink that opens and closes again and again in hops that are rounding.
void GroupCapture::leave_unsteady(const Closing& cause, const Vector& v_minus) {
  if (cause.contact < 0 || impacts_.candidates().size() < 2) return;
  if (std::abs(law_.normal_velocity(cause.contact, v_minus)) > scales_.no_drift(cause.contact)) return;
  counted_ = cause.contact;
  bounces_ = low_bounces_[static_cast<std::size_t>(counted_)] + 1;
  if (info_.contacts[cause.contact].n_t > 0 && bounces_ <= kLowBounces) return;
  bounces_ = 0;
  refused_.push_back(counted_);
}

/// The contacts of group_rest.h (1), in group_. False where the other rules close all of them.
bool GroupCapture::find_group(const std::vector<int>& touching, const Vector& q, const Vector& v) {
  group_.clear();
  const auto& candidates = impacts_.candidates();
  if (candidates.size() < 2 || !(scales_.capture_height(candidates.front()) > 0)) return false;
  const auto in_flight = [&](int i) { return flies(i, touching, v); };
  if (std::ranges::none_of(candidates, in_flight)) return false;  // before the load is evaluated
  low_speed_ = impacts_.rest().low_speed(q, v, candidates);
  for (const int i : candidates) {
    if (is_slow(i, v)) group_.push_back(i);
  }
  return group_.size() > 1 && std::ranges::any_of(group_, in_flight);
}

/// Leaves in group_ the contacts that satisfy group_rest.h (2). False when the load has no forces.
bool GroupCapture::drop_high_bounces(const Vector& q, const Vector& v) {
  const auto is_high = [&](int i) {
    const double rate = law_.normal_velocity(i, v);
    return std::abs(rate) > scales_.no_approach(i) &&
           rate * rate > 2 * lambda_n_[i] * law_.normal_delassus(i) * scales_.capture_height(i);
  };
  do {
    closed_.clear();
    for (const int i : group_) {
      closed_.push_back({.contact = i});
      if (law_.contact(i).n_t > 0) law_.set_slide(closed_.back(), v, scales_.no_slip(i));
    }
    if (law_.contact_forces(q, v, closed_, lambda_n_, lambda_t_) != LcpStatus::solved) return false;
  } while (std::erase_if(group_, is_high) > 0 && !group_.empty());
  return true;
}

bool GroupCapture::leave_wedge(std::vector<ImpactSolver::ClosedContact>& closed, const Vector& lambda_n) {
  if (closed.size() < 2 || !(scales_.capture_height(closed.front().contact) > 0)) return false;
  group_.clear();
  for (const auto& contact : closed) group_.push_back(contact.contact);
  const auto& wedge = impacts_.rest().find_wedge(group_, lambda_n);
  refuse_wedge(wedge);
  std::erase_if(closed, [&](const auto& contact) { return std::ranges::count(wedge, contact.contact) > 0; });
  return !wedge.empty();
}

void GroupCapture::refuse_wedge(const std::vector<int>& wedge) {
  refused_.insert(refused_.end(), wedge.begin(), wedge.end());
  instant_.wedge.insert(instant_.wedge.end(), wedge.begin(), wedge.end());
}

void GroupCapture::add_left(const Vector& v) {
  for (const int i : impacts_.candidates()) {
    if (!impacts_.is_left(i)) continue;
    refused_.push_back(i);
    instant_.wedge.push_back(i);
  }
  instant_.refused.assign(refused_.begin(), refused_.end());
  for (auto* list : {&instant_.wedge, &instant_.refused}) {
    std::ranges::sort(*list);
    list->erase(std::ranges::unique(*list).begin(), list->end());
  }
  for (const int i : instant_.refused) instant_.rates.push_back(law_.normal_velocity(i, v));
}

/// The motion that the closing of group_ at v_before_ removes: gaps, and bounces up to the heights of group_rest.h (2).
CapturedGroup GroupCapture::removed() const {
  CapturedGroup capture{.n_contacts = static_cast<int>(group_.size())};
  const auto rate = [&](int i) { return std::abs(law_.normal_velocity(i, v_before_)); };
  for (const int i : group_) {
    capture.speed = std::max(capture.speed, rate(i));
    capture.height = std::max(capture.height, std::abs(impacts_.gaps()[i]));
  }
  for (const auto& closed : closed_) {  // those with a load
    const int i = closed.contact;
    if (rate(i) <= scales_.no_approach(i)) continue;
    const double a = lambda_n_[i] * law_.normal_delassus(i);  // not zero, by (2)
    capture.height = std::max(capture.height, 0.5 * rate(i) * rate(i) / a);
  }
  return capture;
}

/// Moves (q, v) to where the group has neither gaps nor rates, with the slip of contacts that stuck.
bool GroupCapture::move_to_rest(const std::vector<ContactMode>* before, Vector& q, Vector& v) {
  for (std::size_t i = 0; i < held_.size(); ++i)
    held_[i] = info_.contacts[i].is_bilateral ? ContactMode::closed : ContactMode::open;
  for (const int i : group_)
    held_[i] = before && (*before)[i] == ContactMode::stick ? ContactMode::stick : ContactMode::closed;
  return move_(held_, q, v);
}

/// Adds to the group the contacts without a load that v lets approach.
bool GroupCapture::add_approaching(const Vector& v) {
  const std::size_t n = group_.size();
  for (const int i : impacts_.candidates()) {
    const bool approaches = law_.normal_velocity(i, v) < -scales_.no_approach(i);
    if (approaches && impacts_.gaps()[i] <= scales_.nearly_touching(i) && std::ranges::count(group_, i) == 0)
      group_.push_back(i);
  }
  return group_.size() > n;
}

bool GroupCapture::apply(const Closing& cause, const std::vector<ContactMode>* before, const Vector& v_minus,
                         std::vector<int>& touching, Vector& q, Vector& v) {
  if (find_group(touching, q, v) && is_followed_enough(cause, v_minus) && close(before, touching, q, v)) return true;
  leave_unsteady(cause, v_minus);
  return false;
}

bool GroupCapture::raise_sunk(const std::vector<int>& touching, Vector& q, Vector& v) {
  group_.clear();
  for (const int i : touching) {
    if (impacts_.gaps()[i] < -kRaised * scales_.capture_height(i)) group_.push_back(i);
  }
  if (group_.empty()) return false;
  q_before_ = q;
  v_before_ = v;
  const bool is_moved = move_to_rest(nullptr, q, v);
  v = v_before_;
  if (is_moved && impacts_.rest().is_explained_by_gaps(group_, impacts_.gaps(), q_before_, q)) return true;
  q = q_before_;
  return false;
}

/// Closes group_ if it is at rest.
bool GroupCapture::close(const std::vector<ContactMode>* before, std::vector<int>& touching, Vector& q, Vector& v) {
  for (bool has_wedge = true; has_wedge;) {
    if (!drop_high_bounces(q, v) || group_.size() < 2) return false;
    const auto& wedge = impacts_.rest().find_wedge(group_, lambda_n_);
    has_wedge = !wedge.empty();
    refuse_wedge(wedge);
    std::erase_if(group_, [&](int i) { return std::ranges::count(wedge, i) > 0; });
  }
  if (std::ranges::none_of(group_, [&](int i) { return flies(i, touching, v); })) return false;
  q_before_ = q;
  v_before_ = v;
  bool is_moved = true;
  do {
    q = q_before_;
    v = v_before_;
    is_moved = move_to_rest(before, q, v);
  } while (is_moved && add_approaching(v));
  auto& rest = impacts_.rest();
  if (is_moved && rest.is_explained_by_rates(group_, q_before_, v_before_, v) &&
      rest.is_explained_by_gaps(group_, impacts_.gaps(), q_before_, q)) {
    for (const int i : group_) {
      if (!std::ranges::binary_search(touching, i)) impacts_.add_touching(i, touching);
    }
    instant_.capture = removed();
    return true;
  }
  q = q_before_;
  v = v_before_;
  refused_.insert(refused_.end(), group_.begin(), group_.end());
  return false;
}

}  // namespace ricochet
