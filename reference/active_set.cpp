#include "reference/active_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "problems/dense_solve.h"
#include "problems/input_error.h"

namespace ricochet::reference {
namespace {

constexpr double kViolated = 1e-12;   // of the size of the terms
constexpr double kDependent = 1e-11;  // of M_pp: what is left of a column that depends on those of the active set

}  // namespace

std::optional<Vector> solve_lcp_by_enumeration(const Matrix& M, const Vector& q) {
  const auto n = static_cast<unsigned>(q.size());
  if (n > kMaxPairs)
    throw InputError("simultaneous contacts of the reference", n,
                     fmt::format("at most {} can be enumerated", kMaxPairs));
  std::vector<std::uint32_t> sets(std::size_t{1} << n);
  for (std::uint32_t set = 0; set < sets.size(); ++set) sets[set] = set;
  std::stable_sort(sets.begin(), sets.end(), [](auto a, auto b) { return std::popcount(a) < std::popcount(b); });

  for (const auto set : sets) {
    std::vector<Eigen::Index> active;
    for (unsigned i = 0; i < n; ++i) {
      if (set >> i & 1U) active.push_back(i);
    }
    Vector z = Vector::Zero(n);
    if (!active.empty()) {
      const FullPivotingFactors lu(M(active, active));
      if (!lu.is_invertible()) continue;
      z(active) = lu.solve(-q(active));
    }
    const Vector w = M * z + q;
    const double z_size = z.cwiseAbs().maxCoeff(), w_size = (M.cwiseAbs() * z.cwiseAbs() + q.cwiseAbs()).maxCoeff();
    if (z.minCoeff() >= -kViolated * z_size && w.minCoeff() >= -kViolated * w_size) return z.cwiseMax(0);
  }
  return std::nullopt;
}

std::optional<Vector> solve_lcp_by_dual_steps(const Matrix& M, const Vector& q) {
  const Eigen::Index n = q.size();
  if (n == 0) return q;
  const Vector s = M.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix A = s.asDiagonal() * M * s.asDiagonal();
  const Vector b = s.cwiseProduct(q);
  Vector z = Vector::Zero(n), w = b;
  std::vector<Eigen::Index> active;
  const auto entering = [&] {
    const double size = (A.cwiseAbs() * z + b.cwiseAbs()).maxCoeff();
    Eigen::Index p = -1;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (std::ranges::find(active, i) == active.end() && w[i] < -kViolated * size && (p < 0 || w[i] < w[p])) p = i;
    }
    return p;
  };
  const auto most = 100 * (n + 1);  // seen 2 n
  Eigen::Index changes = 0;
  for (Eigen::Index p = entering(); p >= 0; p = entering()) {
    for (bool enters = false; !enters;) {
      if (++changes > most) return std::nullopt;
      Vector d = Vector::Zero(n);
      if (!active.empty()) d(active) = -CholeskyFactors(A(active, active)).solve(A(active, p));  // (1)
      d[p] = 1;
      const Vector change = A * d;
      const double none = std::numeric_limits<double>::infinity();
      const double to_zero = change[p] > kDependent ? -w[p] / change[p] : none;
      double to_bound = none;
      auto leaving = active.end();
      for (auto j = active.begin(); j != active.end(); ++j) {
        if (d[*j] >= 0 || z[*j] >= -d[*j] * to_bound) continue;
        to_bound = z[*j] / -d[*j];
        leaving = j;
      }
      if (to_zero == none && to_bound == none) return std::nullopt;
      const double step = std::min(to_zero, to_bound);
      z += step * d;
      enters = to_zero <= to_bound;
      if (!enters) {
        z[*leaving] = 0;
        active.erase(leaving);
      }
      w = A * z + b;
    }
    active.push_back(p);
  }
  Vector x = Vector::Zero(n);
  if (!active.empty()) x(active) = CholeskyFactors(A(active, active)).solve(-b(active));
  return s.cwiseProduct(x.cwiseMax(0));
}

}  // namespace ricochet::reference
