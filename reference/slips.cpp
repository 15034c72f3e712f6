#include "reference/slips.h"

#include <algorithm>

#include "problems/packed_column.h"

namespace ricochet::reference {
namespace {

// v_stop as a fraction of the size of its terms: a thousand local errors, so that their noise does not turn the
// direction; at most this fraction, so that runs with loose tolerances still follow slow slip.
constexpr double kSlowSlip = 1e-6;
// Slip velocity, as a fraction of its terms, at which the integrator takes over: far above its tolerance.
constexpr double kFastSlip = 1e-3;
// Fraction of a slip velocity below which a minimum counts as zero: the linear extrapolation of v_stop is no better.
constexpr double kThroughZero = 0.1;

}  // namespace

Slips::Slips(const Problem& problem, const Scales& scales, ContactDynamics& dynamics, double tolerance)
    : problem_(problem),
      scales_(scales),
      dynamics_(dynamics),
      tolerance_(tolerance),
      slips_(problem.info().contacts.size()),
      a_(Vector::Zero(problem.n_q())),
      lambda_n_(Vector::Zero(problem.n_c())),
      lambda_t_(Vector::Zero(problem.info().n_lambda_t)) {}

double Slips::v_stop(int i, const Matrix& J_t, const Vector& v) const {
  return std::min(1e3 * tolerance_, kSlowSlip) * size(i, J_t, v);
}

double Slips::root(int i, const double* J_t, const double* v) const {
  const Slip& slip = slips_[static_cast<std::size_t>(i)];
  const auto& contact = problem_.info().contacts[i];
  const bool in_space = dynamics_.modes()[i] == ContactMode::slip;
  double along = 0;
  for (int k = 0; k < contact.n_t; ++k)
    along += slip.direction[k] * packed_dot(contact, J_t + contact.tangent_begin + k * std::ssize(contact.support), v);
  return along + (slip.is_new ? slip.v_stop : in_space ? -slip.v_stop : 0);
}

bool Slips::accelerate(const Vector& q, const Vector& v) {
  return dynamics_.acceleration(q.data(), v.data(), a_.data(), lambda_n_.data(), lambda_t_.data());
}

void Slips::follow(const Vector& q, const Vector& v) {
  const Matrix J_t = problem_.tangent_jacobian(q);
  for (const int i : dynamics_.closed()) {
    if (!is_slipping(dynamics_.modes()[i])) continue;
    Slip& slip = slips_[i];
    const Vector v_t = velocity(i, J_t, v);
    const double most = v_stop(i, J_t, v);
    if (slip.direction.dot(v_t) > 2 * most) {
      slip.is_new = false;
      slip.v_stop = most;
    }
    if (dynamics_.modes()[i] == ContactMode::slip && !slip.is_new) slip.direction = v_t.normalized();
  }
}

/// Whether friction could keep contact i sticking from now on.
bool Slips::would_stick(int i, const Vector& q, const Vector& v) {
  const auto modes = dynamics_.modes();
  auto sticking = modes;
  sticking[i] = ContactMode::stick;
  dynamics_.set_modes(sticking);
  const auto& contact = problem_.info().contacts[i];
  const bool holds =
      accelerate(q, v) && lambda_t_.segment(contact.tangent_index, contact.n_t).norm() <= contact.mu * lambda_n_[i];
  dynamics_.set_modes(modes);
  return holds;
}

std::vector<int> Slips::finish(const std::vector<int>& at_root, double left, double& duration, Vector& q, Vector& v) {
  duration = 0;
  std::vector<int> stopped;
  const Matrix J_t = problem_.tangent_jacobian(q);
  const Vector bias = problem_.slip_acceleration_bias(q, v);
  for (const int i : at_root) {
    if (dynamics_.modes()[i] != ContactMode::slip) {
      stopped.push_back(i);
      continue;
    }
    accelerate(q, v);
    const Vector v_t = velocity(i, J_t, v);
    const Vector a_t = tangents(i, J_t).transpose() * a_ + bias.segment(problem_.info().contacts[i].tangent_index, 2);
    const double until = -v_t.dot(a_t) / a_t.squaredNorm();
    const bool through_zero = until > 0 && (v_t + until * a_t).norm() <= kThroughZero * v_t.norm();
    // A restoring spring turns the direction until the end, but sufficient friction ends the slip.
    if (!through_zero && !(until > 0 && would_stick(i, q, v))) continue;
    duration = std::max(duration, until);
    stopped.push_back(i);
  }
  duration = std::min(duration, left);
  if (duration > 0) {
    accelerate(q, v);
    q += duration * (v + 0.5 * duration * a_);
    v += duration * a_;
  }
  return stopped;
}

void Slips::renew(const std::vector<Vector>& directions, const std::vector<char>& begins, const Vector& q,
                  const Vector& v) {
  const Matrix J_t = problem_.tangent_jacobian(q);
  for (const int i : dynamics_.closed()) {
    const ContactMode mode = dynamics_.modes()[i];
    if (!is_slipping(mode)) continue;
    Slip& slip = slips_[i];
    slip.direction = mode == ContactMode::slip ? directions[i] : Vector::Constant(1, slip_sign(mode));
    slip.is_new = begins[i];
    slip.v_stop = v_stop(i, J_t, v);
    if (!slip.is_new) slip.v_stop = std::min(slip.v_stop, velocity(i, J_t, v).norm() / 2);
  }
}

std::vector<BeginningSlip> Slips::beginning(const Vector& q, const Vector& v) const {
  std::vector<BeginningSlip> beginning;
  const Matrix J_t = problem_.tangent_jacobian(q);
  for (const int i : dynamics_.closed()) {
    if (dynamics_.modes()[i] != ContactMode::slip || !slips_[i].is_new) continue;
    if (velocity(i, J_t, v).norm() > slips_[i].v_stop) continue;  // it is followed already
    beginning.push_back({i, slips_[i].direction, std::max(kFastSlip, 100 * tolerance_) * size(i, J_t, v)});
  }
  return beginning;
}

}  // namespace ricochet::reference
