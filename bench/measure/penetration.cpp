#include "bench/measure/penetration.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ricochet {
namespace {

constexpr int kParts = 8;  // of a piece

}  // namespace

double penetration(const Problem& problem, const Vector& q) {
  const ProblemInfo& info = problem.info();
  double deepest = 0;
  if (info.unilateral.empty()) return deepest;
  const Vector gap = problem.gap(q);
  for (const int i : info.unilateral) deepest = std::max(deepest, -gap[i]);
  return deepest;
}

double penetration(const Problem& problem, const Motion& motion) {
  double deepest = 0;
  Vector q, v;
  for (std::size_t piece = 0; piece < motion.n_pieces(); ++piece) {
    for (int k = 0; k <= kParts; ++k) {
      motion.within(piece, 0.5 * (1 - std::cos(k * std::numbers::pi / kParts)), q, v);
      deepest = std::max(deepest, penetration(problem, q));
    }
  }
  return deepest;
}

}  // namespace ricochet
