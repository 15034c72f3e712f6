#include "methods/time_stepping/contact_lcp.h"

#include <cmath>

#include "methods/complementarity/friction_polygon.h"

namespace ricochet {

ContactLcp::ContactLcp(const Problem& problem, int n_facets, Counters& counters)
    : problem_(problem),
      n_facets_(n_facets),
      counters_(counters),
      has_bilateral_(problem.info().has_bilateral()),
      bilateral_(problem) {
  const ProblemInfo& info = problem.info();
  const int n_c = info.n_c();
  int n_facet = 0, n_frictional = 0;
  for (const auto& contact : info.contacts) {
    n_facet += contact.n_t == 2 ? n_facets_ : 2 * contact.n_t;
    n_frictional += contact.n_t > 0;
  }
  const int most = n_c + n_facet + n_frictional;
  packed_n_.resize(info.n_normal_entries);
  packed_t_.resize(info.n_tangent_entries);
  column_.resize(info.n_q);
  directions_.resize(info.n_q, n_c + n_facet);
  W_directions_.resize(info.n_q, n_c + n_facet);
  if (has_bilateral_) reactions_.setZero(n_c, n_c + n_facet);
  G_.resize(n_c + n_facet, n_c + n_facet);
  lcp_M_.resize(most, most);
  lcp_q_.resize(most);
  z_.setZero(most);
  Lambda_n_.setZero(n_c);
  Lambda_t_.setZero(info.n_lambda_t);
  lemke_.resize(most);
  for (auto* list : {&active_, &last_active_, &facets_begin_, &facets_count_, &gamma_index_}) list->reserve(n_c);
}

void ContactLcp::set_active(const Vector& q, std::span<const int> active) {
  active_.assign(active.begin(), active.end());
  n_active_ = static_cast<int>(active_.size());
  facets_begin_.clear();
  facets_count_.clear();
  gamma_index_.clear();
  problem_.normal_jacobian(q.data(), packed_n_.data());
  if (problem_.info().has_friction()) problem_.tangent_jacobian(q.data(), packed_t_.data());

  int column = n_active_;
  int n_frictional = 0;
  for (int k = 0; k < n_active_; ++k) {
    const auto& contact = problem_.info().contacts[active_[k]];
    const auto entries = static_cast<int>(contact.support.size());
    directions_.col(k).setZero();
    for (int s = 0; s < entries; ++s) directions_(contact.support[s], k) = packed_n_[contact.normal_begin + s];

    const int facets = contact.n_t == 2 ? n_facets_ : 2 * contact.n_t;
    facets_begin_.push_back(column);
    facets_count_.push_back(facets);
    gamma_index_.push_back(contact.n_t > 0 ? n_frictional++ : -1);
    const double* J_t = packed_t_.data() + contact.tangent_begin;
    for (int f = 0; f < facets; ++f, ++column) {
      const auto [first, second] = facet_direction(contact.n_t, f, facets);
      directions_.col(column).setZero();
      for (int s = 0; s < entries; ++s) {
        directions_(contact.support[s], column) = first * J_t[s] + (contact.n_t == 2 ? second * J_t[entries + s] : 0);
      }
    }
  }
  n_facet_total_ = column - n_active_;
  size_ = column + n_frictional;
}

bool ContactLcp::set_inverse_mass(const Matrix& W) {
  const int n = n_active_ + n_facet_total_;
  W_directions_.leftCols(n).noalias() = W.lazyProduct(directions_.leftCols(n));
  if (has_bilateral_) {
    const auto solve = [&](auto column) {
      column_ = column;
      column.noalias() = W.lazyProduct(column_);
    };
    if (!bilateral_.prepare(packed_n_.data(), solve)) return false;
    for (int k = 0; k < n; ++k) bilateral_.impose(W_directions_.col(k), nullptr, reactions_.col(k));
  }
  G_.topLeftCorner(n, n).noalias() = directions_.leftCols(n).transpose().lazyProduct(W_directions_.leftCols(n));
  auto M = lcp_M_.topLeftCorner(size_, size_);
  M.setZero();
  M.topLeftCorner(n, n) = G_.topLeftCorner(n, n);
  for (int k = 0; k < n_active_; ++k) {
    if (gamma_index_[k] < 0) continue;
    const int gamma = n + gamma_index_[k];
    M(gamma, k) = problem_.info().contacts[active_[k]].mu;
    for (int f = 0; f < facets_count_[k]; ++f) {
      M(facets_begin_[k] + f, gamma) = 1;
      M(gamma, facets_begin_[k] + f) = -1;
    }
  }
  return true;
}

double ContactLcp::normal_velocity(std::size_t k, const Vector& v) const {
  return directions_.col(static_cast<Eigen::Index>(k)).dot(v);
}

void ContactLcp::add_normal_impulse(std::size_t k, double impulse, Vector& v, Vector& Lambda_n) const {
  v += impulse * W_directions_.col(static_cast<Eigen::Index>(k));
  Lambda_n[active_[k]] += impulse;
  for (const int i : problem_.info().bilateral) Lambda_n[i] += impulse * reactions_(i, static_cast<Eigen::Index>(k));
}

LcpStatus ContactLcp::solve(Vector& v, const Vector& shift, const Vector& present) {
  const int n = n_active_ + n_facet_total_;
  Lambda_n_.setZero();
  Lambda_t_.setZero();
  if (has_bilateral_) bilateral_.impose(v, shift.data(), Lambda_n_);
  if (n == 0) return LcpStatus::solved;
  for (int k = 0; k < n; ++k) lcp_q_[k] = directions_.col(k).dot(v) + (k < n_active_ ? shift[active_[k]] : 0);
  for (int k = 0; k < n_active_; ++k) {
    if (gamma_index_[k] < 0) continue;
    lcp_q_[n + gamma_index_[k]] = present.size() > 0 ? problem_.info().contacts[active_[k]].mu * present[k] : 0;
  }
  if (active_ != last_active_) z_.setZero();
  last_active_ = active_;
  const LcpStatus status = lemke_.solve_warm(lcp_M_.topLeftCorner(size_, size_), lcp_q_.head(size_), z_.head(size_));
  ++counters_.complementarity_solves;
  counters_.pivots += lemke_.pivots();
  if (status != LcpStatus::solved) return status;
  for (int k = 0; k < n; ++k) {
    if (z_[k] == 0) continue;
    v += z_[k] * W_directions_.col(k);
    for (const int i : problem_.info().bilateral) Lambda_n_[i] += z_[k] * reactions_(i, k);
  }
  for (int k = 0; k < n_active_; ++k) {
    const auto& contact = problem_.info().contacts[active_[k]];
    Lambda_n_[active_[k]] = z_[k];
    const int facets = facets_count_[k];
    for (int f = 0; f < facets; ++f) {
      const double beta = z_[facets_begin_[k] + f];
      const auto direction = facet_direction(contact.n_t, f, facets);
      for (int d = 0; d < contact.n_t; ++d) Lambda_t_[contact.tangent_index + d] += direction[d] * beta;
    }
  }
  return status;
}

double ContactLcp::residual(const Vector& v_plus, const Vector& shift, const Vector& present) const {
  const int n = n_active_ + n_facet_total_;
  double speed = 0, impulse = 0, worst = has_bilateral_ ? bilateral_.residual(v_plus, shift.data(), Lambda_n_) : 0;
  for (int k = 0; k < n; ++k) {
    speed = std::max(
        {speed, directions_.col(k).cwiseAbs().dot(v_plus.cwiseAbs()), k < n_active_ ? std::abs(shift[active_[k]]) : 0});
    impulse = std::max(impulse, z_[k]);
    speed = std::max(speed, G_(k, k) * z_[k]);
    if (G_(k, k) > 0) impulse = std::max(impulse, speed / G_(k, k));
  }
  if (speed == 0 || impulse == 0) return worst;
  const auto pair = [&](double z, double w, double z_size, double w_size) {
    worst = std::max({worst, -z / z_size, -w / w_size, std::abs(z * w) / (z_size * w_size)});
  };
  for (int k = 0; k < n_active_; ++k) {
    pair(z_[k], directions_.col(k).dot(v_plus) + shift[active_[k]], impulse, speed);
    if (gamma_index_[k] < 0) continue;
    const double gamma = z_[n + gamma_index_[k]];
    double cone = problem_.info().contacts[active_[k]].mu * (z_[k] + (present.size() > 0 ? present[k] : 0));
    for (int f = 0; f < facets_count_[k]; ++f) {
      const int column = facets_begin_[k] + f;
      cone -= z_[column];
      pair(z_[column], directions_.col(column).dot(v_plus) + gamma, impulse, speed);
    }
    pair(gamma, cone, speed, impulse);
  }
  return worst;
}

}  // namespace ricochet
