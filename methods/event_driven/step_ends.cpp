#include "methods/event_driven/step_ends.h"

#include <cmath>

namespace ricochet {

void StepEnds::interpolate(double theta, Vector& q, Vector& v) const {
  if (collocation) {
    collocation->interpolate(theta, *this, q, v);
    return;
  }
  for (Eigen::Index k = 0; k < q0.size(); ++k) {
    const QuinticHermite p(q0[k], h * v0[k], h * h * a0[k], q1[k], h * v1[k], h * h * a1[k]);
    q[k] = p.value(theta);
    v[k] = p.slope(theta) / h;
  }
}

void StepEnds::bernstein(Matrix& path, Vector& error) const {
  if (collocation) {
    collocation->bernstein(*this, path);
    error.setZero();
    return;
  }
  path.col(0) = q0;
  path.col(1) = q0 + 0.2 * h * v0;
  path.col(2) = q0 + 0.4 * h * v0 + 0.05 * h * h * a0;
  path.col(3) = q1 - 0.4 * h * v1 + 0.05 * h * h * a1;
  path.col(4) = q1 - 0.2 * h * v1;
  path.col(5) = q1;
  for (Eigen::Index k = 0; k < q0.size(); ++k) {
    const QuinticHermite p(q0[k], h * v0[k], h * h * a0[k], q1[k], h * v1[k], h * h * a1[k]);
    error[k] = (std::abs(p.c[5]) + 0.25 * std::abs(p.c[4])) / 64;
  }
}

}  // namespace ricochet
