// The semismooth Newton method of projection_newton.h as a contact solver. Where its line search finds nothing, it
// starts again: from the polyhedral solution, then after more and more Gauss-Seidel sweeps.

#include "methods/contact_laws/solvers/newton_based_solver.h"

namespace ricochet {
namespace {

constexpr int kFacetsOfGuess = 8;
constexpr int kRestarts = 6;
constexpr int kSweepsOfRestart = 20;  // the first; five times as many each time

class NewtonContactSolver final : public NewtonBasedSolver {
 public:
  NewtonContactSolver(double tolerance, int iterations) : NewtonBasedSolver(tolerance, iterations) {}

  void count(Counters& counters) override {
    newton_.count(counters);
    if (polyhedral_) polyhedral_->count(counters);
    for (auto& sweeps : restarts_) {
      if (sweeps) sweeps->count(counters);
    }
  }

 private:
  ContactStatus find(const ContactProblem& problem, Vector& r) override;

  std::unique_ptr<ContactSolver> polyhedral_, restarts_[kRestarts];
};

ContactStatus NewtonContactSolver::find(const ContactProblem& problem, Vector& r) {
  int left = iterations_for(problem);
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
