#include "methods/time_freezing/regions.h"

#include <cmath>
#include <numbers>

#include "problems/dense_solve.h"

namespace ricochet {

AuxiliaryDynamics::AuxiliaryDynamics(const Problem& problem, double a_n, double bounce) {
  const ProblemInfo& info = problem.info();
  const Matrix J = problem.force_directions(problem.normal_jacobian(info.q0));
  const Matrix W = CholeskyFactors(problem.mass_matrix(info.q0)).solve_columns(J);
  push.setZero(info.n_c());
  damping.setZero(info.n_c());
  k = std::pow(std::numbers::pi / bounce, 2);
  for (int i = 0; i < info.n_c(); ++i) {
    push[i] = a_n / J.col(i).dot(W.col(i));
    const double eps_r = info.contacts[i].eps_r;
    if (eps_r == 0) continue;
    const double log_e = std::log(eps_r);
    damping[i] = 2 * std::abs(log_e) * std::sqrt(k / (std::numbers::pi * std::numbers::pi + log_e * log_e));
  }
}

}  // namespace ricochet
