#include "methods/event_driven/step_ends.h"

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
  for (Eigen::Index k = 0; k < q0.size(); ++k) {
    const QuinticBernstein p(q0[k], h * v0[k], h * h * a0[k], q1[k], h * v1[k], h * h * a1[k]);
    for (int j = 0; j < 6; ++j) path(k, j) = p.b[j];
    error[k] = p.error();
  }
}

}  // namespace ricochet
