// Primal-dual interior-point method for contact problems with the exact friction cone.
//
// The laws of contact_problem.h are complementarity of r_n, w_n >= 0 and of two points x, y of the second-order cone L
// with its product o (second_order_cone.h), and the limit t = 0 of the path
//
//   r_n w_n = t                                                                               (1)
//   x o y = t e,   x = (mu (r_n + p), r_t),   y = (gamma, w_t)     Coulomb's law               (2)
//   x o y = t e,   x = (mu r_n, r_t),         y = (w_n / mu, w_t)  associated law, without (1) (2b)
//   w = G r + b                                                                               (3)
//
// with r_n, w_n > 0 and x, y inside L. gamma is an unknown that tends to the slip speed ||w_t|| of de Saxce's form,
// which so is never differentiated where it has no derivative: (1)-(3) are the problem of Stewart and Trinkle
// (lemke_contact_solver.cpp) with the disc in place of the polygon. A Newton step, of cones in the coordinates W^-1 x,
// W y:
//
//   w_n dr_n + r_n dw_n = sigma t - r_n w_n - dr_n dw_n                                       (4)
//   P dx + Q dy = sigma t e - W^-1 x o W y - W^-1 dx o W dy                                   (5)
//   P z = W y o W^-1 z,   Q z = W^-1 x o W z
//   dw = G dr + (G r + b - w)                                                                 (6)
//
// The first row of (5) eliminates dgamma, (6) eliminates dw, and dr is left (contact_matrix.h). As Mehrotra does, a
// step with sigma = 0 tells sigma and the last, second-order terms of (4), (5); and w starts where (3) does not hold.
// With W = I, the direction of Alizadeh, Haeberly and Overton, the equations stay regular up to t = 0 and convergence
// is fast there; but far from the path it can be blocked by the boundary, without the second-order terms and with
// larger sigma too. Then W is that of Nesterov and Todd, W^-1 x = W y, whose equations are regular at every point under
// the associated law; alone it loses half of the digits, since x and y turn away from each other as sqrt t does.
//
// r of a step, projected by the laws, is the candidate for the solution: what is open gets zeros. Two things end the
// path early: rounding, where x and y go to the boundary of L together; and, since Coulomb's law is not monotone, a
// turn of the path at t > 0. The semismooth Newton method goes on from there (projection_newton.h), and if it fails, a
// second cold start a hundred times as far inside.
//
// Warm start: an interior point must not begin at the boundary, where the solution of the step before is. A guess with
// violation v, its r and w moved inside by v times what a cold start has, begins a path at t of order v; where that
// path ends early, a cold start follows.
//
// Sources: Alizadeh, Goldfarb, Math. Program. 95 (2003); Mehrotra, SIAM J. Optim. 2 (1992); de
// Saxce's form in an interior-point method: Acary, Armand, Nguyen, Shpakovych, Optim. Methods Softw. (2024), who treat
// the associated law.

#include <cmath>
#include <limits>

#include "methods/contact_laws/contact_matrix.h"
#include "methods/contact_laws/second_order_cone.h"
#include "methods/contact_laws/solvers/contact_solver.h"
#include "methods/contact_laws/solvers/projection_newton.h"

namespace ricochet {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kToBoundary = 0.99;  // part of the way to the boundary of the cones that a step goes
constexpr double kShortStep = 0.1;    // a shorter one tries the next way
constexpr double kBlocked = 0.01;     // so many of them in a row end the path
constexpr int kMaxBlocked = 5;
constexpr double kColdStarts[] = {1, 100};  // multiples of what the largest |b| calls for
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// sigma >= `least`, with or without second-order terms: ways to go, tried in turn.
struct Way {
  double least;
  bool second_order;
};
constexpr Way kWays[] = {{1e-8, true}, {0.1, false}, {0.5, false}, {1, false}};

double to_boundary(double z, double dz) {
  return dz < 0 ? -z / dz : kInfinity;
}

/// One contact along the path.
struct Interior {
  int n_t = 0;           // tangents with friction
  bool has_pair = true;  // (1)
  double mu = 0;
  double w_n = 0, dw_n = 0, target_n = 0;
  ConePair cone;
  double A_w[3][3]{};
};

class InteriorPointContactSolver final : public ContactSolver {
 public:
  InteriorPointContactSolver(double tolerance, int iterations) : tolerance_(tolerance), most_iterations_(iterations) {}

  ContactStatus solve(const ContactProblem& problem, Vector& r) override;
  const FrictionPolygon& polygon() const override { return disc_; }
  void count(Counters& counters) override {
    counters.inner_iterations += iterations_;
    counters.matrix_factorizations += factorizations_;
    iterations_ = factorizations_ = 0;
    newton_.count(counters);
  }

 private:
  bool find(const ContactProblem& problem, Vector& r);
  void start(const ContactProblem& problem, double level);
  bool follow_path(const ContactProblem& problem, int& left, Vector& r);
  double project(const ContactProblem& problem, Vector& r);
  double best_step(const ContactProblem& problem, bool scaled);
  bool factorize(const ContactProblem& problem, bool scaled);
  bool find_step(const ContactProblem& problem, double t, bool second_order);
  double longest_step(const ContactProblem& problem) const;
  double mean(const ContactProblem& problem, double step) const;
  void advance(const ContactProblem& problem, double step);

  double tolerance_;
  int most_iterations_, iterations_ = 0, factorizations_ = 0;
  FrictionPolygon disc_;
  ContactMap map_;
  std::vector<Interior> interior_;
  Vector r_, dr_, w_, dw_, residual_, rhs_;
  ContactMatrix matrix_;
  ProjectionNewton newton_;
};

/// Sets the first point from the guess r_, w_, zero for a cold start. @param level  of the cold start
void InteriorPointContactSolver::start(const ContactProblem& problem, double level) {
  const auto& G = problem.G;
  double energy = 0;
  for (int i = 0; i < G.n_contacts(); ++i) {
    for (int d = 0; d < G.size(i); ++d)
      energy = std::max(energy, std::abs(problem.b[G.row(i) + d]) / std::sqrt(G.diagonal(i, d)));
  }
  for (int i = 0; i < G.n_contacts(); ++i) {
    const auto& contact = problem.contacts[i];
    Interior& c = interior_[i];
    c.n_t = contact.mu > 0 ? contact.n_t : 0;
    c.mu = contact.mu;
    c.has_pair = c.n_t == 0 || problem.law == FrictionLaw::coulomb;
    double *r = r_.data() + G.row(i), *w = w_.data() + G.row(i);
    const double velocity = level * energy * std::sqrt(G.diagonal(i, 0)), impulse = velocity / G.diagonal(i, 0);
    r[0] = std::max(r[0], 0.0);
    c.w_n = std::max(w[0], 0.0);
    for (int d = 1 + c.n_t; d <= contact.n_t; ++d) r[d] = 0;
    if (c.n_t > 0) {
      const double radius = c.mu * (r[0] + contact.present),
                   size = c.n_t == 1 ? std::abs(r[1]) : std::hypot(r[1], r[2]);
      for (int d = 1; d <= c.n_t && size > radius; ++d) r[d] *= radius / size;
      c.cone.x.setZero();
      c.cone.y.setZero();
      for (int d = 1; d <= c.n_t; ++d) c.cone.y[d] = w[d];
      c.cone.y[0] = std::max(tangent_norm(c.cone.y), c.has_pair ? 0 : c.w_n / c.mu) + velocity / c.mu;
    }
    r[0] += impulse;
    c.w_n += velocity;
  }
  advance(problem, 0);
}

void InteriorPointContactSolver::advance(const ContactProblem& problem, double step) {
  const int n = problem.G.n_rows();
  if (step > 0) r_.head(n) += step * dr_.head(n);
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    Interior& c = interior_[i];
    const double* r = r_.data() + problem.G.row(i);
    if (step > 0) c.w_n += step * c.dw_n;
    if (c.n_t == 0) continue;
    c.cone.x[0] = c.mu * (r[0] + problem.contacts[i].present);
    for (int d = 1; d <= c.n_t; ++d) c.cone.x[d] = r[d];
    if (step > 0) c.cone.y += step * c.cone.dy;
  }
}

/// @param r  out: the projection of r_; @return its violation
double InteriorPointContactSolver::project(const ContactProblem& problem, Vector& r) {
  const auto& G = problem.G;
  G.times(r_, problem.b, w_);
  for (int i = 0; i < G.n_contacts(); ++i) {
    double stiffest = 0;
    for (int d = 0; d < G.size(i); ++d) stiffest = std::max(stiffest, G.diagonal(i, d));
    const int row = G.row(i);
    map_.evaluate(problem.law, problem.contacts[i], 1 / stiffest, 1 / stiffest, r_.data() + row, w_.data() + row);
    for (int d = 0; d < G.size(i); ++d) r[row + d] = r_[row + d] - map_.F[d];
  }
  return violation(problem, r, disc_, w_);
}

/// The matrix of dr, and the residual of (3).
bool InteriorPointContactSolver::factorize(const ContactProblem& problem, bool scaled) {
  const auto& G = problem.G;
  G.times(r_, problem.b, residual_);
  matrix_.begin(G.n_contacts(), G.n_rows());
  for (int i = 0; i < G.n_contacts(); ++i) {
    Interior& c = interior_[i];
    const int row = G.row(i);
    double A_r[3][3]{}, (&A_w)[3][3] = c.A_w;
    for (auto& line : A_w) std::fill_n(line, 3, 0.0);
    for (int d = 1 + c.n_t; d < G.size(i); ++d) A_r[d][d] = 1;
    if (c.has_pair) {  // (4)
      A_r[0][0] = c.w_n;
      A_w[0][0] = r_[row];
      residual_[row] -= c.w_n;
    }
    if (c.n_t > 0) {
      if (scaled)
        c.cone.linearize_scaled();
      else
        c.cone.linearize_unscaled();
      const Matrix3d &P = c.cone.P, &Q = c.cone.Q;
      for (int d = c.has_pair ? 1 : 0; d <= c.n_t; ++d) {  // (5), without its first row and dgamma where there is (4)
        const double eliminated = c.has_pair ? Q(d, 0) / Q(0, 0) : 0;
        for (int e = 0; e <= c.n_t; ++e) {
          A_r[d][e] = (P(d, e) - eliminated * P(0, e)) * (e == 0 ? c.mu : 1);
          if (e > 0 || !c.has_pair) A_w[d][e] = (Q(d, e) - eliminated * Q(0, e)) / (e == 0 ? c.mu : 1);
        }
      }
      if (!c.has_pair) residual_[row] -= c.mu * c.cone.y[0];
      for (int d = 1; d <= c.n_t; ++d) residual_[row + d] -= c.cone.y[d];
    }
    matrix_.add_rows(G, i, A_r, A_w);
  }
  ++factorizations_;
  return matrix_.factorize();
}

/// (4)-(6) towards t = sigma t.
bool InteriorPointContactSolver::find_step(const ContactProblem& problem, double t, bool second_order) {
  const auto& G = problem.G;
  for (int i = 0; i < G.n_contacts(); ++i) {
    Interior& c = interior_[i];
    const int row = G.row(i);
    double right[3]{};
    if (c.has_pair) {
      c.target_n = t - r_[row] * c.w_n - (second_order ? dr_[row] * c.dw_n : 0);
      right[0] = c.target_n;
    }
    if (c.n_t > 0) {
      c.cone.aim(t, second_order);
      for (int d = c.has_pair ? 1 : 0; d <= c.n_t; ++d)
        right[d] = c.cone.target[d] - (c.has_pair ? c.cone.Q(d, 0) / c.cone.Q(0, 0) * c.cone.target[0] : 0);
    }
    for (int d = 0; d < G.size(i); ++d) {
      rhs_[row + d] = right[d];
      for (int e = 0; e < G.size(i); ++e) rhs_[row + d] -= c.A_w[d][e] * residual_[row + e];
    }
  }
  if (!matrix_.solve(rhs_, dr_)) return false;
  G.times(dr_, residual_, dw_);  // (6)
  for (int i = 0; i < G.n_contacts(); ++i) {
    Interior& c = interior_[i];
    const double *dr = dr_.data() + G.row(i), *dw = dw_.data() + G.row(i);
    c.dw_n = dw[0];
    if (c.n_t == 0) continue;
    Vector3d &dx = c.cone.dx, &dy = c.cone.dy;
    dx = {c.mu * dr[0], dr[1], c.n_t > 1 ? dr[2] : 0};
    dy = {c.has_pair ? 0 : dw[0] / c.mu, dw[1], c.n_t > 1 ? dw[2] : 0};
    if (c.has_pair) dy[0] = (c.cone.target[0] - c.cone.P.row(0).dot(dx) - c.cone.Q.row(0).dot(dy)) / c.cone.Q(0, 0);
  }
  return true;
}

double InteriorPointContactSolver::longest_step(const ContactProblem& problem) const {
  double step = kInfinity;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const Interior& c = interior_[i];
    const int row = problem.G.row(i);
    if (c.has_pair) step = std::min({step, to_boundary(r_[row], dr_[row]), to_boundary(c.w_n, c.dw_n)});
    if (c.n_t > 0)
      step = std::min({step, step_to_boundary(c.cone.x, c.cone.dx), step_to_boundary(c.cone.y, c.cone.dy)});
  }
  return step;
}

/// t of where a step leads, the mean over all pairs of (1), (2).
double InteriorPointContactSolver::mean(const ContactProblem& problem, double step) const {
  double sum = 0;
  int pairs = 0;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const Interior& c = interior_[i];
    const int row = problem.G.row(i);
    if (c.has_pair) sum += (r_[row] + step * dr_[row]) * (c.w_n + step * c.dw_n);
    if (c.n_t > 0) sum += (c.cone.x + step * c.cone.dx).dot(c.cone.y + step * c.cone.dy);
    pairs += c.has_pair + (c.n_t > 0);
  }
  return sum / pairs;
}

/// @return the length of the step that is ready; 0: there is none
double InteriorPointContactSolver::best_step(const ContactProblem& problem, bool scaled) {
  if (!factorize(problem, scaled) || !find_step(problem, 0, false)) return 0;
  const double t = mean(problem, 0), affine = mean(problem, std::min(1.0, longest_step(problem)));
  const double sigma = std::min(1.0, std::pow(affine / t, 3));
  double step = 0;
  for (const Way& way : kWays) {
    if (!find_step(problem, std::max(sigma, way.least) * t, way.second_order)) return 0;
    step = std::min(1.0, kToBoundary * longest_step(problem));
    if (step >= kShortStep) break;
  }
  return step;
}

/// Goes on from the point that start() has set. @return solved
bool InteriorPointContactSolver::follow_path(const ContactProblem& problem, int& left, Vector& r) {
  int blocked = 0;
  while (project(problem, r) > tolerance_) {
    if (left <= 0) return false;
    --left;
    ++iterations_;
    dr_.setZero();
    for (auto& c : interior_) {
      c.dw_n = 0;
      c.cone.dx.setZero();
      c.cone.dy.setZero();
    }
    double step = best_step(problem, false);
    if (!(step >= kShortStep)) step = best_step(problem, true);
    if (!(step > 0)) return false;
    blocked = step < kBlocked ? blocked + 1 : 0;
    if (blocked == kMaxBlocked) return false;
    advance(problem, step);
  }
  return true;
}

bool InteriorPointContactSolver::find(const ContactProblem& problem, Vector& r) {
  const int n = problem.G.n_rows();
  for (auto* x : {&r_, &dr_, &w_, &dw_, &residual_, &rhs_}) {
    if (x->size() < n) x->setZero(n);
  }
  if (interior_.size() < problem.contacts.size()) interior_.resize(problem.contacts.size());
  const double error = violation(problem, r, disc_, w_);
  if (error <= tolerance_) return true;
  int left = most_iterations_;
  if (error < 1) {
    r_.head(n) = r.head(n);
    start(problem, error);
    if (follow_path(problem, left, r)) return true;
  }
  for (const double level : kColdStarts) {
    left = most_iterations_;  // a warm start may have wasted its own
    r_.setZero();
    w_.setZero();
    start(problem, level);
    if (follow_path(problem, left, r) || newton_.iterate(problem, tolerance_, left, r)) return true;
  }
  return false;
}

ContactStatus InteriorPointContactSolver::solve(const ContactProblem& problem, Vector& r) {
  const bool solved = find(problem, r);
  clear_open_contacts(problem, r);
  return solved ? ContactStatus::solved : ContactStatus::iteration_limit;
}

}  // namespace

std::unique_ptr<ContactSolver> make_interior_point_contact_solver(double tolerance, int iterations) {
  return std::make_unique<InteriorPointContactSolver>(tolerance, iterations);
}

}  // namespace ricochet
