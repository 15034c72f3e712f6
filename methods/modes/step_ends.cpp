#include "methods/modes/step_ends.h"

#include "methods/contact_laws/bernstein.h"

namespace ricochet {

void StepEnds::interpolate(double theta, Vector& q, Vector& v) const {
  if (collocation) {
    collocation->interpolate(theta, *this, q, v);
    return;
  }
  interpolate_quintic(theta, h, q0, v0, a0, q1, v1, a1, q, v);
}

void StepEnds::bernstein(Matrix& path, Vector& error) const {
  if (collocation) {
    collocation->bernstein(*this, path);
    error.setZero();
  } else {
    for (Eigen::Index k = 0; k < q0.size(); ++k) {
      const QuinticBernstein p(q0[k], h * v0[k], h * h * a0[k], q1[k], h * v1[k], h * h * a1[k]);
      for (int j = 0; j < 6; ++j) path(k, j) = p.b[j];
      error[k] = p.error();
    }
  }
  raise(path, 0, degree());
}

/// From q' / h.
void StepEnds::bernstein_of_velocity(Matrix& path) const {
  const Eigen::Index n = q0.size();
  if (collocation) {
    collocation->bernstein_of_velocity(*this, path);
  } else {
    for (Eigen::Index k = 0; k < n; ++k) {
      const QuinticBernstein p(q0[k], h * v0[k], h * h * a0[k], q1[k], h * v1[k], h * h * a1[k]);
      path(n + k, 0) = v0[k];
      path(n + k, 1) = v0[k] + 0.25 * h * a0[k];
      path(n + k, 2) = 5 * (p.b[3] - p.b[2]) / h;
      path(n + k, 3) = v1[k] - 0.25 * h * a1[k];
      path(n + k, 4) = v1[k];
    }
  }
  raise(path, n, degree() - 1);
}

/// Rows of coefficients of a degree to that of the path.
void StepEnds::raise(Matrix& path, Eigen::Index first, int degree) const {
  for (; degree < path.cols() - 1; ++degree) {
    for (Eigen::Index row = first; row < first + q0.size(); ++row)
      bernstein::raise(path.data() + row, path.rows(), degree);
  }
}

}  // namespace ricochet
