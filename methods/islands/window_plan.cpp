#include "methods/islands/window_plan.h"

#include <cmath>
#include <numeric>

namespace ricochet {
namespace {

constexpr double kMore = 1.5;             // times the way of (1): energy goes from one coordinate to another
constexpr double kOfMany = 8;             // of (2)
constexpr std::ptrdiff_t kMostFree = 16;  // coordinates of a part without contacts
constexpr double kBegin = 8;              // of a run, (2)

}  // namespace

WindowPlan::WindowPlan(const Problem& problem)
    : problem_(problem),
      info_(problem.info()),
      watched_(static_cast<std::size_t>(problem.n_q())),
      box_(watched_.size()),
      gaps_(problem.info().contacts.size()),
      wide_box_(watched_.size()),
      sets_(problem.n_q()),
      part_of_(watched_.size()) {
  std::iota(watched_.begin(), watched_.end(), 0);
  root_m_ = problem.mass_matrix(info_.q0).diagonal().cwiseSqrt();
  f_.setZero(info_.n_q);
}

/// (1)
void WindowPlan::bound_motion(const Vector& q, const Vector& v, double margin) {
  problem_.force(q.data(), v.data(), info_.u.data(), f_.data());
  const double P = root_m_.cwiseProduct(v).lpNorm<Eigen::Infinity>();
  const double F = f_.cwiseQuotient(root_m_).lpNorm<Eigen::Infinity>();
  const double way = kMore * (P * H_ + 0.5 * F * H_ * H_);
  for (int k = 0; k < info_.n_q; ++k) {
    const double way_k = way / root_m_[k] + margin * (1 + std::abs(q[k]));
    box_[static_cast<std::size_t>(k)] = {q[k] - way_k, q[k] + way_k};
  }
}

void WindowPlan::find_near() {
  const auto may_close = [&](int i) { return !(gaps_[static_cast<std::size_t>(i)].lower > 0); };
  if (wide_box_.follow(box_, watched_)) {
    problem_.gap_bounds(info_.unilateral, wide_box_.box().data(), gaps_.data());
    wide_.clear();
    std::ranges::copy_if(info_.unilateral, std::back_inserter(wide_), may_close);
    wide_box_.learn(wide_.size() < info_.unilateral.size(), wide_.empty());
  }
  const std::vector<int>& possible = wide_box_.exists() ? wide_ : info_.unilateral;
  problem_.gap_bounds(possible, box_.data(), gaps_.data());
  near_.clear();
  std::ranges::copy_if(possible, std::back_inserter(near_), may_close);
}

void WindowPlan::join_coordinates() {
  sets_.reset(info_.n_q);
  for (const int i : near_) sets_.join(info_.contacts[static_cast<std::size_t>(i)].support);
  parts_.clear();
  std::vector<int>& part_of = part_of_;  // of a set, by its least member, and of a coordinate without contacts
  std::ranges::fill(part_of, -1);
  for (const int i : near_) {
    int& part =
        part_of[static_cast<std::size_t>(sets_.of(info_.contacts[static_cast<std::size_t>(i)].support.front()))];
    if (part < 0) {
      part = static_cast<int>(parts_.size());
      parts_.emplace_back();
    }
    parts_[static_cast<std::size_t>(part)].contacts.push_back(i);
  }
  std::vector<int> free;
  for (int k = 0; k < info_.n_q; ++k) {
    const int part = part_of[static_cast<std::size_t>(sets_.of(k))];
    (part < 0 ? free : parts_[static_cast<std::size_t>(part)].coordinates).push_back(k);
  }
  for (auto from = free.begin(); from != free.end();) {
    const auto to = from + std::min(kMostFree, free.end() - from);
    parts_.push_back({.coordinates = {from, to}, .contacts = {}});
    from = to;
  }
}

void WindowPlan::divide(const Vector& q, const Vector& v, double H, double margin) {
  H_ = H;
  bound_motion(q, v, margin);
  find_near();
  join_coordinates();
}

double WindowPlan::work_rate(double rate) const {
  double work = 0;
  for (const Part& part : parts_) {
    const auto n = static_cast<double>(part.coordinates.size());
    const auto n_c = static_cast<double>(part.contacts.size());
    if (!part.contacts.empty()) work += rate * H_ * n * (1 + (n + n_c / kOfMany) / kOfMany);
    work += kBegin + n + n_c;
  }
  return work / H_;
}

}  // namespace ricochet
