#pragma once

#include <memory>

#include "methods/contact_laws/contact_problem.h"
#include "methods/method_spec.h"
#include "problems/solution.h"

namespace ricochet {

enum class ContactStatus {
  solved,
  no_solution,      ///< pivoting ended on a ray
  iteration_limit,  ///< the tolerance was not reached
  dependent,        ///< bilateral constraints depend on each other
};

/// The reason in the words of a status message.
const char* reason_of(ContactStatus status);

/// Solves contact problems, step after step. All storage is kept between calls.
class ContactSolver {
 public:
  virtual ~ContactSolver() = default;

  /// @param r  G.n_rows(): in a guess, the impulses of the step before; out the solution
  virtual ContactStatus solve(const ContactProblem& problem, Vector& r) = 0;
  /// Friction in space that it solves with: a polygon, or the disc.
  virtual const FrictionPolygon& polygon() const = 0;
  /// Adds its work since the last call.
  virtual void count(Counters& counters) = 0;
};

/// automatic: lemke for problems without friction in space, where it is exact; exact with it.
/// exact: newton, and where that fails interior_point.
enum class ContactSolverKind { automatic, lemke, exact, pgs, newton, interior_point, siconos };

struct ContactSolverOptions {
  ContactSolverKind kind = ContactSolverKind::automatic;
  int facets = 8;  ///< of a polygon in place of the disc: lemke
  /// violation() to be reached by all others: far below the error of any time step, and what Lemke's method may leave
  /// in a redundant problem
  double tolerance = 1e-9;
  int iterations = 0;  ///< limit: sweeps of pgs, steps of interior_point; of newton and exact beside one per row
};

/// Options solver=automatic|lemke|exact|pgs|newton|interior_point|siconos; facets=8 of lemke, which it asks for;
/// contact_tolerance=, contact_iterations= of the solvers that iterate.
ContactSolverOptions contact_solver_argument(const MethodSpec& spec);
/// The options of a contact solver in usage texts.
constexpr const char* kContactSolverUsage =
    "[,solver=automatic|lemke[,facets=8]]"
    "[,solver=exact|pgs|newton|interior_point|siconos[,contact_tolerance=1e-9][,contact_iterations=N]]";

/// What automatic chooses for a problem; other options as they are.
ContactSolverOptions options_for(const ProblemInfo& problem, ContactSolverOptions options);
/// @param options  not of the kind automatic
std::unique_ptr<ContactSolver> make_contact_solver(const ContactSolverOptions& options);

// One file each.
std::unique_ptr<ContactSolver> make_lemke_contact_solver(int facets);
std::unique_ptr<ContactSolver> make_exact_contact_solver(double tolerance, int iterations);
std::unique_ptr<ContactSolver> make_gauss_seidel_contact_solver(double tolerance, int sweeps);
std::unique_ptr<ContactSolver> make_newton_contact_solver(double tolerance, int iterations);
std::unique_ptr<ContactSolver> make_interior_point_contact_solver(double tolerance, int iterations);
/// Siconos' numerics, for cross-checks. Its solve() throws InputError for what uniform_contacts.h declines.
std::unique_ptr<ContactSolver> make_siconos_contact_solver(double tolerance, int iterations);
bool has_siconos_contact_solver();  ///< built

/// Up to this many contacts matrices are dense.
constexpr int kMaxDenseContacts = 40;

}  // namespace ricochet
