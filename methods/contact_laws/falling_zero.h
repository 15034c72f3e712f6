#pragma once

namespace ricochet {

/// The zero of a function that is positive at `from` and not at `to`, by the Illinois method.
template <class Function>
double falling_zero(double from, double to, const Function& f) {
  constexpr double kLocated = 1e-9;  // of the interval
  constexpr int kMaxIterations = 60;
  const double width = kLocated * (to - from);
  double at_from = f(from), at_to = f(to);
  if (!(at_from > 0)) return from;
  int last = 0;
  for (int k = 0; k < kMaxIterations && to - from > width; ++k) {
    double s = to - at_to * (to - from) / (at_to - at_from);
    if (!(s > from && s < to)) s = 0.5 * (from + to);
    const double value = f(s);
    if (value > 0) {
      from = s;
      at_from = value;
      if (last == 1) at_to *= 0.5;
      last = 1;
    } else {
      to = s;
      at_to = value;
      if (value == 0) break;
      if (last == -1) at_from *= 0.5;
      last = -1;
    }
  }
  return to;
}

}  // namespace ricochet
