// Projected Gauss-Seidel, contact by contact: sweeps over the contacts, each of which is brought to fulfil its law with
// the impulses of all others held. Nothing but rows of blocks of G is read, so the cost of a sweep is its nonzeros.
//
// One contact with w = G_ii r + c, c from the others, under Coulomb's law:
//   open      r_n = 0, the friction of p alone, when w_n >= 0                              (1)
//   closed    w_n = 0 eliminates r_n = -(c_n + G_nt r_t) / G_nn and leaves, with A = G_tt - G_tn G_nt / G_nn and
//             a = c_t - G_tn c_n / G_nn,
//               A r_t + a = -gamma r_t,   0 <= gamma  _|_  mu (r_n + p) - ||r_t|| >= 0     (2)
//             gamma = 0 is stick. In the plane slip has a sign and (2) is linear; in space gamma is the root of one
//             scalar function, found by bracketing and the Illinois rule.
// Under the associated law one contact is a convex problem in at most three unknowns: a semismooth Newton method on
//   r = P_K(r - w / trace G_ii)                                                          (3)
// with one projected gradient step, which always descends, where Newton's does not.
//
// Sources: Jean, CMAME 177 (1999), nonlinear Gauss-Seidel; (2): Bonnefon, Daviet, INRIA RR-7595 (2011), who solve the
// same equation as a quartic.

#include <Eigen/LU>
#include <cmath>

#include "methods/contact_laws/solvers/contact_solver.h"

namespace ricochet {
namespace {

constexpr int kSweepsBetweenChecks = 5;  // a check costs as much as a sweep
constexpr int kMaxDoublings = 200;
constexpr int kMaxBisections = 200;
constexpr int kMaxLocalNewton = 30;
constexpr double kRoot = 1e-15;  // width of the bracket of gamma, relative

/// (2) for a given gamma, n_t = 1 or 2.
struct ClosedContact {
  int n_t;
  double mu, p, G_nn, c_n;
  double G_nt[2]{}, A[2][2]{}, a[2]{};
  double r_n = 0, r_t[2]{};

  /// @return ||r_t|| - mu (r_n + p)
  double excess(double gamma) {
    if (n_t == 1) {
      r_t[0] = -a[0] / (A[0][0] + gamma);
    } else {
      const double x = A[0][0] + gamma, y = A[1][1] + gamma, det = x * y - A[0][1] * A[1][0];
      r_t[0] = -(y * a[0] - A[0][1] * a[1]) / det;
      r_t[1] = -(x * a[1] - A[1][0] * a[0]) / det;
    }
    r_n = -(c_n + G_nt[0] * r_t[0] + G_nt[1] * r_t[1]) / G_nn;
    return std::hypot(r_t[0], r_t[1]) - mu * (r_n + p);
  }

  /// Slip in the plane against `sign`.
  bool slip_in_plane(double sign) {
    const double stiffness = G_nn + sign * mu * G_nt[0];
    if (!(stiffness > 0)) return false;
    r_n = -(c_n + sign * mu * p * G_nt[0]) / stiffness;
    r_t[0] = sign * mu * (r_n + p);
    return r_n >= 0;
  }

  bool solve() {
    const double at_stick = excess(0);
    const bool is_finite = std::isfinite(at_stick);
    if (is_finite && at_stick <= 0 && r_n >= 0) return true;
    if (n_t == 1) {
      const double sign = r_t[0] < 0 ? -1 : 1;
      return slip_in_plane(sign) || slip_in_plane(-sign);
    }
    double low = 0, high = A[0][0] + A[1][1], at_low = is_finite ? at_stick : 1, at_high = excess(high);
    for (int k = 0; k < kMaxDoublings && !(at_high < 0); ++k) at_high = excess(high *= 2);
    if (!(at_high < 0)) return false;
    for (int k = 0; k < kMaxBisections && high - low > kRoot * high; ++k) {
      double gamma = (low * at_high - high * at_low) / (at_high - at_low);
      if (!(gamma > low && gamma < high)) gamma = 0.5 * (low + high);
      const double value = excess(gamma);
      if (value == 0) break;
      if (value > 0) {
        low = gamma;
        at_low = value;
        at_high /= 2;  // Illinois
      } else {
        high = gamma;
        at_high = value;
        at_low /= 2;
      }
    }
    return r_n >= 0;
  }
};

/// Friction of p alone, r_n = 0. @return w_n >= 0
bool stays_open(const ContactProblem::Contact& contact, const double* G_ii, const double* c, double* r) {
  const int n = 1 + contact.n_t;
  r[0] = r[1] = r[2] = 0;
  if (contact.n_t == 0 || contact.present == 0) return c[0] >= 0;
  ClosedContact disc{.n_t = contact.n_t, .mu = contact.mu, .p = contact.present, .G_nn = 1, .c_n = 0};
  for (int d = 0; d < contact.n_t; ++d) {
    disc.a[d] = c[1 + d];
    for (int e = 0; e < contact.n_t; ++e) disc.A[d][e] = G_ii[(1 + e) * n + 1 + d];
  }
  if (!disc.solve()) return false;
  double w_n = c[0];
  for (int d = 0; d < contact.n_t; ++d) {
    r[1 + d] = disc.r_t[d];
    w_n += G_ii[(1 + d) * n] * r[1 + d];
  }
  return w_n >= 0;
}

/// Coulomb's law. @param r  in and out; left alone when no case holds
bool solve_one(const ContactProblem::Contact& contact, const double* G_ii, const double* c, double* r) {
  const int n_t = contact.n_t, n = 1 + n_t;
  double open[3];
  if (stays_open(contact, G_ii, c, open)) {  // (1)
    std::copy_n(open, n, r);
    return true;
  }
  if (n_t == 0) {
    r[0] = std::max(0.0, -c[0] / G_ii[0]);
    return true;
  }
  ClosedContact closed{.n_t = n_t, .mu = contact.mu, .p = contact.present, .G_nn = G_ii[0], .c_n = c[0]};
  for (int d = 0; d < n_t; ++d) {
    const double lever = G_ii[1 + d] / G_ii[0];
    closed.G_nt[d] = G_ii[(1 + d) * n];
    closed.a[d] = c[1 + d] - lever * c[0];
    for (int e = 0; e < n_t; ++e) closed.A[d][e] = G_ii[(1 + e) * n + 1 + d] - lever * G_ii[(1 + e) * n];
  }
  if (!closed.solve()) return false;
  r[0] = closed.r_n;
  for (int d = 0; d < n_t; ++d) r[1 + d] = closed.r_t[d];
  return true;
}

/// s = A^-1 b, n <= 3, by Cramer's rule. @return false when A is singular
bool solve_small(int n, const double A[3][3], const double* b, double* s) {
  if (n == 2) {
    const double det = A[0][0] * A[1][1] - A[0][1] * A[1][0];
    s[0] = (A[1][1] * b[0] - A[0][1] * b[1]) / det;
    s[1] = (A[0][0] * b[1] - A[1][0] * b[0]) / det;
    return det != 0;
  }
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> matrix(&A[0][0]);
  const Eigen::Vector3d right(b[0], b[1], b[2]), x = matrix.inverse() * right;
  for (int d = 0; d < 3; ++d) s[d] = x[d];
  return x.allFinite();
}

/// Associated law, (3). @param c  without the contact's own impulse
void solve_one_associated(const ContactProblem::Contact& contact, const double* G_ii, const double* c, double* r) {
  const int n = 1 + contact.n_t;
  double trace = 0;
  for (int d = 0; d < n; ++d) trace += G_ii[d * (n + 1)];
  ContactMap map;
  const auto evaluate = [&](const double* at) {
    double w[3], sum = 0;
    for (int d = 0; d < n; ++d) {
      w[d] = c[d];
      for (int e = 0; e < n; ++e) w[d] += G_ii[e * n + d] * at[e];
    }
    map.evaluate(FrictionLaw::associated, contact, 1 / trace, 1 / trace, at, w);
    for (int d = 0; d < n; ++d) sum += map.F[d] * map.F[d];
    return sum;
  };
  double error = evaluate(r);
  for (int k = 0; k < kMaxLocalNewton && error > 0; ++k) {
    double A[3][3], s[3], trial[3];
    for (int d = 0; d < n; ++d) {
      for (int e = 0; e < n; ++e) {
        A[d][e] = map.F_r[d][e];
        for (int g = 0; g < n; ++g) A[d][e] += map.F_w[d][g] * G_ii[e * n + g];
      }
    }
    const ContactMap here = map;
    const bool is_regular = solve_small(n, A, map.F, s);
    for (int d = 0; d < n; ++d) trial[d] = r[d] - s[d];
    double next = is_regular ? evaluate(trial) : error;
    const bool newton = next < error;
    if (!newton) {
      for (int d = 0; d < n; ++d) trial[d] = r[d] - here.F[d];
      next = evaluate(trial);
    }
    std::copy_n(trial, n, r);
    if (!newton && next >= 0.25 * error) return;  // slow, or rounding: the next sweep goes on
    error = next;
  }
}

class GaussSeidelContactSolver final : public ContactSolver {
 public:
  GaussSeidelContactSolver(double tolerance, int sweeps) : tolerance_(tolerance), most_sweeps_(sweeps) {}

  ContactStatus solve(const ContactProblem& problem, Vector& r) override;
  const FrictionPolygon& polygon() const override { return disc_; }
  void count(Counters& counters) override {
    counters.inner_iterations += sweeps_;
    sweeps_ = 0;
  }

 private:
  static void sweep(const ContactProblem& problem, Vector& r);

  double tolerance_;
  int most_sweeps_, sweeps_ = 0;
  FrictionPolygon disc_;
  Vector w_;
};

void GaussSeidelContactSolver::sweep(const ContactProblem& problem, Vector& r) {
  double w[3], c[3];
  ContactMap map;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const auto& contact = problem.contacts[i];
    const int n = 1 + contact.n_t;
    double* r_i = r.data() + problem.G.row(i);
    const double* G_ii = problem.G.diagonal(i);
    problem.G.row_times(i, r.data(), problem.b.data(), w);
    for (int d = 0; d < n; ++d) {
      c[d] = w[d];
      for (int e = 0; e < n; ++e) c[d] -= G_ii[e * n + d] * r_i[e];
    }
    if (problem.law == FrictionLaw::associated && contact.n_t > 0) {
      solve_one_associated(contact, G_ii, c, r_i);
    } else if (!solve_one(contact, G_ii, c, r_i)) {  // no case holds: a projected gradient step
      double trace = 0;
      for (int d = 0; d < n; ++d) trace += G_ii[d * (n + 1)];
      map.evaluate(problem.law, contact, 1 / trace, 1 / trace, r_i, w);
      for (int d = 0; d < n; ++d) r_i[d] -= map.F[d];
    }
  }
}

ContactStatus GaussSeidelContactSolver::solve(const ContactProblem& problem, Vector& r) {
  if (w_.size() < problem.G.n_rows()) w_.resize(problem.G.n_rows());
  for (int k = 0;; ++k) {
    const bool check = k % kSweepsBetweenChecks == 0 || k == 1 || k == most_sweeps_;
    if (check && violation(problem, r, disc_, w_) <= tolerance_) return ContactStatus::solved;
    if (k == most_sweeps_) return ContactStatus::iteration_limit;
    sweep(problem, r);
    ++sweeps_;
  }
}

}  // namespace

std::unique_ptr<ContactSolver> make_gauss_seidel_contact_solver(double tolerance, int sweeps) {
  return std::make_unique<GaussSeidelContactSolver>(tolerance, sweeps);
}

}  // namespace ricochet
