// Staggered projections: normal impulses with friction held, friction with the normal impulses held, in turn.
//
//   r_n+ = argmin_{r_n >= 0}                      1/2 r_n' G_nn r_n + r_n' (b_n + G_nt r_t)                 (1)
//   r_t+ = argmin_{||r_t|| <= mu (r_n+ + p)}      1/2 r_t' G_tt r_t + r_t' (b_t + G_tn r_n+)                (2)
//
// Each is a convex problem, and a point that both leave alone fulfils Coulomb's law. Both are contact problems
// themselves: (1) has no friction; in (2) the impulse r_n+ + p is the one that is already there, and the normal rows
// are open contacts which nothing moves. So both are solved by `exact`, which starts from the sweep before.
//
// No theorem says that the sweeps converge. They do where normal impulses and friction move each other little; where
// they turn in a circle, half of the way is gone in (2): a mean of points of a circle is nearer to what it surrounds.
//
// Differs from the source: which minimises the change of kinetic energy on polygons, and stops after a few sweeps.
//
// Source: Kaufman, Sueda, James, Pai, Staggered projections for frictional contact in multibody systems, ACM Trans.
// Graph. 27 (2008), article 164.

#include "methods/contact_laws/solvers/contact_solver.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

constexpr double kPartOfTolerance = 0.1;  // of (1), (2): their errors add
constexpr int kInnerIterations = 200;
constexpr int kPatience = 20;  // sweeps without a smaller violation that shorten the way of (2)
constexpr double kShortest = 1.0 / 64;

class StaggeredContactSolver final : public ContactSolver {
 public:
  StaggeredContactSolver(double tolerance, int sweeps)
      : tolerance_(tolerance),
        most_sweeps_(sweeps),
        normal_solver_(make_exact_contact_solver(kPartOfTolerance * tolerance, kInnerIterations)),
        friction_solver_(make_exact_contact_solver(kPartOfTolerance * tolerance, kInnerIterations)) {}

  ContactStatus solve(const ContactProblem& problem, Vector& r) override;
  const FrictionPolygon& polygon() const override { return disc_; }
  void count(Counters& counters) override {
    normal_solver_->count(counters);
    friction_solver_->count(counters);
  }

 private:
  void split(const ContactProblem& problem);
  void project_normal(const ContactProblem& problem, Vector& r);
  void project_friction(const ContactProblem& problem, double way, Vector& r);

  double tolerance_;
  int most_sweeps_;
  FrictionPolygon disc_;
  std::unique_ptr<ContactSolver> normal_solver_, friction_solver_;
  ContactProblem normal_, friction_;
  std::vector<int> sizes_, neighbours_;
  Vector r_n_, r_t_, part_, w_;
};

/// The operators of (1) and (2), with the blocks of G.
void StaggeredContactSolver::split(const ContactProblem& problem) {
  const auto& G = problem.G;
  const int n = G.n_contacts();
  sizes_.assign(n, 1);
  normal_.G.set_sizes(sizes_);
  normal_.contacts.clear();
  friction_.contacts.clear();
  for (int i = 0; i < n; ++i) {
    sizes_[i] = G.size(i);
    normal_.contacts.push_back({.id = problem.contacts[i].id});
    friction_.contacts.push_back(problem.contacts[i]);
  }
  friction_.G.set_sizes(sizes_);
  for (int i = 0; i < n; ++i) {
    neighbours_.clear();
    for (int k = 0; k < G.n_neighbours(i); ++k) neighbours_.push_back(G.block(i, k).contact);
    normal_.G.add_row(neighbours_);
    friction_.G.add_row(neighbours_);
  }
  for (int i = 0; i < n; ++i) {
    const int rows = G.size(i);
    for (int k = 0; k < G.n_neighbours(i); ++k) {
      const auto block = G.block(i, k);
      *normal_.G.values(i, k) = block.values[0];
      double* values = friction_.G.values(i, k);
      for (int c = 0; c < block.size; ++c) {
        for (int d = 0; d < rows; ++d) {
          const bool is_normal = c == 0 || d == 0, is_own = block.contact == i && c == 0 && d == 0;
          values[c * rows + d] = is_normal && !is_own ? 0 : block.values[c * rows + d];
        }
      }
    }
  }
}

/// (1)
void StaggeredContactSolver::project_normal(const ContactProblem& problem, Vector& r) {
  const auto& G = problem.G;
  for (int i = 0; i < G.n_contacts(); ++i) {
    part_.segment(G.row(i), G.size(i)) = r.segment(G.row(i), G.size(i));
    part_[G.row(i)] = 0;
    r_n_[i] = r[G.row(i)];
  }
  G.times(part_, problem.b, w_);
  for (int i = 0; i < G.n_contacts(); ++i) normal_.b[i] = w_[G.row(i)];
  normal_solver_->solve(normal_, r_n_);
  for (int i = 0; i < G.n_contacts(); ++i) r[G.row(i)] = r_n_[i];
}

/// (2). @param way  that r_t goes to its new value
void StaggeredContactSolver::project_friction(const ContactProblem& problem, double way, Vector& r) {
  const auto& G = problem.G;
  const int n = G.n_rows();
  part_.head(n).setZero();
  for (int i = 0; i < G.n_contacts(); ++i) part_[G.row(i)] = r[G.row(i)];
  G.times(part_, problem.b, w_);
  for (int i = 0; i < G.n_contacts(); ++i) {
    const int row = G.row(i);
    friction_.contacts[i].present = r[row] + problem.contacts[i].present;
    friction_.b.segment(row, G.size(i)) = w_.segment(row, G.size(i));
    friction_.b[row] = 0;
    friction_.b[row] = friction_.b.segment(row, G.size(i)).cwiseAbs().maxCoeff();  // changes no scale
    r_t_.segment(row, G.size(i)) = r.segment(row, G.size(i));
    r_t_[row] = 0;
  }
  friction_solver_->solve(friction_, r_t_);
  for (int i = 0; i < G.n_contacts(); ++i) {
    for (int d = 1; d < G.size(i); ++d) {
      const int row = G.row(i) + d;
      r[row] += way * (r_t_[row] - r[row]);
    }
  }
}

ContactStatus StaggeredContactSolver::solve(const ContactProblem& problem, Vector& r) {
  const int n = problem.G.n_rows();
  if (problem.law == FrictionLaw::associated) {
    for (const auto& contact : problem.contacts) {
      if (contact.n_t > 0)
        throw InputError(
            "solver=staggered: the associated law has no normal part of its own; Coulomb's law is required");
    }
  }
  for (auto* x : {&r_n_, &r_t_, &part_, &w_, &normal_.b, &friction_.b}) {
    if (x->size() < n) x->setZero(n);
  }
  double error = violation(problem, r, disc_, w_), best = error, way = 1;
  if (error <= tolerance_) return ContactStatus::solved;
  split(problem);
  int patience = kPatience;
  for (int k = 0; k < most_sweeps_; ++k) {
    project_normal(problem, r);
    project_friction(problem, way, r);
    error = violation(problem, r, disc_, w_);
    if (error <= tolerance_) {
      clear_open_contacts(problem, r);
      return ContactStatus::solved;
    }
    if (error < best) {
      best = error;
      patience = kPatience;
    } else if (--patience == 0) {
      way = std::max(0.5 * way, kShortest);
      patience = kPatience;
    }
  }
  return ContactStatus::iteration_limit;
}

}  // namespace

std::unique_ptr<ContactSolver> make_staggered_contact_solver(double tolerance, int sweeps) {
  return std::make_unique<StaggeredContactSolver>(tolerance, sweeps);
}

}  // namespace ricochet
