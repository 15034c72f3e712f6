#include "reference/flights.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "reference/stop.h"

namespace ricochet::reference {
namespace {

// Flights shorter than this fraction of end_time could end within the first step of an integrator.
constexpr double kShortFlight = 1e-3;

// Ratio of an offset to local errors of a gap.
constexpr double kErrors = 10;

}  // namespace

std::vector<char> Flights::in_flight() const {
  std::vector<char> flies = in_flight_;
  for (std::size_t i = 0; i < flies.size(); ++i) {
    if (offset_[static_cast<Eigen::Index>(i)] > 0) flies[i] = false;
  }
  return flies;
}

double Flights::closing_time(double gap, double rate, double a) {
  if (a == 0) return rate < 0 ? -gap / rate : INFINITY;
  const double discriminant = rate * rate - 2 * a * gap;
  if (discriminant < 0 || (a > 0 && rate >= 0)) return INFINITY;
  // The larger root for a < 0 and the smaller one for a > 0, by the form that does not cancel.
  const double root = std::sqrt(discriminant);
  return rate > 0 ? -(rate + root) / a : 2 * gap / (root - rate);
}

void Flights::start(double t, const Vector& q, const Vector& v, const Vector& a,
                    const std::vector<ContactMode>& modes) {
  t_ = t;
  shortest_ = 0;
  const Matrix J = problem_.normal_jacobian(q);
  const Vector gap = problem_.gap(q), rate = J.transpose() * v;
  const Vector gap_size = scales_.gap(J, q), rate_size = scales_.speed(J, v);
  low_ = kErrors * tolerance_ * gap_size;
  flat_ = kTouching * gap_size;
  const Vector bias = problem_.gap_acceleration_bias(q, v), acceleration = J.transpose() * a + bias;
  const Vector acceleration_size = J.cwiseAbs().transpose() * a.cwiseAbs() + bias.cwiseAbs();
  for (const int i : problem_.info().unilateral) {
    const bool is_open = !is_closed(modes[i]), at_surface = is_open && gap[i] <= low_[i];
    const bool is_above = in_flight_[i] && offset_[i] == 0 && gap[i] > flat_[i];  // also at the top of its flight
    const bool just_opens = at_surface && !is_above && std::abs(rate[i]) <= kSame * rate_size[i];
    in_flight_[i] = is_open;
    if (sinking_[i] > 0 && is_open && gap[i] <= offset_[i]) {
      moves_along_[i] = false;
      height_[i] = 0;
      continue;
    }
    sinking_[i] = 0;
    offset_[i] = just_opens ? low_[i] : 0;
    moves_along_[i] = just_opens && std::abs(acceleration[i]) <= kSame * acceleration_size[i];
    height_[i] = at_surface && !just_opens && rate[i] > 0 ? -0.5 * rate[i] * rate[i] / acceleration[i] : 0;
    if (!is_open || just_opens) continue;
    const double flight = closing_time(std::max(0.0, gap[i]), rate[i], acceleration[i]);
    if (!(flight > 0 && flight < kShortFlight * problem_.info().end_time)) continue;
    if (shortest_ == 0 || flight < shortest_) shortest_ = flight;
  }
}

void Flights::follow(const Vector& q) {
  if (offset_.isZero(0)) return;
  const Vector gap = problem_.gap(q);
  for (const int i : problem_.info().unilateral) {
    if (gap[i] > offset_[i]) offset_[i] = sinking_[i] = 0;
  }
}

bool Flights::accumulates(int i, double t) {
  const double interval = last_impact_[i] >= 0 ? t - last_impact_[i] : INFINITY;
  last_impact_[i] = t;
  return interval < zeno_interval_ ||
         (height_[i] > 0 && std::max(height_[i], rebound_[i]) < flat_[i] && interval < kAccumulation * zeno_interval_);
}

bool Flights::stop_accumulation(double t, Solution& solution) const {
  std::vector<std::string> names;
  for (const int i : problem_.info().unilateral) {
    if (last_impact_[i] >= 0 && t - last_impact_[i] < kAccumulation * zeno_interval_)
      names.push_back(problem_.info().contacts[i].name);
  }
  const std::string of = names.empty() ? "impacts"
                                       : fmt::format("the impacts of contact{} '{}'", names.size() > 1 ? "s" : "",
                                                     fmt::join(names, "', '"));
  return stop(solution, Status::step_limit, t, of + " accumulate (Zeno); event location cannot pass",
              {FailureCode::impacts_accumulate, names});
}

}  // namespace ricochet::reference
