#include "methods/elements/element_motion.h"

#include <cmath>
#include <set>

#include "methods/runge_kutta/quintic.h"
#include "problems/dense_solve.h"

namespace ricochet {

ElementMotion::ElementMotion(const ButcherTableau& tableau)
    : n_s_(tableau.n_s), between_ends_(tableau.holds_accelerations) {
  if (between_ends_) return;
  if (std::set<double>(tableau.c.begin(), tableau.c.end()).size() < static_cast<std::size_t>(n_s_)) return;
  Matrix powers(n_s_, n_s_);
  for (int m = 0; m < n_s_; ++m) powers.col(m) = tableau.c.array().pow(m);
  w_ = inverse_of(powers);
}

void ElementMotion::add_between_ends(double begin, double end, const Element& e, Motion& motion) const {
  motion.add(begin, end, 5, [&](double s, Vector& q, Vector& v) {
    q.resize(e.q0.size());
    v.resize(e.q0.size());
    interpolate_quintic(s, e.h, e.q0, e.v0, e.a.col(0), e.q1, e.v1, e.end_a, q, v);
  });
}

void ElementMotion::add(double begin, double end, const Element& e, Motion& motion) const {
  const double h = e.h;
  if (between_ends_) return add_between_ends(begin, end, e, motion);
  if (w_.size() == 0) {
    const Vector dq = e.q1 - e.q0;
    motion.add(begin, end, 3, [&](double s, Vector& q, Vector& v) {
      q = e.q0 + s * h * e.v0 + s * s * (3 * dq - h * (2 * e.v0 + e.v1)) + s * s * s * (h * (e.v0 + e.v1) - 2 * dq);
      v = e.v0 + s * (6 / h * dq - 4 * e.v0 - 2 * e.v1) + s * s * (3 * (e.v0 + e.v1) - 6 / h * dq);
    });
    return;
  }
  const Matrix w = e.a * w_.transpose();                        // n_q x n_s: by powers of theta
  const auto integrate = [&](double s, Vector& q, Vector& v) {  // (1)
    q = e.q0 + s * h * e.v0;
    v = e.v0;
    double power = s;
    for (int m = 0; m < n_s_; ++m, power *= s) {
      v += h * power / (m + 1) * w.col(m);
      q += h * h * power * s / ((m + 1) * (m + 2)) * w.col(m);
    }
  };
  Vector dq, dv;
  integrate(1, dq, dv);
  dq = e.q1 - dq;
  dv = e.v1 - dv;
  motion.add(begin, end, n_s_ + 1, [&](double s, Vector& q, Vector& v) {
    integrate(s, q, v);
    const double weight = std::pow(s, n_s_ + 1);  // (2)
    q += weight * dq;
    v += weight * dv;
  });
}

}  // namespace ricochet
