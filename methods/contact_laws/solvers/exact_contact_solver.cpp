// The disc for who chose no solver: the semismooth Newton method (projection_newton.h), which warm starts make the
// fastest, and where its line search finds nothing the interior-point method, which needs no guess.
//
// What neither solves to the tolerance is nearly redundant, a box on four corners that are not quite in one plane:
// velocities that differ by less than the tolerance belong to impulses that differ by all of themselves. There the
// interior-point method is asked for a hundred times the tolerance, which is still far below the error of a time step.

#include "methods/contact_laws/solvers/contact_solver.h"
#include "methods/contact_laws/solvers/projection_newton.h"

namespace ricochet {
namespace {

constexpr double kNearlyRedundant = 100;  // times the tolerance
constexpr int kInteriorIterations = 100;

class ExactContactSolver final : public ContactSolver {
 public:
  ExactContactSolver(double tolerance, int iterations) : tolerance_(tolerance), most_iterations_(iterations) {}

  ContactStatus solve(const ContactProblem& problem, Vector& r) override;
  const FrictionPolygon& polygon() const override { return disc_; }
  void count(Counters& counters) override {
    newton_.count(counters);
    for (auto& interior : interior_) {
      if (interior) interior->count(counters);
    }
  }

 private:
  bool find(const ContactProblem& problem, Vector& r);

  double tolerance_;
  int most_iterations_;
  FrictionPolygon disc_;
  ProjectionNewton newton_;
  std::unique_ptr<ContactSolver> interior_[2];  // with the tolerance, and with that of nearly redundant problems
  Vector guess_;
};

bool ExactContactSolver::find(const ContactProblem& problem, Vector& r) {
  guess_ = r;
  int left = most_iterations_ + problem.G.n_rows();  // from a cold start the contacts of a row settle one by one
  if (newton_.iterate(problem, tolerance_, left, r)) return true;
  double tolerance = tolerance_;
  for (auto& interior : interior_) {
    if (!interior) interior = make_interior_point_contact_solver(tolerance, kInteriorIterations);
    r = guess_;
    if (interior->solve(problem, r) == ContactStatus::solved) return true;
    tolerance *= kNearlyRedundant;
  }
  return false;
}

ContactStatus ExactContactSolver::solve(const ContactProblem& problem, Vector& r) {
  const bool solved = find(problem, r);
  clear_open_contacts(problem, r);
  return solved ? ContactStatus::solved : ContactStatus::iteration_limit;
}

}  // namespace

std::unique_ptr<ContactSolver> make_exact_contact_solver(double tolerance, int iterations) {
  return std::make_unique<ExactContactSolver>(tolerance, iterations);
}

}  // namespace ricochet
