// Semismooth Newton method for contact problems with the exact friction cone.
//
//   F(r) = 0,  contact by contact the projection form of its law, contact_problem.h (5), (6)      (1)
//   (F_r + F_w (G + alpha I)) s = -F,   an element of the generalised Jacobian                     (2)
//   r <- r + 2^-k s with the first k = 0, 1, ... that shortens F                                  (3)
//
// alpha = 1e-10 of the diagonal keeps (2) regular for redundant contacts, a box on four corners, where r is not unique;
// F itself stays exact. Where (3) finds nothing, it starts again: from the polyhedral solution, then after more and
// more Gauss-Seidel sweeps. (2) is dense up to a few dozen
// contacts, and sparse above (Eigen's SparseLU, which allocates as a sparse factorisation must).
//
// Sources: Alart, Curnier, CMAME 92 (1991); Acary, Brogliato (2008), section 13.6.

#include <Eigen/LU>
#include <Eigen/SparseLU>
#include <cmath>

#include "methods/complementarity/contact_solver.h"

namespace ricochet {
namespace {

constexpr double kRegularization = 1e-10;
constexpr int kMostHalvings = 12;
constexpr int kFacetsOfGuess = 8;
constexpr int kRestarts = 6;
constexpr int kSweepsOfRestart = 20;  // the first; five times as many each time

class NewtonContactSolver final : public ContactSolver {
 public:
  NewtonContactSolver(double tolerance, int iterations) : tolerance_(tolerance), most_iterations_(iterations) {}

  ContactStatus solve(const ContactProblem& problem, Vector& r) override;
  const FrictionPolygon& polygon() const override { return disc_; }
  void count(Counters& counters) override {
    counters.inner_iterations += iterations_;
    counters.matrix_factorizations += factorizations_;
    iterations_ = factorizations_ = 0;
    if (polyhedral_) polyhedral_->count(counters);
    for (auto& sweeps : restarts_) {
      if (sweeps) sweeps->count(counters);
    }
  }

 private:
  double evaluate(const ContactProblem& problem, const Vector& r, bool jacobian);
  void add_jacobian_rows(const ContactProblem& problem, int i);
  bool solve_linear(int n);
  bool iterate(const ContactProblem& problem, Vector& r);
  bool is_solved(const ContactProblem& problem, const Vector& r) {
    return violation(problem, r, w_, scale_of(problem, r), disc_) <= tolerance_;
  }

  double tolerance_;
  int most_iterations_, iterations_ = 0, factorizations_ = 0, left_ = 0;
  FrictionPolygon disc_;
  ContactMap map_;
  bool is_dense_ = true;
  Vector w_, F_, step_, trial_;
  Matrix dense_;
  Eigen::PartialPivLU<Matrix> dense_lu_;
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::SparseMatrix<double> sparse_;
  Eigen::SparseLU<Eigen::SparseMatrix<double>> sparse_lu_;
  std::unique_ptr<ContactSolver> polyhedral_, restarts_[kRestarts];
};

/// F, its derivative where asked for, w; returns ||F||, contacts weighted to velocities.
double NewtonContactSolver::evaluate(const ContactProblem& problem, const Vector& r, bool jacobian) {
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
    if (jacobian) add_jacobian_rows(problem, i);
  }
  return std::sqrt(sum);
}

/// (2)
void NewtonContactSolver::add_jacobian_rows(const ContactProblem& problem, int i) {
  const int row = problem.G.row(i), n = problem.G.size(i);
  const auto add = [&](int d, int column, double value) {
    if (value == 0) return;
    if (is_dense_)
      dense_(row + d, column) += value;
    else
      entries_.emplace_back(row + d, column, value);
  };
  for (int d = 0; d < n; ++d) {
    for (int e = 0; e < n; ++e) {
      const double alpha = kRegularization * problem.G.diagonal(i, e);
      add(d, row + e, map_.F_r[d][e] + alpha * map_.F_w[d][e]);
    }
    if (map_.F_w[d][0] == 0 && map_.F_w[d][1] == 0 && map_.F_w[d][2] == 0) continue;
    for (int k = 0; k < problem.G.n_neighbours(i); ++k) {
      const auto block = problem.G.block(i, k);
      for (int c = 0; c < block.size; ++c) {
        double value = 0;
        for (int e = 0; e < n; ++e) value += map_.F_w[d][e] * block.values[c * n + e];
        add(d, block.row + c, value);
      }
    }
  }
}

bool NewtonContactSolver::solve_linear(int n) {
  ++factorizations_;
  if (is_dense_) {
    dense_lu_.compute(dense_);
    step_ = dense_lu_.permutationP() * F_;
    dense_lu_.matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(step_);
    dense_lu_.matrixLU().triangularView<Eigen::Upper>().solveInPlace(step_);
  } else {
    sparse_.resize(n, n);
    sparse_.setFromTriplets(entries_.begin(), entries_.end());
    sparse_lu_.compute(sparse_);
    if (sparse_lu_.info() != Eigen::Success) return false;
    step_ = sparse_lu_.solve(F_);
  }
  return step_.allFinite();
}

/// From r as far as (3) leads. @return solved
bool NewtonContactSolver::iterate(const ContactProblem& problem, Vector& r) {
  const int n = problem.G.n_rows();
  const auto linearize = [&](const Vector& at) {
    entries_.clear();
    if (is_dense_) {
      dense_.setZero();
      dense_.diagonal().tail(dense_.rows() - n).setOnes();
    }
    return evaluate(problem, at, true);
  };
  double error = linearize(r);
  while (!is_solved(problem, r)) {
    if (left_-- == 0) return false;
    ++iterations_;
    if (!solve_linear(n)) return false;
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

ContactStatus NewtonContactSolver::solve(const ContactProblem& problem, Vector& r) {
  const int n = problem.G.n_rows();
  is_dense_ = problem.G.n_contacts() <= kMostDenseContacts;
  if (w_.size() < n) {
    w_.resize(n);
    trial_.resize(n);
  }
  // A dense system keeps its largest size, with an identity behind the problem: sizes that change would allocate.
  const int size = is_dense_ ? std::max(n, static_cast<int>(dense_.rows())) : n;
  if (F_.size() != size) {
    F_.resize(size);
    step_.resize(size);
  }
  if (is_dense_ && dense_.rows() != size) dense_.resize(size, size);
  F_.setZero();
  left_ = most_iterations_;
  if (iterate(problem, r)) return ContactStatus::solved;
  if (is_dense_) {  // a polygon in place of the disc: near the solution, and in the plane the solution itself
    if (!polyhedral_) polyhedral_ = make_lemke_contact_solver(kFacetsOfGuess);
    if (polyhedral_->solve(problem, r) == ContactStatus::solved && iterate(problem, r)) return ContactStatus::solved;
  }
  int sweeps = kSweepsOfRestart;
  for (auto& restart : restarts_) {
    if (!restart) restart = make_gauss_seidel_contact_solver(tolerance_, sweeps);
    if (restart->solve(problem, r) == ContactStatus::solved || iterate(problem, r)) return ContactStatus::solved;
    if (left_ < 0) break;
    sweeps *= 5;
  }
  return ContactStatus::iteration_limit;
}

}  // namespace

std::unique_ptr<ContactSolver> make_newton_contact_solver(double tolerance, int iterations) {
  return std::make_unique<NewtonContactSolver>(tolerance, iterations);
}

}  // namespace ricochet
