#include "methods/complementarity/contacts/projection_newton.h"

#include <cmath>

namespace ricochet {
namespace {

constexpr double kRegularization = 1e-10;
constexpr int kMostHalvings = 12;

}  // namespace

/// F, its derivative where asked for, w; returns ||F||, contacts weighted to velocities.
double ProjectionNewton::evaluate(const ContactProblem& problem, const Vector& r, bool jacobian) {
  problem.G.times(r, problem.b, w_);
  double sum = 0;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const int row = problem.G.row(i), n = problem.G.size(i);
    double stiffest = 0, softest_t = 0;
    for (int d = 0; d < n; ++d) stiffest = std::max(stiffest, problem.G.diagonal(i, d));
    for (int d = 1; d < n; ++d) softest_t = std::max(softest_t, problem.G.diagonal(i, d));
    const double rho_n = problem.law == FrictionLaw::associated ? 1 / stiffest : 1 / problem.G.diagonal(i, 0);
    map_.evaluate(problem.law, problem.contacts[i], rho_n, n > 1 ? 1 / softest_t : 0, r.data() + row, w_.data() + row);
    for (int d = 0; d < n; ++d) {
      F_[row + d] = map_.F[d];
      sum += std::pow(stiffest * map_.F[d], 2);
    }
    if (!jacobian) continue;
    for (int d = 0; d < n; ++d) {
      for (int e = 0; e < n; ++e) map_.F_r[d][e] += kRegularization * problem.G.diagonal(i, e) * map_.F_w[d][e];
    }
    matrix_.add_rows(problem.G, i, map_.F_r, map_.F_w);  // (2)
  }
  return std::sqrt(sum);
}

bool ProjectionNewton::iterate(const ContactProblem& problem, double tolerance, int& left, Vector& r) {
  const int n = problem.G.n_rows();
  for (auto* x : {&w_, &F_, &step_, &trial_}) {
    if (x->size() < n) x->resize(n);
  }
  const auto linearize = [&](const Vector& at) {
    matrix_.begin(problem.G.n_contacts(), n);
    return evaluate(problem, at, true);
  };
  double error = linearize(r);
  while (violation(problem, r, w_, scale_of(problem, r), disc_) > tolerance) {
    if (left <= 0) return false;
    --left;
    ++iterations_;
    if (!matrix_.factorize() || !matrix_.solve(F_, step_)) return false;
    double length = 1, trial = 0;
    for (int halving = 0; halving < kMostHalvings; ++halving, length /= 2) {  // (3)
      trial_.head(n) = r.head(n) - length * step_.head(n);
      trial = evaluate(problem, trial_, false);
      if (trial < error) break;
    }
    if (!(trial < error)) return false;
    r.head(n) = trial_.head(n);
    error = linearize(r);
  }
  return true;
}

void ProjectionNewton::count(Counters& counters) {
  counters.inner_iterations += iterations_;
  counters.matrix_factorizations += iterations_;
  iterations_ = 0;
}

}  // namespace ricochet
