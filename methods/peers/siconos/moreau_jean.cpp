// Siconos' Moreau-Jean time stepping, as its class MoreauJeanOSI states it:
//
//   M(q_{k+1}) (v_{k+1} - v_k) = h (theta F_{k+1} + (1 - theta) F_k) + sum_i H_i' P_i,   by Newton's method   (1)
//   q_{k+1} = q_k + h (theta v_{k+1} + (1 - theta) v_k)                                                      (2)
//   0 <= P_n^i  _|_  U_n^i + eps_r^i U_n^i(v_k) >= 0,  U^i = H_i v_{k+1},   for i with y_i + h/2 y_i' <= 0       (3)
//   P^i = 0 for the others
//
// y_i, y_i' in (3) are those of the step's start. With friction Coulomb's law joins (3), as Siconos' FrictionContact.
// An affine problem takes one Newton iteration, and its matrix is factorised once.
//
// Two more of its schemes project q_{k+1} after (1) to (3), which stay as they are but for their index set I:
//
//   direct:    q_{k+1} += H' nu,  0 <= nu_i  _|_  y_i(q_{k+1}) >= 0,  i in I, the contacts of (3)                   (4)
//   combined:  q_{k+1} += H' nu,  y_i(q_{k+1}) = 0,  i in I                                                        (5)
//     I = {} at first; while there are i not in I with y_i <= 0 at the end of (1) to (3), these join I: all again
//
// by the classes MoreauJeanDirectProjectionOSI and MoreauJeanCombinedProjectionOSI, with H of q_{k+1}: the nearest
// position in the norm of the coordinates, not in that of M. Both are iterated where y is curved. (4) moves an active
// contact that penetrates, (5) every contact of the step; one that another's projection has closed stays closed too far
// until the next step.
//
// Source: Acary, Bonnefon, Bremond, Huber, Perignon, Sinclair: An introduction to Siconos, INRIA RT-0340; the scheme is
// Jean's, CMAME 177 (1999), the projections are those of Acary, CMAME 256 (2013) 224-250.

#include <SolverOptions.h>
#include <fmt/format.h>

#include <FrictionContact.hpp>
#include <Interaction.hpp>
#include <LCP.hpp>
#include <MLCPProjectOnConstraints.hpp>
#include <MoreauJeanCombinedProjectionOSI.hpp>
#include <MoreauJeanDirectProjectionOSI.hpp>
#include <MoreauJeanOSI.hpp>
#include <TimeDiscretisation.hpp>
#include <TimeStepping.hpp>
#include <TimeSteppingCombinedProjection.hpp>
#include <TimeSteppingDirectProjection.hpp>
#include <algorithm>
#include <limits>

#include "methods/peers/siconos/integrate.h"
#include "methods/peers/siconos/model.h"
#include "methods/regions/until_run.h"
#include "methods/time_limit.h"
#include "problems/dense_solve.h"

namespace ricochet::siconos {
namespace {

// The impulse that may pull, as a part of that of the whole run: Lemke's method on redundant contacts ends with such.
constexpr double kPull = 1e-9;
// Relative to the impulse of the whole run: Siconos' own tolerance is absolute, in N s.
constexpr double kNewtonResidual = 1e-11;
constexpr int kMaxNewtonIterations = 50;
constexpr double kContactResidual = 1e-9;  // relative, of an iterated contact problem: far below a time step's error
constexpr int kMaxContactIterations = 10000;
constexpr double kGap = 1e-10;  // what (4), (5) leave, as a part of the length of the whole run
constexpr int kMaxProjections = 50;
constexpr int kPositionSolver = SICONOS_MLCP_ENUM;  // others fail, or end the process (../README.md)

/// Siconos calls back with the result of its contact solver; only an exception ends its step.
struct NoContactSolution {
  int info;
};

/// (3) as Siconos' problem and solver: pivoting in the plane and without friction, in space a Gauss-Seidel iteration
/// over the contacts.
SP::OneStepNSProblem contact_problem(int n_t) {
  if (n_t == 0) return std::make_shared<LCP>(SICONOS_LCP_LEMKE);
  if (n_t == 1) return std::make_shared<FrictionContact>(2, SICONOS_FRICTION_2D_LEMKE);
  auto problem = std::make_shared<FrictionContact>(3, SICONOS_FRICTION_3D_NSGS);
  problem->numericsSolverOptions()->dparam[SICONOS_DPARAM_TOL] = kContactResidual;
  problem->numericsSolverOptions()->iparam[SICONOS_IPARAM_MAX_ITER] = kMaxContactIterations;
  return problem;
}

/// (1) to (3), with the chosen projection where there are contacts. Siconos asks for a problem (3) even without any.
std::shared_ptr<TimeStepping> make_simulation(const Model& model, const ProblemInfo& info, double h, double theta,
                                              Projection projection, double gap_tolerance) {
  const auto times = std::make_shared<TimeDiscretisation>(0.0, h);
  const auto velocities = contact_problem(info.n_c() > 0 ? info.contacts.front().n_t : 0);
  if (info.n_c() == 0 || projection == Projection::none) {
    auto simulation = std::make_shared<TimeStepping>(model.system(), times, 0);
    simulation->insertIntegrator(std::make_shared<MoreauJeanOSI>(theta));
    simulation->insertNonSmoothProblem(velocities);
    return simulation;
  }
  const auto positions = std::make_shared<MLCPProjectOnConstraints>(kPositionSolver);
  const auto project = [&](auto simulation) {
    simulation->setConstraintTolUnilateral(gap_tolerance);
    simulation->setProjectionMaxIteration(kMaxProjections);
    return simulation;
  };
  if (projection == Projection::direct)
    return project(std::make_shared<TimeSteppingDirectProjection>(
        model.system(), times, std::make_shared<MoreauJeanDirectProjectionOSI>(theta), velocities, positions));
  return project(std::make_shared<TimeSteppingCombinedProjection>(
      model.system(), times, std::make_shared<MoreauJeanCombinedProjectionOSI>(theta), velocities, positions));
}

}  // namespace

Solution integrate_moreau_jean(const Problem& problem, const Settings& settings, double theta, Projection projection) {
  const ProblemInfo& info = problem.info();
  Solution solution;
  Counters& counters = solution.counters;
  solution.q = info.q0;
  solution.v = info.v0;
  const double h = info.end_time / settings.steps;
  const TimeLimit time_limit(settings.time_limit);
  Vector Lambda_n = Vector::Zero(info.n_c()), Lambda_t = Vector::Zero(info.n_lambda_t);
  Vector q_minus = info.q0, v_minus = info.v0, gap(info.n_c());
  std::vector<char> was_pressed(info.n_c(), false);
  const auto stop = [&](Status status, int k, const std::string& reason) {
    solution.status = status;
    solution.message = fmt::format("step {} of {}, from t = {:.6g} s: {}", k + 1, settings.steps, k * h, reason);
  };

  int k = 0;
  try {
    const Model model(problem, info.end_time + 2 * h, Bodies::as_coupled);  // Siconos asks for events beyond the last
    const Matrix M = problem.mass_matrix(info.q0);
    const Vector f = problem.force(info.q0, info.v0);
    const double impulse = std::max((M * info.v0).norm(), info.end_time * f.norm());
    const double length = info.end_time * std::max(info.v0.norm(), info.end_time * solve_partial_pivoting(M, f).norm());
    const double gap_tolerance = std::max(kGap * length, std::numeric_limits<double>::min());  // > 0 even at rest
    const bool projects = projection != Projection::none && info.n_c() > 0;
    const auto simulation = make_simulation(model, info, h, theta, projection, gap_tolerance);
    simulation->setNewtonTolerance(kNewtonResidual * impulse);
    simulation->setNewtonMaxIteration(kMaxNewtonIterations);
    simulation->setWarnOnNonConvergence(false);
    simulation->setCheckSolverFunction([](int result, Simulation*) {
      if (result != 0) throw NoContactSolution{result};
    });
    const bool is_linear = model.system()->isLinear();
    for (; k < settings.steps; ++k) {
      if (time_limit.is_over()) {
        stop(Status::time_limit, k, time_limit.message());
        break;
      }
      simulation->computeOneStep();
      if (!is_linear && !simulation->isNewtonConverge()) {
        stop(Status::inner_solver_failed, k,
             fmt::format("Siconos' Newton iteration leaves a residual of {:.2g}", simulation->newtonResiduDSMax()));
        break;
      }
      model.read_impulses(Lambda_n, Lambda_t);  // nextStep() clears those of contacts that open
      if (info.n_c() > 0 && Lambda_n.minCoeff() < -kPull * impulse) {
        stop(Status::inner_solver_failed, k,
             fmt::format(
                 "Siconos' contact solver ends without an error code, and with an impulse of {:.3g} N s that pulls",
                 Lambda_n.minCoeff()));
        break;
      }
      Lambda_n = Lambda_n.cwiseMax(0);  // rounding
      simulation->nextStep();

      q_minus.swap(solution.q);
      v_minus.swap(solution.v);
      model.read_state(solution.q, solution.v);
      if (projects) {
        problem.gap(solution.q.data(), gap.data());
        const double left = (Lambda_n.array() > 0).select(gap, 0.0).minCoeff();
        if (left < -2 * gap_tolerance) {  // Siconos prints that its projection has not converged, and goes on
          stop(Status::inner_solver_failed, k,
               fmt::format("Siconos' projection leaves a penetration of {:.3g} m", -left));
          solution.q.swap(q_minus);
          solution.v.swap(v_minus);
          break;
        }
      }
      ++counters.steps;
      ++counters.elements;
      const auto combined = std::dynamic_pointer_cast<TimeSteppingCombinedProjection>(simulation);
      counters.inner_iterations +=
          combined ? combined->cumulatedNewtonNbIterations() : simulation->getNewtonNbIterations();
      model.count(counters);
      solution.t = k + 1 == settings.steps ? info.end_time : (k + 1) * h;
      // A contact that carries an impulse and did not before has closed; by (2) the impulse acts 1 - theta of a step after t_k.
      for (int i = 0; i < info.n_c(); ++i) {
        const bool is_pressed = Lambda_n[i] > 0;
        if (is_pressed && !was_pressed[i]) {
          solution.events.push_back({(k + 1 - theta) * h,
                                     EventKind::impact,
                                     i,
                                     q_minus + (1 - theta) * h * v_minus,
                                     v_minus,
                                     solution.v,
                                     Lambda_n,
                                     Lambda_t,
                                     {},
                                     {}});
          ++counters.events;
        }
        was_pressed[i] = is_pressed;
      }
      if (settings.recording >= Recording::grid)
        solution.samples.push_back({solution.t, solution.q, solution.v, solution.v});
      if (ends_here(settings, solution.t, solution.q, solution.v)) break;
    }
  } catch (const Siconos::exception& error) {
    stop(Status::inner_solver_failed, k, message_of(error));
  } catch (const NoContactSolution& failure) {
    stop(Status::inner_solver_failed, k, fmt::format("Siconos' contact solver ends with code {}", failure.info));
  }
  return solution;
}

}  // namespace ricochet::siconos
