#include "reference/active_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "problems/dense_solve.h"
#include "problems/input_error.h"

namespace ricochet::reference {

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
    if (z.minCoeff() >= -1e-12 * z_size && w.minCoeff() >= -1e-12 * w_size) return z.cwiseMax(0);
  }
  return std::nullopt;
}

}  // namespace ricochet::reference
