#include "methods/fesd/impact_law.h"

namespace ricochet {

ImpactLaw::ImpactLaw(const Problem& problem, Counters& counters)
    : problem_(problem), counters_(counters), lcp_(problem.n_c()) {
  const int n_q = problem.n_q(), n_c = problem.n_c();
  touching_.reserve(static_cast<std::size_t>(n_c));
  M_.resize(n_q, n_q);
  J_n_.setZero(n_q, n_c);
  MJ_.setZero(n_q, n_c);
  G_.resize(n_c, n_c);
  packed_.resize(problem.info().n_normal_entries);
  f_.resize(n_q);
  bias_.resize(n_c);
  b_.resize(n_c);
  z_.resize(n_c);
  if (problem.info().structure.constant_mass) {
    problem.mass_matrix(problem.info().q0.data(), M_.data());
    llt_.compute(M_);
    ++counters_.mass_factorizations;
  }
}

bool ImpactLaw::prepare(const Vector& q, std::span<const int> touching) {
  if (!problem_.info().structure.constant_mass) {
    problem_.mass_matrix(q.data(), M_.data());
    llt_.compute(M_);
    ++counters_.mass_factorizations;
    if (llt_.info() != Eigen::Success) return false;
  }
  touching_.assign(touching.begin(), touching.end());
  problem_.normal_jacobian(q.data(), packed_.data());
  for (const int i : touching_) {
    const auto& contact = problem_.info().contacts[i];
    const double* J = packed_.data() + contact.normal_begin;
    J_n_.col(i).setZero();
    for (const int row : contact.support) J_n_(row, i) = *J++;
    MJ_.col(i) = J_n_.col(i);
    llt_.solveInPlace(MJ_.col(i));
    ++counters_.linear_solves;
  }
  return true;
}

void ImpactLaw::delassus(std::span<const int> contacts) {
  for (std::size_t r = 0; r < contacts.size(); ++r) {
    for (std::size_t c = 0; c < contacts.size(); ++c) {
      G_(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = J_n_.col(contacts[r]).dot(MJ_.col(contacts[c]));
    }
  }
}

LcpStatus ImpactLaw::impact(Eigen::Ref<Vector> v, Eigen::Ref<Vector> Lambda_n) {
  const auto n = static_cast<Eigen::Index>(touching_.size());
  delassus(touching_);
  for (Eigen::Index r = 0; r < n; ++r) {
    const int i = touching_[r];
    b_[r] = (1 + problem_.info().contacts[i].eps_r) * J_n_.col(i).dot(v);
  }
  const LcpStatus status = lcp_.solve(G_.topLeftCorner(n, n), b_.head(n), z_.head(n));
  ++counters_.complementarity_solves;
  counters_.pivots += lcp_.pivots();
  if (status != LcpStatus::solved) return status;
  for (Eigen::Index r = 0; r < n; ++r) {
    Lambda_n[touching_[r]] = z_[r];
    v += z_[r] * MJ_.col(touching_[r]);
  }
  return status;
}

LcpStatus ImpactLaw::contact_forces(const Vector& q, const Vector& v, std::span<const int> candidates,
                                    Eigen::Ref<Vector> lambda_n, Eigen::Ref<Vector> gap_acceleration) {
  const auto n = static_cast<Eigen::Index>(candidates.size());
  problem_.force(q.data(), v.data(), problem_.info().u.data(), f_.data());
  ++counters_.force_evaluations;
  problem_.gap_acceleration_bias(q.data(), v.data(), bias_.data());
  llt_.solveInPlace(f_);
  ++counters_.linear_solves;
  delassus(candidates);
  for (Eigen::Index r = 0; r < n; ++r) b_[r] = J_n_.col(candidates[r]).dot(f_) + bias_[candidates[r]];
  const LcpStatus status = lcp_.solve(G_.topLeftCorner(n, n), b_.head(n), z_.head(n));
  ++counters_.complementarity_solves;
  counters_.pivots += lcp_.pivots();
  if (status != LcpStatus::solved) return status;
  for (Eigen::Index r = 0; r < n; ++r) {
    lambda_n[candidates[r]] = z_[r];
    gap_acceleration[candidates[r]] = b_[r] + G_.row(r).head(n).dot(z_.head(n));
  }
  return status;
}

}  // namespace ricochet
