#include "methods/step_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/packed_column.h"

namespace ricochet {
namespace {

constexpr double kRounding = 1e-9;  // gathered by a contact that stays closed for many steps
constexpr double kJump = 1e-6;      // (5), of J_n
constexpr int kHalvings = 40;       // of the line: until a smooth J_n changes by less than that

}  // namespace

StepCheck::StepCheck(const Problem& problem, double accuracy)
    : problem_(problem),
      accuracy_(std::max(accuracy, kRounding)),
      gap_(Vector::Zero(problem.n_c())),
      J_n_(Vector::Zero(problem.info().n_normal_entries)) {}

/// (4)
double StepCheck::allowed(int contact, const Vector& q, const Vector& v) {
  problem_.normal_jacobian_of({&contact, 1}, q.data(), J_n_.data());
  const auto& info = problem_.info().contacts[static_cast<std::size_t>(contact)];
  const auto sizes = 1 + q.array().abs() + problem_.info().end_time * v.array().abs();
  return accuracy_ * packed_terms(info, J_n_.data() + info.normal_begin, sizes);
}

/// The entries of J_n of a contact.
Vector StepCheck::normal(int contact, const Vector& q) {
  problem_.normal_jacobian_of({&contact, 1}, q.data(), J_n_.data());
  const auto& info = problem_.info().contacts[static_cast<std::size_t>(contact)];
  return J_n_.segment(info.normal_begin, static_cast<Eigen::Index>(info.support.size()));
}

/// (5)
bool StepCheck::passes_corner(int contact, const Vector& q0, const Vector& q) {
  Vector left = q0, right = q, J_left = normal(contact, left), J_right = normal(contact, right);
  const double least = kJump * std::max(J_left.lpNorm<Eigen::Infinity>(), J_right.lpNorm<Eigen::Infinity>());
  for (int k = 0; k < kHalvings; ++k) {
    if ((J_right - J_left).lpNorm<Eigen::Infinity>() <= least) return false;
    const Vector middle = 0.5 * (left + right), J_middle = normal(contact, middle);
    const bool is_left =
        (J_middle - J_left).lpNorm<Eigen::Infinity>() >= (J_right - J_middle).lpNorm<Eigen::Infinity>();
    (is_left ? right : left) = middle;
    (is_left ? J_right : J_left) = J_middle;
  }
  return true;
}

Status StepCheck::operator()(const Vector& q0, const Vector& q, const Vector& v, std::span<const ContactMode> modes) {
  culprit_ = -1;
  if (!q.allFinite() || !v.allFinite()) return Status::non_finite;
  if (problem_.n_c() == 0) return Status::success;
  problem_.gap(q.data(), gap_.data());
  for (int i = 0; i < problem_.n_c(); ++i) {
    const auto& contact = problem_.info().contacts[static_cast<std::size_t>(i)];
    is_closed_ = contact.is_bilateral || (!modes.empty() && is_closed(modes[static_cast<std::size_t>(i)]));
    const double violation = is_closed_ ? std::abs(gap_[i]) : -gap_[i];
    is_corner_ = is_closed_ && contact.has_corners && passes_corner(i, q0, q);
    // A gap that is no number breaks it, too.
    if (!is_corner_ && (violation <= 0 || violation <= allowed(i, q, v))) continue;
    culprit_ = i;
    return Status::infeasible;
  }
  return Status::success;
}

std::string StepCheck::message() const {
  if (culprit_ < 0) return "the state is not finite";
  const std::string& name = problem_.info().contacts[static_cast<std::size_t>(culprit_)].name;
  if (is_corner_) return fmt::format("closed contact '{}' passes a corner of its gap within the step", name);
  return fmt::format("{}contact '{}' has a gap of {:.3g} m after the step", is_closed_ ? "closed " : "", name,
                     gap_[culprit_]);
}

}  // namespace ricochet
