#include "methods/event_driven/slip_start.h"

#include <cmath>
#include <limits>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

constexpr int kStartStages = 5;
constexpr int kMaxStartIterations = 60;
constexpr double kAngleDifference = 1e-6;  // of a difference by an angle, whose result only steers Newton's method
constexpr double kStartConverged = 1e-13;  // of angles, and of accelerations as a part of the largest
constexpr double kStartStagnates =
    1e-8;  // angles that change by no more, and no less than before, have reached rounding

}  // namespace

SlipStart::SlipStart(const Problem& problem, ModeDynamics& dynamics, EventFunctions& functions)
    : problem_(problem),
      dynamics_(dynamics),
      functions_(functions),
      tableau_(make_tableau("radau-iia", kStartStages)),
      A2_(tableau_.A * tableau_.A),
      to_left_(Vector::Ones(kStartStages)) {
  for (int i = 0; i < kStartStages; ++i) {
    for (int j = 0; j < kStartStages; ++j) {
      if (j != i) to_left_[i] *= tableau_.c[j] / (tableau_.c[j] - tableau_.c[i]);
    }
  }
  for (auto* x : {&q_, &v_, &a_, &next_}) x->setZero(problem.n_q(), kStartStages);
  slip_.setZero(2);
}

void SlipStart::hold(const std::vector<int>& contacts, const Vector& angles) {
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const double angle = angles[static_cast<Eigen::Index>(k)], d[2]{std::cos(angle), std::sin(angle)};
    dynamics_.hold_direction(contacts[k], d);
  }
}

/// The last line of (3), in next_.
bool SlipStart::accelerate(Eigen::Index stage, const std::vector<int>& contacts) {
  hold(contacts, phi_.col(stage));
  return dynamics_.accelerate(q_.col(stage).data(), v_.col(stage).data(), next_.col(stage).data()) &&
         next_.col(stage).allFinite();
}

bool SlipStart::take(double h, const std::vector<int>& contacts, Vector& q, Vector& v, Vector& angles) {
  const auto n = static_cast<Eigen::Index>(contacts.size());
  phi_ = angles.replicate(1, kStartStages);
  a_phi_.assign(contacts.size(), Matrix::Zero(problem_.n_q(), kStartStages));
  hold(contacts, angles);
  if (!dynamics_.accelerate(q.data(), v.data(), next_.col(0).data())) return false;
  a_ = next_.col(0).replicate(1, kStartStages);
  Vector residual(n * kStartStages), change;
  Matrix derivative(n * kStartStages, n * kStartStages);
  double last_turn = std::numeric_limits<double>::infinity();
  for (int iteration = 0;; ++iteration) {
    if (iteration == kMaxStartIterations) return false;
    q_.noalias() = (h * h) * a_ * A2_.transpose();
    q_ += q.replicate(1, kStartStages) + h * v * tableau_.c.transpose();
    v_.noalias() = h * a_ * tableau_.A.transpose();
    v_ += v.replicate(1, kStartStages);
    for (Eigen::Index i = 0; i < kStartStages; ++i) {
      if (!accelerate(i, contacts)) return false;
      if (iteration > 1) continue;  // the derivatives are those of the second iteration
      const Vector a = next_.col(i);
      for (Eigen::Index k = 0; k < n; ++k) {
        const double angle = phi_(k, i);
        phi_(k, i) += kAngleDifference;
        if (!accelerate(i, contacts)) return false;
        a_phi_[static_cast<std::size_t>(k)].col(i) = (next_.col(i) - a) / kAngleDifference;
        phi_(k, i) = angle;
      }
      next_.col(i) = a;
    }
    const double moved = (next_ - a_).cwiseAbs().maxCoeff(), size = next_.cwiseAbs().maxCoeff();
    a_.swap(next_);
    v_.noalias() = h * a_ * tableau_.A.transpose();
    v_ += v.replicate(1, kStartStages);
    derivative.setZero();
    bool forward = true;
    for (Eigen::Index i = 0; i < kStartStages; ++i) {
      for (Eigen::Index k = 0; k < n; ++k) {
        const int contact = contacts[static_cast<std::size_t>(k)];
        const double d[2]{std::cos(phi_(k, i)), std::sin(phi_(k, i))};
        const Eigen::Index row = i * n + k;
        functions_.slip_velocity(contact, q_.col(i).data(), v_.col(i).data(), slip_.data());
        residual[row] = (d[0] * slip_[1] - d[1] * slip_[0]) / h;  // (4)
        const double along = d[0] * slip_[0] + d[1] * slip_[1];
        forward = forward && along > 0;
        derivative(row, row) -= along / h;
        for (Eigen::Index j = 0; j < kStartStages; ++j) {
          for (Eigen::Index m = 0; m < n; ++m) {
            functions_.slip_velocity(contact, q_.col(i).data(), a_phi_[static_cast<std::size_t>(m)].col(j).data(),
                                     slip_.data());
            derivative(row, j * n + m) += tableau_.A(i, j) * (d[0] * slip_[1] - d[1] * slip_[0]);
          }
        }
      }
    }
    change = -PartialPivotingFactors(derivative).solve(residual);
    const double turn = change.cwiseAbs().maxCoeff();
    if (!std::isfinite(turn) || turn > 1) return false;
    const bool converged = turn <= kStartConverged || (turn <= kStartStagnates && turn >= 0.5 * last_turn);
    if (iteration > 0 && converged && (moved <= kStartConverged * size || turn >= 0.5 * last_turn)) {
      if (!forward) return false;
      first_angles_ = phi_ * to_left_;
      angles = phi_.col(kStartStages - 1);
      q = q_.col(kStartStages - 1);
      v = v_.col(kStartStages - 1);
      return true;
    }
    last_turn = turn;
    phi_ += Eigen::Map<const Matrix>(change.data(), n, kStartStages);
    for (Eigen::Index i = 0; i < kStartStages; ++i) {
      for (Eigen::Index k = 0; k < n; ++k) a_.col(i) += change[i * n + k] * a_phi_[static_cast<std::size_t>(k)].col(i);
    }
  }
}

double SlipStart::stiffness(double h, const std::vector<int>& contacts, const Vector& q, const Vector& v,
                            const Vector& angles) {
  hold(contacts, angles);
  if (!dynamics_.accelerate(q.data(), v.data(), next_.col(0).data())) return 0;
  hold(contacts, angles.array() + M_PI);
  if (!dynamics_.accelerate(q.data(), v.data(), next_.col(1).data())) return 0;
  next_.col(1) -= next_.col(0);
  double largest = 0;
  for (const int contact : contacts) {
    functions_.slip_velocity(contact, q.data(), next_.col(1).data(), slip_.data());
    const double friction = 0.5 * slip_.norm();
    functions_.slip_velocity(contact, q.data(), v.data(), slip_.data());
    largest = std::max(largest, h * friction / slip_.norm());
  }
  hold(contacts, angles);
  return largest;
}

}  // namespace ricochet
