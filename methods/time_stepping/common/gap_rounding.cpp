#include "methods/time_stepping/common/gap_rounding.h"

#include <limits>

#include "methods/linear_algebra/block_inverse.h"
#include "problems/packed_column.h"

namespace ricochet {

Vector gap_rounding(const Problem& problem, double h) {
  constexpr double kRoundings = 64 * std::numeric_limits<double>::epsilon();
  const ProblemInfo& info = problem.info();
  BlockInverse W;
  W.compute(problem.mass_matrix(info.q0));
  Vector acceleration(info.n_q), J_n(info.n_normal_entries), rounding(info.n_c());
  W.apply(problem.force(info.q0, info.v0), acceleration);
  const double T = info.end_time;
  const Vector lengths = info.q0.cwiseAbs() + T * info.v0.cwiseAbs() + (T * h) * acceleration.cwiseAbs();
  problem.normal_jacobian(info.q0.data(), J_n.data());
  for (int i = 0; i < info.n_c(); ++i)
    rounding[i] = kRoundings * packed_terms(info.contacts[i], J_n.data() + info.contacts[i].normal_begin, lengths);
  return rounding;
}

}  // namespace ricochet
