#include "reference/force_bounds.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace ricochet::reference {
namespace {

constexpr Eigen::Index kMostUnknowns = 60;  // unknowns; dense intervals of more cost more than short steps
constexpr double kInverseRounding = 1e-12;  // of Y K - I and of x_0, where K is constant
constexpr int kTestIterations = 8;

}  // namespace

ForceBounds::ForceBounds(const Problem& problem, const ContactDynamics& dynamics, const Slips& slips)
    : problem_(problem), dynamics_(dynamics), slips_(slips), row_(problem.info().contacts.size(), -1) {
  const auto n = static_cast<std::size_t>(problem.n_q());
  const auto& info = problem.info();
  M_.resize(n * n);
  normal_.resize(static_cast<std::size_t>(info.n_normal_entries));
  tangent_.resize(static_cast<std::size_t>(info.n_tangent_entries));
  bias_.resize(info.contacts.size());
  T_.resize(static_cast<std::size_t>(info.n_lambda_t) * n);
  chosen_.assign(info.contacts.size(), false);
}

/// Whether K depends on the modes alone.
bool ForceBounds::is_constant() const {
  return problem_.info().structure.constant_mass && std::ranges::all_of(dynamics_.closed(), [&](int i) {
           return problem_.info().contacts[i].is_affine && dynamics_.modes()[i] != ContactMode::slip;
         });
}

/// K over boxes, which may be points.
void ForceBounds::set_matrix(const Interval* q, const Interval* v) {
  const auto& info = problem_.info();
  const Eigen::Index n = problem_.n_q();
  size_ = n;
  std::ranges::fill(chosen_, char{false});
  for (const int i : dynamics_.closed()) {
    chosen_[i] = true;
    row_[i] = static_cast<int>(size_);
    size_ += 1 + (dynamics_.modes()[i] == ContactMode::stick ? info.contacts[i].n_t : 0);
  }
  K_.assign(static_cast<std::size_t>(size_ * size_), 0.0);
  const auto K = [&](Eigen::Index row, Eigen::Index column) -> Interval& { return K_[row + column * size_]; };
  problem_.mass_bounds(q, M_.data());
  for (Eigen::Index k = 0; k < n; ++k) {
    for (Eigen::Index l = 0; l < n; ++l) K(l, k) = M_[l + k * n];
  }
  problem_.normal_bounds(chosen_.data(), q, normal_.data());
  if (info.has_friction()) problem_.tangent_bounds(chosen_.data(), q, tangent_.data());
  for (const int i : dynamics_.closed()) {
    const auto& contact = info.contacts[i];
    const ContactMode mode = dynamics_.modes()[i];
    const Eigen::Index row = row_[i];
    const auto n_support = static_cast<Eigen::Index>(contact.support.size());
    const auto n_pushed = static_cast<Eigen::Index>(contact.pushed().size());
    for (Eigen::Index s = 0; s < n_support; ++s) {
      const Interval& J = normal_[contact.normal_begin + s];
      K(row, contact.support[s]) = J;
      if (s < n_pushed) K(contact.support[s], row) = -J;
    }
    if (contact.n_t == 0) continue;
    Interval direction[2] = {0.0, 0.0};
    if (is_slipping(mode) && mode != ContactMode::slip) direction[0] = slip_sign(mode);
    if (mode == ContactMode::slip) {
      Interval v_t[2] = {0.0, 0.0}, square_sum = 0.0;
      for (int k = 0; k < 2; ++k) {
        for (Eigen::Index s = 0; s < n_support; ++s)
          v_t[k] += tangent_[contact.tangent_begin + k * n_support + s] * v[contact.support[s]];
        square_sum += square(v_t[k]);
      }
      for (int k = 0; k < 2; ++k) {
        direction[k] = square_sum.lower > 0 ? intersection(v_t[k] / sqrt(square_sum), {-1, 1}) : Interval(-1, 1);
        if (slips_.is_new(i)) direction[k] = slips_.direction(i)[k];
      }
    }
    for (int k = 0; k < contact.n_t; ++k) {
      for (Eigen::Index s = 0; s < n_support; ++s) {
        const Interval& J = tangent_[contact.tangent_begin + k * n_support + s];
        if (mode == ContactMode::stick) {
          K(row + 1 + k, contact.support[s]) = J;
          if (s < n_pushed) K(contact.support[s], row + 1 + k) = -J;
        } else if (s < n_pushed) {
          K(contact.support[s], row) += Interval(contact.mu) * direction[k] * J;
        }
      }
    }
  }
}

/// Y
bool ForceBounds::invert(const double* q, const double* v) {
  std::vector<Interval> q_point(q, q + problem_.n_q()), v_point(v, v + problem_.n_q());
  set_matrix(q_point.data(), v_point.data());
  Matrix K(size_, size_);
  for (Eigen::Index k = 0; k < size_ * size_; ++k) K.data()[k] = K_[k].middle();
  const Eigen::PartialPivLU<Matrix> factors(K);
  if (!(factors.rcond() > 1e-14)) return false;  // redundant contacts
  Y_ = factors.inverse();
  return Y_.allFinite();
}

bool ForceBounds::evaluate(const Interval* q, const Interval* v, const double* q_middle, const double* v_middle) {
  const auto& info = problem_.info();
  const Eigen::Index n = problem_.n_q();
  if (n > kMostUnknowns) return false;
  const bool constant = is_constant();
  if (!constant || !has_inverse_ || modes_ != dynamics_.modes()) {
    modes_ = dynamics_.modes();
    has_inverse_ = invert(q_middle, v_middle);
    if (!has_inverse_) return false;
    if (!constant) set_matrix(q, v);
  }
  b_.assign(static_cast<std::size_t>(size_), 0.0);
  problem_.force_bounds(q, v, info.u.data(), b_.data());
  problem_.gap_bias_bounds(chosen_.data(), q, v, bias_.data());
  if (info.has_friction()) problem_.slip_derivative_bounds(chosen_.data(), q, v, T_.data());
  for (const int i : dynamics_.closed()) {
    const auto& contact = info.contacts[i];
    if (contact.is_affine && !contact.is_moving) continue;
    b_[row_[i]] = -bias_[i];
    if (dynamics_.modes()[i] != ContactMode::stick) continue;
    for (int k = 0; k < contact.n_t; ++k) {
      Interval sum = 0.0;
      for (const int l : contact.support) sum += T_[contact.tangent_index + k + l * info.n_lambda_t] * v[l];
      b_[row_[i] + 1 + k] = -sum;
    }
  }
  x_.assign(static_cast<std::size_t>(size_), 0.0);
  for (Eigen::Index l = 0; l < size_; ++l) {
    for (Eigen::Index k = 0; k < size_; ++k) {
      if (Y_(l, k) != 0) x_[l] += Interval(Y_(l, k)) * b_[k];
    }
  }
  if (constant) {
    for (Interval& x : x_) {
      const double rounding = kInverseRounding * x.magnitude();
      x = {x.lower - rounding, x.upper + rounding};
    }
    return true;
  }
  Vector x_0(size_), d(size_);
  for (Eigen::Index l = 0; l < size_; ++l) x_0[l] = x_[l].middle();
  if (!x_0.allFinite()) return false;
  for (Eigen::Index k = 0; k < size_; ++k) {  // b - K x_0
    for (Eigen::Index l = 0; l < size_; ++l) b_[l] = b_[l] - K_[l + k * size_] * Interval(x_0[k]);
  }
  E_.resize(size_, size_);
  for (Eigen::Index l = 0; l < size_; ++l) {
    Interval sum = 0.0;
    for (Eigen::Index k = 0; k < size_; ++k) sum += Interval(Y_(l, k)) * b_[k];
    d[l] = sum.magnitude();
    for (Eigen::Index column = 0; column < size_; ++column) {
      Interval entry = l == column ? 1.0 : 0.0;
      for (Eigen::Index k = 0; k < size_; ++k) {
        if (Y_(l, k) != 0) entry = entry - Interval(Y_(l, k)) * K_[k + column * size_];
      }
      E_(l, column) = entry.magnitude();
    }
  }
  if (!d.allFinite() || !E_.allFinite()) return false;
  Vector e = d;
  for (int iteration = 0; iteration < kTestIterations; ++iteration) {
    const Vector next = d + E_ * e;
    if ((next.array() <= e.array() * (1 - kInverseRounding)).all()) {  // (2)
      for (Eigen::Index l = 0; l < size_; ++l) x_[l] = Interval(x_0[l]) + Interval(-e[l], e[l]);
      return true;
    }
    e = 1.1 * next + Vector::Constant(size_, 1e-300);
  }
  return false;
}

Interval ForceBounds::cone_margin(int i) const {
  const auto& contact = problem_.info().contacts[i];
  Interval tangential = 0.0;
  if (contact.n_t == 1) {
    tangential = abs(x_[row_[i] + 1]);
  } else {
    for (int k = 0; k < contact.n_t; ++k) tangential += square(x_[row_[i] + 1 + k]);
    tangential = sqrt(tangential);
  }
  return Interval(contact.mu) * x_[row_[i]] - tangential;
}

}  // namespace ricochet::reference
