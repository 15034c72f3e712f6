#pragma once

#include <limits>
#include <memory>
#include <vector>

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

/// The reason as text for a status message.
const char* reason_of(ContactStatus status);

/// Solves contact problems, step after step. All storage is kept between calls.
class ContactSolver {
 public:
  virtual ~ContactSolver() = default;

  /// @param r  G.n_rows(): in a guess, the impulses of the step before; out the solution
  virtual ContactStatus solve(const ContactProblem& problem, Vector& r) = 0;
  /// Model of friction in space: a polygon, or the disc.
  virtual const FrictionPolygon& polygon() const = 0;
  /// Adds its work since the last call.
  virtual void count(Counters& counters) = 0;
};

/// automatic: `exact` with friction in space, otherwise lemke, which is exact there.
/// exact: newton, or interior_point if newton fails.
enum class ContactSolverKind { automatic, lemke, exact, pgs, newton, interior_point, admm, staggered, siconos };

/// Properties of a kind of contact solver.
struct ContactSolverEntry {
  const char* name;  ///< the value of the option solver=
  ContactSolverKind kind;
  int usual_iterations;  ///< contact_iterations= where it is not given; 0: pivoting has no such limit
  int most_contacts = std::numeric_limits<int>::max();  ///< comparisons of all solvers skip it above: it takes seconds
};

/// The solvers of this build, in the order of tables; without automatic, which is one of them.
const std::vector<ContactSolverEntry>& contact_solvers();
const ContactSolverEntry& contact_solver(ContactSolverKind kind);

constexpr double kContactTolerance = 1e-9;

struct ContactSolverOptions {
  ContactSolverKind kind = ContactSolverKind::automatic;
  int facets = 8;  ///< of a polygon in place of the disc: lemke
  /// violation() to be reached by all others: far below the error of any time step, and what Lemke's method may leave
  /// in a redundant problem
  double tolerance = kContactTolerance;
  /// Limit: sweeps of pgs and staggered, steps of interior_point and admm; of newton and exact beside one per row.
  int iterations = 0;
};

/// Options solver=automatic|lemke|exact|pgs|newton|interior_point|admm|staggered|siconos; facets=8, which selects
/// lemke; contact_tolerance=, contact_iterations= of the solvers that iterate. @param tolerance  without
/// contact_tolerance=
ContactSolverOptions contact_solver_argument(const MethodSpec& spec, double tolerance = kContactTolerance);
/// The options of a contact solver in usage texts.
constexpr const char* kContactSolverUsage =
    "[,solver=automatic|lemke[,facets=8]]"
    "[,solver=exact|pgs|newton|interior_point|admm|staggered|siconos"
    "[,contact_tolerance=1e-9][,contact_iterations=N]]";
/// The same for methods of order 2 in persistent contact, whose errors may be as small as the sum of 1e-9 per step.
constexpr const char* kTightContactSolverUsage =
    "[,solver=automatic|lemke[,facets=8]]"
    "[,solver=exact|pgs|newton|interior_point|admm|staggered|siconos"
    "[,contact_tolerance=1e-12][,contact_iterations=N]]";
constexpr double kTightContactTolerance = 1e-12;

/// Replaces `automatic` by the solver for this problem; other options stay unchanged.
ContactSolverOptions options_for(const ProblemInfo& problem, ContactSolverOptions options);
/// @param options  not of the kind automatic
std::unique_ptr<ContactSolver> make_contact_solver(const ContactSolverOptions& options);

// One file each.
std::unique_ptr<ContactSolver> make_lemke_contact_solver(int facets);
std::unique_ptr<ContactSolver> make_exact_contact_solver(double tolerance, int iterations);
std::unique_ptr<ContactSolver> make_gauss_seidel_contact_solver(double tolerance, int sweeps);
std::unique_ptr<ContactSolver> make_newton_contact_solver(double tolerance, int iterations);
std::unique_ptr<ContactSolver> make_interior_point_contact_solver(double tolerance, int iterations);
std::unique_ptr<ContactSolver> make_admm_contact_solver(double tolerance, int iterations);
/// Its solve() throws InputError for the associated law with friction.
std::unique_ptr<ContactSolver> make_staggered_contact_solver(double tolerance, int sweeps);
/// Siconos' numerics, for cross-checks. Its solve() throws InputError for what uniform_contacts.h declines.
std::unique_ptr<ContactSolver> make_siconos_contact_solver(double tolerance, int iterations);
bool has_siconos_contact_solver();  ///< built

/// Up to this many contacts matrices are dense.
constexpr int kMaxDenseContacts = 40;

}  // namespace ricochet
