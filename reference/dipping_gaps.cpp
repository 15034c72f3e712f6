#include "reference/dipping_gaps.h"

#include <algorithm>
#include <utility>

#include "problems/packed_column.h"
#include "reference/bracketed_root.h"

namespace ricochet::reference {
namespace {

constexpr int kPieces = 4;  // of a step, between which rates are compared: it may hold more than one extremum

}  // namespace

DippingGaps::DippingGaps(const Problem& problem, const Scales& scales, Integrator& integrator, double tolerance)
    : problem_(problem),
      scales_(scales),
      integrator_(integrator),
      tolerance_(tolerance),
      packed_n_(problem.info().n_normal_entries) {
  for (auto* rates : {&rates_, &before_, &rates_t_}) rates->setZero(problem.n_c());
}

void DippingGaps::set_rates(double t, Vector& rates) {
  const double *q = integrator_.at(t), *v = q + problem_.n_q();
  problem_.normal_jacobian(q, packed_n_.data());
  for (const int i : problem_.info().unilateral) {
    const auto& contact = problem_.info().contacts[i];
    rates[i] = packed_dot(contact, packed_n_.data() + contact.normal_begin, v);
  }
}

std::optional<DippingGaps::Closing> DippingGaps::closing(double from, double to,
                                                         const std::vector<ContactMode>& modes) {
  const auto is_open = [&](int i) { return !is_closed(modes[i]); };
  if (std::ranges::none_of(problem_.info().unilateral, is_open)) return std::nullopt;
  std::optional<Closing> first;
  for (int piece = 0; piece < kPieces && !first; ++piece) {
    const double begin = from + (to - from) / kPieces * piece;
    const double end = piece + 1 == kPieces ? to : from + (to - from) / kPieces * (piece + 1);
    if (piece == 0) set_rates(begin, rates_);
    std::swap(before_, rates_);
    set_rates(end, rates_);
    for (const int i : problem_.info().unilateral) {
      if (is_closed(modes[i]) || !(before_[i] < 0 && rates_[i] > 0)) continue;
      const auto closing = dip(i, from, begin, end);
      if (closing && (!first || closing->t < first->t)) first = closing;
    }
  }
  return first;
}

/// Where contact i closes, whose gap has a minimum between begin and end; nothing where that is not below zero.
std::optional<DippingGaps::Closing> DippingGaps::dip(int i, double from, double begin, double end) {
  const auto q_at = [&](double t) { return Vector(Eigen::Map<const Vector>(integrator_.at(t), problem_.n_q())); };
  const auto rate = [&](double t) {
    set_rates(t, rates_t_);
    return rates_t_[i];
  };
  const auto gap = [&](double t) { return problem_.gap(q_at(t))[i]; };
  const double lowest = bracketed_root(rate, begin, end);  // (1)
  const Vector q = q_at(lowest);
  const double depth = gap(lowest), size = scales_.gap(problem_.normal_jacobian(q).col(i), q)[0];
  if (depth >= -tolerance_ * size) return std::nullopt;
  for (const double above : {begin, from}) {
    if (gap(above) > 0) return Closing{.contact = i, .t = bracketed_root(gap, above, lowest)};
  }
  return std::nullopt;
}

}  // namespace ricochet::reference
