#pragma once

#include "methods/contact_laws/solvers/contact_solver.h"
#include "methods/contact_laws/solvers/projection_newton.h"

namespace ricochet {

/// Contact solvers on the friction disc whose work is that of ProjectionNewton: they differ in their fallback when its
/// line search fails.
class NewtonBasedSolver : public ContactSolver {
 public:
  ContactStatus solve(const ContactProblem& problem, Vector& r) final {
    const ContactStatus status = find(problem, r);
    clear_open_contacts(problem, r);
    return status;
  }
  const FrictionPolygon& polygon() const final { return disc_; }

 protected:
  NewtonBasedSolver(double tolerance, int iterations) : tolerance_(tolerance), most_iterations_(iterations) {}

  virtual ContactStatus find(const ContactProblem& problem, Vector& r) = 0;
  /// From a cold start the contacts of a row settle one by one.
  int iterations_for(const ContactProblem& problem) const { return most_iterations_ + problem.G.n_rows(); }

  const double tolerance_;
  ProjectionNewton newton_;

 private:
  const int most_iterations_;
  const FrictionPolygon disc_;
};

}  // namespace ricochet
