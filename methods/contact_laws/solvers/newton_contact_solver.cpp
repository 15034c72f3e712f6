// The semismooth Newton method of projection_newton.h as a contact solver. Where its line search finds nothing, it
// starts again: from the polyhedral solution, then after more and more Gauss-Seidel sweeps.

#include "methods/contact_laws/solvers/contact_solver.h"
#include "methods/contact_laws/solvers/projection_newton.h"

namespace ricochet {
namespace {

constexpr int kFacetsOfGuess = 8;
constexpr int kRestarts = 6;
constexpr int kSweepsOfRestart = 20;  // the first; five times as many each time

class NewtonContactSolver final : public ContactSolver {
 public:
  NewtonContactSolver(double tolerance, int iterations) : tolerance_(tolerance), most_iterations_(iterations) {}

  ContactStatus solve(const ContactProblem& problem, Vector& r) override;
  const FrictionPolygon& polygon() const override { return disc_; }
  void count(Counters& counters) override {
    newton_.count(counters);
    if (polyhedral_) polyhedral_->count(counters);
    for (auto& sweeps : restarts_) {
      if (sweeps) sweeps->count(counters);
    }
  }

 private:
  ContactStatus find(const ContactProblem& problem, Vector& r);

  double tolerance_;
  int most_iterations_;
  FrictionPolygon disc_;
  ProjectionNewton newton_;
  std::unique_ptr<ContactSolver> polyhedral_, restarts_[kRestarts];
};

ContactStatus NewtonContactSolver::solve(const ContactProblem& problem, Vector& r) {
  const ContactStatus status = find(problem, r);
  clear_open_contacts(problem, r);
  return status;
}

ContactStatus NewtonContactSolver::find(const ContactProblem& problem, Vector& r) {
  // From a cold start the contacts of a row settle one by one.
  int left = most_iterations_ + problem.G.n_rows();
  const auto iterate = [&] { return newton_.iterate(problem, tolerance_, left, r); };
  if (iterate()) return ContactStatus::solved;
  if (problem.G.n_contacts() <= kMaxDenseContacts) {
    // A polygon in place of the disc: near the solution, and in the plane the solution itself.
    if (!polyhedral_) polyhedral_ = make_lemke_contact_solver(kFacetsOfGuess);
    if (polyhedral_->solve(problem, r) == ContactStatus::solved && iterate()) return ContactStatus::solved;
  }
  int sweeps = kSweepsOfRestart;
  for (auto& restart : restarts_) {
    if (!restart) restart = make_gauss_seidel_contact_solver(tolerance_, sweeps);
    if (restart->solve(problem, r) == ContactStatus::solved || iterate()) return ContactStatus::solved;
    if (left <= 0) break;
    sweeps *= 5;
  }
  return ContactStatus::iteration_limit;
}

}  // namespace

std::unique_ptr<ContactSolver> make_newton_contact_solver(double tolerance, int iterations) {
  return std::make_unique<NewtonContactSolver>(tolerance, iterations);
}

}  // namespace ricochet
