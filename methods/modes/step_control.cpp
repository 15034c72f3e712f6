#include "methods/modes/step_control.h"

namespace ricochet {

double first_length(StepScheme& step, ModeDynamics& dynamics, double tolerance, double T) {
  StepEnds& ends = step.ends;
  const double n = 2.0 * static_cast<double>(ends.q0.size());
  const auto norm = [&](const Vector& x, const Vector& y) {  // of (x, y) as a state or as its rate
    double sum = 0;
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const double a = x[k] / (1 + std::abs(ends.q0[k])), b = y[k] / (1 + std::abs(ends.v0[k]));
      sum += a * a + b * b;
    }
    return std::sqrt(sum / n) / tolerance;
  };
  const double d0 = norm(ends.q0, ends.v0), d1 = norm(ends.v0, ends.a0);
  double h = d0 * tolerance < 1e-5 || d1 * tolerance < 1e-5 ? 1e-6 * T : 0.01 * d0 / d1;
  h = std::min(h, T);
  ends.q1 = ends.q0 + h * ends.v0;
  ends.v1 = ends.v0 + h * ends.a0;
  if (!dynamics.accelerate(ends.q1.data(), ends.v1.data(), ends.a1.data())) return h;
  const double d2 = norm(ends.v1 - ends.v0, ends.a1 - ends.a0) / h, d = std::max(d1, d2);
  const double power = std::pow(0.01 / d, 1.0 / (step.order + 1));
  return std::min({100 * h, d * tolerance <= 1e-15 ? 100 * h : power, T});
}

}  // namespace ricochet
