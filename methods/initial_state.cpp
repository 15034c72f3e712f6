#include "methods/initial_state.h"

#include <fmt/format.h>

#include "methods/contact_laws/bilateral_constraints.h"
#include "methods/time_stepping/common/position_projection.h"
#include "problems/initial_state.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

/// (2) at q.
Vector respecting_constraints(const Problem& problem, const Vector& q, Vector v) {
  const ProblemInfo& info = problem.info();
  BlockInverse W;
  W.compute(problem.mass_matrix(q), true);
  Vector packed(info.n_normal_entries), x(info.n_q), Wx(info.n_q), impulses(info.n_c());
  problem.normal_jacobian(q.data(), packed.data());
  BilateralConstraints bilateral(problem);
  const auto solve = [&](auto column) {
    x = column;
    W.apply(x, Wx);
    column = Wx;
  };
  if (bilateral.prepare(packed.data(), solve)) bilateral.impose(v, nullptr, impulses);
  return v;  // else validate() has named the constraint that depends on others
}

/// "x0[k] by d": the entry that changed most.
std::string largest(const char* name, const Vector& change) {
  Eigen::Index k = 0;
  change.cwiseAbs().maxCoeff(&k);
  return fmt::format("{}[{}] by {:.3g}", name, k, change[k]);
}

}  // namespace

ProjectedProblem project_initial_state(std::unique_ptr<Problem> problem) {
  const ProblemInfo& info = problem->info();
  const Vector f_c = problem->gap(info.q0);
  const auto violation = [&](int i) { return info.contacts[i].is_bilateral ? std::abs(f_c[i]) : -f_c[i]; };
  int worst = 0;
  for (int i = 1; i < info.n_c(); ++i) {
    if (violation(i) > violation(worst)) worst = i;
  }
  Counters counters;
  Vector q = info.q0;
  if (PositionProjection projection(*problem, 0, counters); !projection.apply(q))
    throw InputError(fmt::format("no position near q0 respects all gaps: {}", projection.reason()));
  if (q == info.q0) {
    validate(*problem);
    return {std::move(problem), {}};
  }
  const Vector v = info.has_bilateral() ? respecting_constraints(*problem, q, info.v0) : info.v0;
  std::string note = fmt::format("the initial state was changed, '{}' had a gap of {:.3g} m: {}",
                                 info.contacts[worst].name, f_c[worst], largest("q0", q - info.q0));
  if (v != info.v0) note += ", " + largest("v0", v - info.v0);
  return {with_initial_state(*problem, q, v), note};
}

}  // namespace ricochet
