#include "reference/resting_groups.h"

#include <algorithm>
#include <cmath>

#include "problems/dense_solve.h"
#include "problems/disjoint_sets.h"
#include "reference/active_set.h"

namespace ricochet::reference {
namespace {

constexpr double kExplained = 10;     // of (5)
constexpr double kTurned = 10;        // of (6)
constexpr double kUncoupled = 1e-14;  // of sqrt(G_ii G_jj)

}  // namespace

Vector RestingGroups::heights(const Vector& q) const {
  return std::max(tolerance_, kTouching) * scales_.gap(problem_.normal_jacobian(q), q);  // (1)
}

RestingGroups::Near RestingGroups::near(const Vector& q, const Vector& v, const std::vector<ContactMode>& modes,
                                        double factor) const {
  Near near;
  const auto& info = problem_.info();
  const Vector gap = problem_.gap(q), height = heights(q);
  for (const int i : info.unilateral) {
    if (info.contacts[i].n_t == 0 && (is_closed(modes[i]) || gap[i] <= height[i])) near.contacts.push_back(i);
  }
  const Matrix J_n = problem_.normal_jacobian(q);
  const Vector free = laws_.free_acceleration(q, v), bias = problem_.gap_acceleration_bias(q, v);
  const Vector load = J_n.cwiseAbs().transpose() * free.cwiseAbs(), rate = J_n.transpose() * v;
  const Vector resting = kSame * scales_.speed(J_n, v);
  const auto is_open = [&](int i) { return !is_closed(modes[i]) || std::abs(rate[i]) > resting[i]; };
  double largest = 0;
  for (const int i : near.contacts) largest = std::max(largest, load[i]);
  std::vector<int> slow;
  std::vector<double> speed;
  for (const int i : near.contacts) {
    const double low = factor * std::sqrt(2 * largest * height[i]);  // (2)
    if (is_open(i) && std::abs(rate[i]) > low) continue;
    slow.push_back(i);
    speed.push_back(low);
    near.is_open.push_back(is_open(i));
  }
  near.speed = Eigen::Map<const Vector>(speed.data(), std::ssize(speed));
  near.contacts = slow;
  near.J = J_n(Eigen::all, slow);
  near.MJ = laws_.response(q, near.J);
  near.G = near.J.transpose() * near.MJ;
  near.gap = gap(slow);
  near.rate = rate(slow);
  near.height = height(slow);
  near.a = near.J.transpose() * free + bias(slow);
  DisjointSets sets(static_cast<int>(slow.size()));
  for (int k = 0; k < sets.n(); ++k) {
    for (int l = 0; l < k; ++l) {
      if (std::abs(near.G(k, l)) > kUncoupled * std::sqrt(near.G(k, k) * near.G(l, l))) sets.join(k, l);
    }
  }
  for (int k = 0; k < sets.n(); ++k) {
    if (sets.of(k) != k) continue;
    near.groups.emplace_back();
    for (int l = k; l < sets.n(); ++l) {
      if (sets.of(l) == k) near.groups.back().push_back(l);
    }
  }
  return near;
}

Vector RestingGroups::slow(const Vector& q, const Vector& v, const std::vector<ContactMode>& modes,
                           double factor) const {
  Vector slow = Vector::Zero(problem_.n_c());
  const Near near = this->near(q, v, modes, factor);
  for (std::size_t k = 0; k < near.contacts.size(); ++k) {
    if (near.is_open[k] != 0) slow[near.contacts[k]] = near.speed[static_cast<Eigen::Index>(k)];
  }
  return slow;
}

RestingGroups::Rest RestingGroups::find(const Vector& q, const Vector& v, const std::vector<ContactMode>& modes) const {
  const Near near = this->near(q, v, modes, 1);
  Rest rest{{}, {}, q, v, Vector::Zero(problem_.n_c())};
  for (const auto& group : near.groups) {
    const auto is_open = [&](Eigen::Index k) { return near.is_open[static_cast<std::size_t>(k)] != 0; };
    const auto approaches = [&](Eigen::Index k) { return is_open(k) && near.rate[k] < 0; };
    if (std::ranges::count_if(group, is_open) < 2 || std::ranges::none_of(group, approaches)) continue;
    const auto set = acting(near, group, near.rate);
    if (set.empty() || holds(near, set)) {
      close(near, group, rest);
      continue;
    }
    for (const auto k : group) {
      if (approaches(k)) rest.wedged.push_back(near.contacts[static_cast<std::size_t>(k)]);
    }
  }
  return rest;
}

/// The contacts of the group with impulses or forces if b are its rates or accelerations without them.
std::vector<Eigen::Index> RestingGroups::acting(const Near& near, const std::vector<Eigen::Index>& group,
                                                const Vector& b, Vector* lambda) const {
  std::vector<Eigen::Index> acting;
  const auto z = solve_lcp_by_dual_steps(near.G(group, group), b(group));
  if (!z) return acting;
  for (Eigen::Index k = 0; k < z->size(); ++k) {
    if ((*z)[k] > 0) acting.push_back(group[static_cast<std::size_t>(k)]);
  }
  if (lambda == nullptr) return acting;
  *lambda = Vector::Zero(b.size());
  (*lambda)(group) = *z;
  return acting;
}

/// Whether (5) and (6) hold. @param solved  out, G^-1 times rates and gaps
bool RestingGroups::holds(const Near& near, const std::vector<Eigen::Index>& P, Matrix* solved) const {
  const Vector s = near.G(P, P).diagonal().cwiseSqrt();
  const SymmetricEigen eigen(s.cwiseInverse().asDiagonal() * near.G(P, P) * s.cwiseInverse().asDiagonal());
  if (eigen.values[0] < kTurned * tolerance_) return false;  // (6)
  Matrix x(s.size(), 2);
  x << near.rate(P).cwiseQuotient(s), near.gap(P).cwiseQuotient(s);
  const Matrix c = eigen.vectors.transpose() * x, d = eigen.values.cwiseInverse().asDiagonal() * c;
  if (solved != nullptr) *solved = s.cwiseInverse().asDiagonal() * (eigen.vectors * d);
  const auto n = static_cast<double>(P.size());
  for (Eigen::Index k = 0; k < 2; ++k) {
    if (c.col(k).dot(d.col(k)) > kExplained * n * n * x.col(k).squaredNorm()) return false;  // (5)
  }
  return true;
}

bool RestingGroups::explains(const std::vector<int>& contacts, const Vector& q, const Vector& q_plus) const {
  const Matrix J = problem_.normal_jacobian(q)(Eigen::all, contacts);
  const Vector gap = problem_.gap(q)(contacts), change = q_plus - q;
  const Matrix M = problem_.mass_matrix(q), MJ = CholeskyFactors(M).solve_columns(problem_.force_directions(J));
  const Vector s = J.cwiseProduct(MJ).colwise().sum().cwiseSqrt();
  const auto n = static_cast<double>(contacts.size());
  return change.dot(M * change) <= kExplained * n * n * gap.cwiseQuotient(s).squaredNorm();
}

/// Closes those contacts of the group that are at rest.
void RestingGroups::close(const Near& near, std::vector<Eigen::Index> group, Rest& rest) const {
  std::vector<Eigen::Index> P;
  Vector lambda;
  const auto is_open = [&](Eigen::Index k) { return near.is_open[static_cast<std::size_t>(k)] != 0; };
  for (Eigen::Index leaves = 0; leaves >= 0; std::erase(group, leaves)) {
    P = acting(near, group, near.a, &lambda);
    double highest = 1;
    leaves = -1;
    for (const auto k : P) {
      const double height = near.rate[k] * near.rate[k] / (2 * lambda[k] * near.G(k, k) * near.height[k]);  // (3)
      if (!is_open(k) || height <= highest) continue;
      highest = height;
      leaves = k;
    }
  }
  if (std::ranges::none_of(P, is_open)) return;
  Matrix solved;
  if (!holds(near, P, &solved)) {
    for (const auto k : P) {
      if (is_open(k)) rest.wedged.push_back(near.contacts[static_cast<std::size_t>(k)]);
    }
    return;
  }
  const Matrix MJ = near.MJ(Eigen::all, P);
  rest.v -= MJ * solved.col(0);
  rest.q -= MJ * solved.col(1);  // (4)
  for (std::size_t k = 0; k < P.size(); ++k) {
    rest.contacts.push_back(near.contacts[static_cast<std::size_t>(P[k])]);
    rest.impulse[rest.contacts.back()] = -solved(static_cast<Eigen::Index>(k), 0);
  }
}

}  // namespace ricochet::reference
