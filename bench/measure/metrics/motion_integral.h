#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "problems/solution.h"

namespace ricochet {

/// Three Gauss points in [0, 1] with their weights: a step of a method moves by polynomials of a low degree.
inline const std::array<std::pair<double, double>, 3> kGauss = {
    {{0.5 - std::sqrt(0.15), 5. / 18}, {0.5, 8. / 18}, {0.5 + std::sqrt(0.15), 5. / 18}}};

/// The largest so far: fmax() takes a NaN for nothing measured yet.
inline void raise_to(double& most, double value) {
  most = std::fmax(most, value);
}

/// The sum so far, where a NaN is nothing measured yet.
inline void add_to(double& sum, double value) {
  sum = std::isnan(sum) ? value : sum + value;
}

/// Begin and end of a piece of a motion, and in between the times of those events that `is_cut` says [s].
template <class IsCut>
std::vector<double> cuts_of(const Motion& motion, std::size_t piece, const std::vector<Event>& events,
                            const IsCut& is_cut) {
  const double begin = motion.begin_of(piece), end = motion.end_of(piece);
  std::vector<double> times = {begin};
  for (auto event = std::ranges::upper_bound(events, begin, {}, &Event::t); event != events.end() && event->t < end;
       ++event) {
    if (is_cut(*event)) times.push_back(event->t);
  }
  times.push_back(end);
  return times;
}

}  // namespace ricochet
