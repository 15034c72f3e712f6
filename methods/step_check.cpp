#include "methods/step_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/packed_column.h"

namespace ricochet {
namespace {

constexpr double kRounding = 1e-9;  // gathered by a contact that stays closed for many steps

}  // namespace

StepCheck::StepCheck(const Problem& problem, double accuracy)
    : problem_(problem),
      accuracy_(std::max(accuracy, kRounding)),
      gap_(Vector::Zero(problem.n_c())),
      J_n_(Vector::Zero(problem.info().n_normal_entries)) {}

/// (4)
double StepCheck::allowed(int contact, const Vector& q, const Vector& v) {
  problem_.normal_jacobian(q.data(), J_n_.data());
  const auto& info = problem_.info().contacts[static_cast<std::size_t>(contact)];
  const auto sizes = 1 + q.array().abs() + problem_.info().end_time * v.array().abs();
  return accuracy_ * packed_terms(info, J_n_.data() + info.normal_begin, sizes);
}

Status StepCheck::operator()(const Vector& q, const Vector& v, std::span<const ContactMode> modes) {
  culprit_ = -1;
  if (!q.allFinite() || !v.allFinite()) return Status::non_finite;
  if (problem_.n_c() == 0) return Status::success;
  problem_.gap(q.data(), gap_.data());
  for (int i = 0; i < problem_.n_c(); ++i) {
    const auto& contact = problem_.info().contacts[static_cast<std::size_t>(i)];
    is_closed_ = contact.is_bilateral || (!modes.empty() && is_closed(modes[static_cast<std::size_t>(i)]));
    const double violation = is_closed_ ? std::abs(gap_[i]) : -gap_[i];
    // A gap that is no number breaks it, too.
    if (violation <= 0 || violation <= allowed(i, q, v)) continue;
    culprit_ = i;
    return Status::infeasible;
  }
  return Status::success;
}

std::string StepCheck::message() const {
  if (culprit_ < 0) return "the state is not finite";
  return fmt::format("{}contact '{}' has a gap of {:.3g} m after the step", is_closed_ ? "closed " : "",
                     problem_.info().contacts[static_cast<std::size_t>(culprit_)].name, gap_[culprit_]);
}

}  // namespace ricochet
