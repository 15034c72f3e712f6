// The disc for who chose no solver: the semismooth Newton method (projection_newton.h), which warm starts make the
// fastest, and where its line search finds nothing the interior-point method, which needs no guess.
//
// What neither solves to the tolerance is nearly redundant, a box on four corners that are not quite in one plane:
// velocities that differ by less than the tolerance belong to impulses that differ by all of themselves. There the
// interior-point method is asked for a hundred times the tolerance, or for what time stepping of order 1 asks for always:
// still far below the error of a time step.

#include <algorithm>

#include "methods/contact_laws/solvers/newton_based_solver.h"

namespace ricochet {
namespace {

constexpr double kNearlyRedundant = 100;  // times the tolerance
constexpr int kInteriorIterations = 100;

class ExactContactSolver final : public NewtonBasedSolver {
 public:
  ExactContactSolver(double tolerance, int iterations) : NewtonBasedSolver(tolerance, iterations) {}

  void count(Counters& counters) override {
    newton_.count(counters);
    for (auto& interior : interior_) {
      if (interior) interior->count(counters);
    }
  }

 private:
  ContactStatus find(const ContactProblem& problem, Vector& r) override;

  std::unique_ptr<ContactSolver> interior_[2];  // with the tolerance, and with that of nearly redundant problems
  Vector guess_;
};

ContactStatus ExactContactSolver::find(const ContactProblem& problem, Vector& r) {
  guess_ = r;
  int left = iterations_for(problem);
  if (newton_.iterate(problem, tolerance_, left, r)) return ContactStatus::solved;
  double tolerance = tolerance_;
  for (auto& interior : interior_) {
    if (!interior) interior = make_interior_point_contact_solver(tolerance, kInteriorIterations);
    r = guess_;
    if (interior->solve(problem, r) == ContactStatus::solved) return ContactStatus::solved;
    tolerance = std::max(kNearlyRedundant * tolerance_, kContactTolerance);
  }
  return ContactStatus::iteration_limit;
}

}  // namespace

std::unique_ptr<ContactSolver> make_exact_contact_solver(double tolerance, int iterations) {
  return std::make_unique<ExactContactSolver>(tolerance, iterations);
}

}  // namespace ricochet
