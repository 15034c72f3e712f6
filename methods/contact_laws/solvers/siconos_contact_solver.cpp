// Siconos' numerics as a contact solver, for cross-checks: without friction Lemke's method (SICONOS_LCP_LEMKE), with
// friction nonsmooth Gauss-Seidel, in the plane (SICONOS_FRICTION_2D_NSGS) and on the disc in space
// (SICONOS_FRICTION_3D_NSGS). Whether it has solved a problem is measured as for the others, by violation(). It
// allocates. Siconos measures its error in the norm of all contacts, so each contact gets a unit of its own:
//
//     W_ij -> s_i W_ij s_j,  q_i -> s_i q_i,  r_i = s_i z_i,  s_i = 2^k with s_i^2 max diag W_ii in [1/2, 2]              (1)
//
// Not SICONOS_FRICTION_2D_LEMKE: in Siconos 4.4.0 its linear complementarity problem has mu of the row's contact where
// that of the column's belongs (fc2d_tolcp), so that it is wrong for contacts whose mu differ.
//
// Source: Acary, Bonnefon, Bremond, Huber, Perignon, Sinclair, An introduction to Siconos, INRIA RT-0340.

#include <FrictionContactProblem.h>
#include <Friction_cst.h>
#include <LinearComplementarityProblem.h>
#include <NonSmoothDrivers.h>
#include <NumericsMatrix.h>
#include <NumericsVerbose.h>
#include <SolverOptions.h>
#include <lcp_cst.h>

#include <cmath>

#include "methods/contact_laws/solvers/contact_solver.h"
#include "methods/contact_laws/uniform_contacts.h"

namespace ricochet {
namespace {

constexpr double kPartOfTolerance = 0.1;  // Siconos measures the error relative to ||q||, not to its largest entry

struct DeleteMatrix {
  void operator()(NumericsMatrix* matrix) const {
    NM_clear(matrix);
    free(matrix);
  }
};
struct DeleteOptions {
  void operator()(SolverOptions* options) const {
    solver_options_delete(options);
    free(options);
  }
};

class SiconosContactSolver final : public ContactSolver {
 public:
  SiconosContactSolver(double tolerance, int iterations) : tolerance_(tolerance), most_iterations_(iterations) {}

  ContactStatus solve(const ContactProblem& problem, Vector& r) override;
  const FrictionPolygon& polygon() const override { return disc_; }
  void count(Counters& counters) override {
    counters.inner_iterations += iterations_;
    iterations_ = 0;
  }

 private:
  double error(const ContactProblem& problem, const Vector& r) {
    w_.resize(problem.G.n_rows());
    return violation(problem, r, disc_, w_);
  }

  double tolerance_;
  int most_iterations_, iterations_ = 0;
  FrictionPolygon disc_;
  Vector w_;
};

/// s of (1), per row.
Vector units_of(const Matrix& W, int dimension) {
  Vector s = Vector::Ones(W.rows());
  for (Eigen::Index row = 0; row < W.rows(); row += dimension) {
    const double largest = W.diagonal().segment(row, dimension).maxCoeff();
    if (largest > 0) s.segment(row, dimension).setConstant(std::exp2(-std::round(std::log2(largest) / 2)));
  }
  return s;
}

ContactStatus SiconosContactSolver::solve(const ContactProblem& problem, Vector& r) {
  if (error(problem, r) <= tolerance_) return ContactStatus::solved;
  UniformContacts uniform(problem, 1);
  const int n = static_cast<int>(uniform.q.size()),
            kinds[] = {SICONOS_LCP_LEMKE, SICONOS_FRICTION_2D_NSGS, SICONOS_FRICTION_3D_NSGS};
  numerics_set_verbose(0);
  const std::unique_ptr<NumericsMatrix, DeleteMatrix> W(NM_create(NM_DENSE, n, n));
  const Matrix dense(uniform.W);
  const Vector s = units_of(dense, uniform.dimension);
  Eigen::Map<Matrix>(W->matrix0, n, n) = s.asDiagonal() * dense * s.asDiagonal();
  Vector q = s.cwiseProduct(uniform.q);
  const std::unique_ptr<SolverOptions, DeleteOptions> options(solver_options_create(kinds[uniform.dimension - 1]));
  options->iparam[SICONOS_IPARAM_MAX_ITER] = most_iterations_;
  options->dparam[SICONOS_DPARAM_TOL] = kPartOfTolerance * tolerance_;
  Vector z = uniform.pack(r).cwiseQuotient(s), u = Vector::Zero(n);
  if (uniform.dimension == 1) {
    LinearComplementarityProblem lcp{};
    lcp.size = n;
    lcp.M = W.get();
    lcp.q = q.data();
    linearComplementarity_driver(&lcp, z.data(), u.data(), options.get());
  } else {
    FrictionContactProblem friction{};
    friction.dimension = uniform.dimension;
    friction.numberOfContacts = problem.G.n_contacts();
    friction.M = W.get();
    friction.q = q.data();
    friction.mu = uniform.mu.data();
    const auto driver = uniform.dimension == 2 ? fc2d_driver : fc3d_driver;
    driver(&friction, z.data(), u.data(), options.get());
  }
  iterations_ += options->iparam[SICONOS_IPARAM_ITER_DONE];
  if (!z.allFinite()) return ContactStatus::no_solution;
  uniform.unpack(s.cwiseProduct(z), r);
  return error(problem, r) <= tolerance_ ? ContactStatus::solved : ContactStatus::iteration_limit;
}

}  // namespace

bool has_siconos_contact_solver() {
  return true;
}

std::unique_ptr<ContactSolver> make_siconos_contact_solver(double tolerance, int iterations) {
  return std::make_unique<SiconosContactSolver>(tolerance, iterations);
}

}  // namespace ricochet
