#include "methods/contact_laws/solvers/projection_newton.h"

#include <cmath>

namespace ricochet {
namespace {

// alpha of (2), and where a step with it gained less than kSlow: n contacts in a chain have a condition of n^2.
constexpr double kRegularization = 1e-10, kLeastRegularization = 1e-13;
constexpr double kSlow = 0.1;
constexpr int kMaxHalvings = 12;
// Rounding error of a velocity of zero, relative to the largest one; both over sqrt(G_kk).
constexpr double kTie = 1e-12;

}  // namespace

/// F, its derivative where asked for, w; returns ||F||, contacts weighted to roots of energies, which all share.
/// @param tie  normal velocities over sqrt(G_nn) up to which contacts without impulse count as closed
double ProjectionNewton::evaluate(const ContactProblem& problem, const Vector& r, bool jacobian, double tie) {
  problem.G.times(r, problem.b, w_);
  double sum = 0;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const int row = problem.G.row(i), n = problem.G.size(i);
    double stiffest = 0, softest_t = 0;
    for (int d = 0; d < n; ++d) stiffest = std::max(stiffest, problem.G.diagonal(i, d));
    for (int d = 1; d < n; ++d) softest_t = std::max(softest_t, problem.G.diagonal(i, d));
    const double rho_n = problem.law == FrictionLaw::associated ? 1 / stiffest : 1 / problem.G.diagonal(i, 0);
    map_.evaluate(problem.law, problem.contacts[i], rho_n, n > 1 ? 1 / softest_t : 0, r.data() + row, w_.data() + row,
                  tie * std::sqrt(rho_n));
    for (int d = 0; d < n; ++d) {
      F_[row + d] = map_.F[d];
      sum += stiffest * map_.F[d] * map_.F[d];
    }
    if (!jacobian) continue;
    for (int d = 0; d < n; ++d) {
      for (int e = 0; e < n; ++e) map_.F_r[d][e] += alpha_ * problem.G.diagonal(i, e) * map_.F_w[d][e];
    }
    matrix_.add_rows(problem.G, i, map_.F_r, map_.F_w);  // (2)
  }
  return std::sqrt(sum);
}

double ProjectionNewton::linearize(const ContactProblem& problem, const Vector& r, double tie) {
  matrix_.begin(problem.G.n_contacts(), problem.G.n_rows());
  return evaluate(problem, r, true, tie);
}

/// (3): a trial_ whose F is shorter than `error`, which becomes its length.
bool ProjectionNewton::shorten(const ContactProblem& problem, const Vector& r, double& error) {
  const int n = problem.G.n_rows();
  double length = 1;
  for (int halving = 0; halving < kMaxHalvings; ++halving, length /= 2) {
    trial_.head(n) = r.head(n) - length * step_.head(n);
    const double trial = evaluate(problem, trial_, false);
    if (!(trial < error)) continue;
    error = trial;
    return true;
  }
  return false;
}

bool ProjectionNewton::iterate(const ContactProblem& problem, double tolerance, int& left, Vector& r) {
  const int n = problem.G.n_rows();
  for (auto* x : {&w_, &F_, &step_, &trial_}) {
    if (x->size() < n) x->resize(n);
  }
  alpha_ = kRegularization;
  bool closes_ties = r.head(n).isZero(0);
  double error = linearize(problem, r, closes_ties ? kTie * velocity_scale(problem) : 0);
  while (violation(problem, r, w_, disc_) > tolerance) {
    if (left <= 0) return false;
    --left;
    ++iterations_;
    const double before = error;
    const bool is_shorter = matrix_.factorize() && matrix_.solve(F_, step_) && shorten(problem, r, error);
    if (is_shorter)
      r.head(n) = trial_.head(n);
    else if (!closes_ties && alpha_ == kRegularization)
      return false;
    closes_ties = false;
    if (!is_shorter)
      alpha_ = kRegularization;
    else if (error > kSlow * before)
      alpha_ = kLeastRegularization;
    error = linearize(problem, r);
  }
  return true;
}

void ProjectionNewton::count(Counters& counters) {
  counters.inner_iterations += iterations_;
  counters.matrix_factorizations += iterations_;
  iterations_ = 0;
}

}  // namespace ricochet
