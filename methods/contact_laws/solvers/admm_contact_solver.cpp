// Proximal ADMM for contact problems with the exact friction cone.
//
// In coordinates r = S x, S one number per contact that gives S G S a diagonal of mean 1 there, the laws of
// contact_problem.h are
//
//   -(A x + a + s) in N_C(x),   A = S G S,   a = S b,   C of friction_set.h                            (1)
//   s_n = mu ||(A x + a)_t|| of each contact under Coulomb's law: de Saxce's shift; s = 0 under the
//   associated law                                                                                     (2)
//
// Both sides have the unit of the root of an energy, so that they can be compared. x keeps (A x + a) and a copy y keeps
// C; z, the multiplier of x = y, becomes the shifted velocity A x + a + s:
//
//   (A + (eta + rho) I) (x+ - x) = rho (y - x) + z - s(z) - a - A x                                    (3)
//   y+ = P_C(x^ - z / rho),   x^ = alpha x+ + (1 - alpha) y                                           (4)
//   z+ = z - rho (x^ - y+)                                                                             (5)
//
// The residuals are those of the copies, of (1), and of complementarity, contact by contact:
//
//   primal = ||x+ - y+||,   dual = ||A x+ + a + s(z+) - z+||,   complementarity = |y+'z+|               (6)
//
// rho starts at sqrt(L eta) (L / eta)^0.2, L the largest eigenvalue of A by power iteration, and is multiplied by
//
//   sqrt(primal / max(||x||, ||y||) * max(||A x||, ||z||, ||a||) / dual)                               (7)
//
// between 1/10 and 10, and within eta and L, where that balances residuals of which one is five times the other, relatively; only then a new
// Cholesky factor of (3) is needed. The solution is r = S y, which is in C to the last digit.
//
// Differs from the source:
// - S, without which masses of 1 and 1e6 have no rho in common; C with the impulse p that is already there.
// - Over-relaxation alpha saves a third of the iterations. A few problems in a thousand turn in a circle with it, since
//   the shift is not monotone; so it ends after a while.
// - (3) is an increment, in which a G that is not symmetric keeps its skew part, and the factor only has the symmetric one.
// - (7): the source multiplies by powers of L / eta and compares residuals that are not relative, which takes 1.2 times
//   the work on the problems of `ricochet contacts record`, 1.6 times on those of the tests. rho rests for a few
//   iterations after each change.
// - Where (6) is below the tolerance the laws are measured by violation(), as for all solvers, and decide.
//
// Source: Carpentier, Le Lidec, Montaut, From compliant to rigid contact simulation: a unified and efficient approach,
// RSS 2024, arXiv 2405.17020.

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <limits>

#include "methods/contact_laws/delassus_matrix.h"
#include "methods/contact_laws/friction_set.h"
#include "methods/contact_laws/solvers/contact_solver.h"

namespace ricochet {
namespace {

constexpr double kProximal = 1e-6;       // eta / L
constexpr double kPower = 0.2;           // of the first rho
constexpr double kImbalance = 5;         // of primal and dual, that changes rho
constexpr double kMostChange = 10;       // of rho
constexpr int kRest = 10;                // iterations between changes of rho
constexpr double kOverRelaxation = 1.6;  // alpha
constexpr int kRelaxed = 500;            // iterations with it
constexpr int kPowerIterations = 10;

/// Cholesky factor of S G S + c I, of the symmetric part of G: dense up to kMaxDenseContacts, sparse above (Eigen's
/// SimplicialLLT, which allocates). S G S is kept, and the order of elimination while the pattern stays the same.
class ShiftedCholesky {
 public:
  void set_matrix(const Delassus& G, const Vector& S) {
    n_ = G.n_rows();
    is_dense_ = G.n_contacts() <= kMaxDenseContacts;
    if (is_dense_) {
      if (A_.rows() < n_) {
        A_.resize(n_, n_);
        factor_.resize(n_, n_);
      }
      G.to_dense(A_);
      auto A = A_.topLeftCorner(n_, n_);
      for (int j = 0; j < n_; ++j) {
        for (int i = j; i < n_; ++i) A(i, j) = 0.5 * S[i] * S[j] * (A(i, j) + A(j, i));
      }
      return;
    }
    const SparseMatrix scaled = S.head(n_).asDiagonal() * sparse_matrix(G) * S.head(n_).asDiagonal();
    sparse_ = 0.5 * (scaled + SparseMatrix(scaled.transpose()));
    sparse_.makeCompressed();
    const int *outer = sparse_.outerIndexPtr(), *inner = sparse_.innerIndexPtr();
    if (std::equal(outer, outer + n_ + 1, outer_.begin(), outer_.end()) &&
        std::equal(inner, inner + sparse_.nonZeros(), inner_.begin(), inner_.end()))
      return;
    sparse_factor_.analyzePattern(sparse_);
    outer_.assign(outer, outer + n_ + 1);
    inner_.assign(inner, inner + sparse_.nonZeros());
  }

  /// @return positive definite
  bool factorize(double c) {
    if (is_dense_) {
      auto factor = factor_.topLeftCorner(n_, n_);
      factor.triangularView<Eigen::Lower>() = A_.topLeftCorner(n_, n_);
      factor.diagonal().array() += c;
      return Eigen::LLT<Eigen::Ref<Matrix>>(factor).info() == Eigen::Success;
    }
    sparse_factor_.setShift(c);
    sparse_factor_.factorize(sparse_);
    return sparse_factor_.info() == Eigen::Success;
  }

  /// x <- the solution, of the right side x
  void solve_in_place(Vector& x) const {
    auto head = x.head(n_);
    if (is_dense_) {
      const auto L = factor_.topLeftCorner(n_, n_).triangularView<Eigen::Lower>();
      L.solveInPlace(head);
      L.adjoint().solveInPlace(head);
    } else {
      head = sparse_factor_.solve(head).eval();
    }
  }

 private:
  int n_ = 0;
  bool is_dense_ = true;
  Matrix A_, factor_;
  SparseMatrix sparse_;
  Eigen::SimplicialLLT<SparseMatrix> sparse_factor_;
  std::vector<int> outer_, inner_;  // pattern that was analysed
};

class AdmmContactSolver final : public ContactSolver {
 public:
  AdmmContactSolver(double tolerance, int iterations) : tolerance_(tolerance), most_iterations_(iterations) {}

  ContactStatus solve(const ContactProblem& problem, Vector& r) override;
  const FrictionPolygon& polygon() const override { return disc_; }
  void count(Counters& counters) override {
    counters.inner_iterations += iterations_;
    counters.matrix_factorizations += factorizations_;
    iterations_ = factorizations_ = 0;
  }

 private:
  /// (6)
  struct Residuals {
    double primal = 0, dual = 0, complementarity = 0;
    double largest() const { return std::max({primal, dual, complementarity}); }
  };

  void reserve(int n);
  void set_scales(const ContactProblem& problem);
  double largest_eigenvalue(const ContactProblem& problem);
  void start(const ContactProblem& problem, const Vector& r);
  void add_shift(const ContactProblem& problem, double sign, Vector& velocity) const;
  void project(const ContactProblem& problem, Vector& y) const;
  void times(const ContactProblem& problem, const Vector& x, Vector& velocity);
  bool factorize(double rho);
  double imbalance_of(int n, const Residuals& residuals) const;
  Residuals iterate(const ContactProblem& problem, double alpha);

  double tolerance_;
  int most_iterations_, iterations_ = 0, factorizations_ = 0;
  FrictionPolygon disc_;
  double eta_ = 0, rho_ = 0;
  double power_ = kPower;  // log(rho / sqrt(L eta)) / log(L / eta), kept from problem to problem
  Vector S_, free_, x_, y_, z_, velocity_, step_, impulses_, w_;  // free_: a
  ShiftedCholesky cholesky_;
};

void AdmmContactSolver::reserve(int n) {
  for (auto* x : {&S_, &free_, &x_, &y_, &z_, &velocity_, &step_, &impulses_, &w_}) {
    if (x->size() < n) x->setZero(n);
  }
}

void AdmmContactSolver::set_scales(const ContactProblem& problem) {
  const auto& G = problem.G;
  for (int i = 0; i < G.n_contacts(); ++i) {
    double trace = 0;
    for (int d = 0; d < G.size(i); ++d) trace += G.diagonal(i, d);
    S_.segment(G.row(i), G.size(i)).setConstant(std::sqrt(G.size(i) / trace));
  }
}

/// velocity <- A x + a
void AdmmContactSolver::times(const ContactProblem& problem, const Vector& x, Vector& velocity) {
  const int n = problem.G.n_rows();
  impulses_.head(n) = S_.head(n).cwiseProduct(x.head(n));
  problem.G.times(impulses_, problem.b, velocity);
  velocity.head(n).array() *= S_.head(n).array();
}

/// From below, by power iteration.
double AdmmContactSolver::largest_eigenvalue(const ContactProblem& problem) {
  const int n = problem.G.n_rows();
  x_.head(n).setZero();
  times(problem, x_, free_);
  for (int k = 0; k < n; ++k) x_[k] = 1 + 0.1 * (k % 7);  // no eigenvector of a symmetric arrangement
  double L = 0;
  for (int k = 0; k < kPowerIterations; ++k) {
    x_.head(n) /= x_.head(n).norm();
    times(problem, x_, velocity_);
    x_.head(n) = velocity_.head(n) - free_.head(n);
    L = x_.head(n).norm();
    if (!(L > 0)) return 1;
  }
  return L;
}

/// (2). @param velocity  of which the tangential part makes the shift
void AdmmContactSolver::add_shift(const ContactProblem& problem, double sign, Vector& velocity) const {
  if (problem.law == FrictionLaw::associated) return;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const auto& contact = problem.contacts[i];
    const int row = problem.G.row(i);
    velocity[row] += sign * contact.mu * tangential_length(z_.data() + row + 1, contact.n_t);
  }
}

void AdmmContactSolver::project(const ContactProblem& problem, Vector& y) const {
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const auto& contact = problem.contacts[i];
    const int row = problem.G.row(i);
    project_on_friction_set(contact.mu, contact.n_t, contact.present / S_[row], y.data() + row);
  }
}

/// Sets x = y from the guess, and z from the velocities that it causes.
void AdmmContactSolver::start(const ContactProblem& problem, const Vector& r) {
  const int n = problem.G.n_rows();
  y_.head(n) = r.head(n).cwiseQuotient(S_.head(n));
  project(problem, y_);
  x_.head(n) = y_.head(n);
  times(problem, x_, velocity_);
  z_.head(n) = velocity_.head(n);
  add_shift(problem, 1, z_);
  step_.head(n) = y_.head(n) - z_.head(n);
  project(problem, step_);
  z_.head(n) += step_.head(n) - y_.head(n);  // -z in N_C at the projection of y - z
}

bool AdmmContactSolver::factorize(double rho) {
  rho_ = rho;
  ++factorizations_;
  return cholesky_.factorize(eta_ + rho_);
}

/// (3)-(6), from velocity_ = A x + a, which is that of x+ after.
AdmmContactSolver::Residuals AdmmContactSolver::iterate(const ContactProblem& problem, double alpha) {
  const int n = problem.G.n_rows();
  step_.head(n) = rho_ * (y_.head(n) - x_.head(n)) + z_.head(n) - velocity_.head(n);
  add_shift(problem, -1, step_);
  cholesky_.solve_in_place(step_);
  x_.head(n) += step_.head(n);  // (3)
  auto relaxed = step_.head(n);
  relaxed = alpha * x_.head(n) + (1 - alpha) * y_.head(n);
  y_.head(n) = relaxed - z_.head(n) / rho_;
  project(problem, y_);                         // (4)
  z_.head(n) -= rho_ * (relaxed - y_.head(n));  // (5)
  times(problem, x_, velocity_);
  Residuals residuals;  // (6)
  residuals.primal = (x_.head(n) - y_.head(n)).cwiseAbs().maxCoeff();
  step_.head(n) = velocity_.head(n) - z_.head(n);
  add_shift(problem, 1, step_);
  residuals.dual = step_.head(n).cwiseAbs().maxCoeff();
  double largest = 0;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const int row = problem.G.row(i), size = problem.G.size(i);
    const auto y = y_.segment(row, size), z = z_.segment(row, size);
    const double present = problem.contacts[i].present / S_[row];
    const double gap = y.dot(z) + (problem.law == FrictionLaw::coulomb
                                       ? problem.contacts[i].mu * present * tangential_length(&z_[row] + 1, size - 1)
                                       : 0);
    largest = std::max({largest, y.cwiseAbs().maxCoeff(), z.cwiseAbs().maxCoeff()});
    residuals.complementarity = std::max(residuals.complementarity, std::abs(gap));
  }
  if (largest > 0) residuals.complementarity /= largest;
  return residuals;
}

/// primal over dual, each relative to its terms.
double AdmmContactSolver::imbalance_of(int n, const Residuals& residuals) const {
  const auto size = [n](const auto& x) { return x.head(n).cwiseAbs().maxCoeff(); };
  const double impulses = std::max(size(x_), size(y_)),
               velocities =
                   std::max({(velocity_.head(n) - free_.head(n)).cwiseAbs().maxCoeff(), size(z_), size(free_)});
  const double primal = residuals.primal * velocities, dual = residuals.dual * impulses;
  if (!(primal > 0)) return dual > 0 ? 0 : 1;
  return primal / std::max(dual, std::numeric_limits<double>::min());
}

ContactStatus AdmmContactSolver::solve(const ContactProblem& problem, Vector& r) {
  const int n = problem.G.n_rows();
  reserve(n);
  if (violation(problem, r, disc_, w_) <= tolerance_) return ContactStatus::solved;
  set_scales(problem);
  const double L = largest_eigenvalue(problem);
  eta_ = kProximal * L;
  cholesky_.set_matrix(problem.G, S_);
  if (!factorize(std::sqrt(L * eta_) * std::pow(1 / kProximal, power_))) return ContactStatus::iteration_limit;
  start(problem, r);
  ContactStatus status = ContactStatus::iteration_limit;
  int k = 1;
  for (; k <= most_iterations_; ++k) {
    const Residuals residuals = iterate(problem, k <= kRelaxed ? kOverRelaxation : 1);
    ++iterations_;
    double size = 0;  // of what the residuals are relative to
    for (const auto* x : {&y_, &z_}) size = std::max(size, x->head(n).cwiseAbs().maxCoeff());
    if (residuals.largest() <= tolerance_ * size) {
      r.head(n) = S_.head(n).cwiseProduct(y_.head(n));
      if (violation(problem, r, disc_, w_) <= tolerance_) {
        status = ContactStatus::solved;
        break;
      }
    }
    if (k % kRest != 0) continue;
    const double imbalance = imbalance_of(n, residuals);
    if (imbalance <= kImbalance && imbalance >= 1 / kImbalance) continue;
    const double change = std::clamp(std::sqrt(imbalance), 1 / kMostChange, kMostChange),
                 rho = std::clamp(rho_ * change, eta_, L);  // (7)
    if (rho != rho_ && !factorize(rho)) break;
  }
  const bool was_easy = status == ContactStatus::solved && k <= kRelaxed;  // else rho may be far from any use
  power_ = was_easy ? std::log(rho_ / std::sqrt(L * eta_)) / std::log(1 / kProximal) : kPower;
  if (status != ContactStatus::solved) r.head(n) = S_.head(n).cwiseProduct(y_.head(n));
  return status;
}

}  // namespace

std::unique_ptr<ContactSolver> make_admm_contact_solver(double tolerance, int iterations) {
  return std::make_unique<AdmmContactSolver>(tolerance, iterations);
}

}  // namespace ricochet
