#include "reference/dipping_gaps.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_roots.h>

#include <functional>
#include <memory>
#include <utility>

#include "problems/packed_column.h"

namespace ricochet::reference {
namespace {

constexpr int kPieces = 4;           // of a step, between which rates are compared: it may hold more than one extremum
constexpr int kMaxIterations = 100;  // of Brent's method, whose worst case is bisection to rounding, twice

/// Where f, of opposite signs at the ends, is zero: GSL's Brent-Dekker method, to rounding.
double root(const std::function<double(double)>& f, double from, double to) {
  const std::unique_ptr<gsl_root_fsolver, decltype(&gsl_root_fsolver_free)> solver(
      gsl_root_fsolver_alloc(gsl_root_fsolver_brent), &gsl_root_fsolver_free);
  gsl_function function{
      [](double x, void* self) { return (*static_cast<const std::function<double(double)>*>(self))(x); },
      const_cast<void*>(static_cast<const void*>(&f))};
  gsl_root_fsolver_set(solver.get(), &function, from, to);
  for (int i = 0; i < kMaxIterations; ++i) {
    gsl_root_fsolver_iterate(solver.get());
    const double low = gsl_root_fsolver_x_lower(solver.get()), high = gsl_root_fsolver_x_upper(solver.get());
    if (gsl_root_test_interval(low, high, 0, 1e-15) == GSL_SUCCESS) break;
  }
  return gsl_root_fsolver_root(solver.get());
}

}  // namespace

DippingGaps::DippingGaps(const Problem& problem, const Scales& scales, const Cvode& cvode, double tolerance)
    : problem_(problem),
      scales_(scales),
      cvode_(cvode),
      tolerance_(tolerance),
      packed_n_(problem.info().n_normal_entries) {
  for (auto* rates : {&rates_, &before_, &rates_t_}) rates->setZero(problem.n_c());
}

void DippingGaps::set_rates(double t, Vector& rates) {
  Vector q, v;
  interpolate(t, q, v);
  problem_.normal_jacobian(q.data(), packed_n_.data());
  for (const int i : problem_.info().unilateral) {
    const auto& contact = problem_.info().contacts[i];
    rates[i] = packed_dot(contact, packed_n_.data() + contact.normal_begin, v);
  }
}

void DippingGaps::interpolate(double t, Vector& q, Vector& v) const {
  CVodeGetDky(cvode_.memory(), t, 0, cvode_.y());
  const double* y = N_VGetArrayPointer(cvode_.y());
  q = Eigen::Map<const Vector>(y, problem_.n_q());
  v = Eigen::Map<const Vector>(y + problem_.n_q(), problem_.n_q());
}

std::optional<DippingGaps::Closing> DippingGaps::closing(double from, double to,
                                                         const std::vector<ContactMode>& modes) {
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
  Vector q_t, v_t;
  const auto rate = [&](double t) {
    set_rates(t, rates_t_);
    return rates_t_[i];
  };
  const auto gap = [&](double t) {
    interpolate(t, q_t, v_t);
    return problem_.gap(q_t)[i];
  };
  const double lowest = root(rate, begin, end);  // (1)
  const double depth = gap(lowest), size = scales_.gap(problem_.normal_jacobian(q_t).col(i), q_t)[0];
  if (depth >= -tolerance_ * size) return std::nullopt;
  for (const double above : {begin, from}) {
    if (gap(above) > 0) return Closing{.contact = i, .t = root(gap, above, lowest)};
  }
  return std::nullopt;
}

}  // namespace ricochet::reference
