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
// Source: Acary, Bonnefon, Bremond, Huber, Perignon, Sinclair: An introduction to Siconos, INRIA RT-0340; the scheme is
// Jean's, CMAME 177 (1999).

#include <SolverOptions.h>
#include <fmt/format.h>

#include <FrictionContact.hpp>
#include <Interaction.hpp>
#include <LCP.hpp>
#include <MoreauJeanOSI.hpp>
#include <TimeDiscretisation.hpp>
#include <TimeStepping.hpp>
#include <algorithm>

#include "methods/peers/siconos/integrate.h"
#include "methods/peers/siconos/model.h"
#include "methods/time_limit.h"

namespace ricochet::siconos {
namespace {

// The impulse that may pull, as a part of that of the whole run: Lemke's method on redundant contacts ends with such.
constexpr double kPull = 1e-9;
// Relative to the impulse of the whole run: Siconos' own tolerance is absolute, in N s.
constexpr double kNewtonResidual = 1e-11;
constexpr int kMaxNewtonIterations = 50;
constexpr double kContactResidual = 1e-9;  // relative, of an iterated contact problem: far below a time step's error
constexpr int kMaxContactIterations = 10000;

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

}  // namespace

Solution integrate_moreau_jean(const Problem& problem, const Settings& settings, double theta) {
  const ProblemInfo& info = problem.info();
  Solution solution;
  Counters& counters = solution.counters;
  solution.q = info.q0;
  solution.v = info.v0;
  const double h = info.end_time / settings.steps;
  const TimeLimit time_limit(settings.time_limit);
  Vector Lambda_n = Vector::Zero(info.n_c()), Lambda_t = Vector::Zero(info.n_lambda_t);
  Vector q_minus = info.q0, v_minus = info.v0;
  std::vector<char> was_pressed(info.n_c(), false);
  const auto stop = [&](Status status, int k, const std::string& reason) {
    solution.status = status;
    solution.message = fmt::format("step {} of {}, from t = {:.6g} s: {}", k + 1, settings.steps, k * h, reason);
  };

  int k = 0;
  try {
    const Model model(problem, info.end_time + 2 * h, Bodies::as_coupled);  // Siconos asks for events beyond the last
    auto integrator = std::make_shared<MoreauJeanOSI>(theta);
    auto simulation = std::make_shared<TimeStepping>(model.system(), std::make_shared<TimeDiscretisation>(0.0, h), 0);
    simulation->insertIntegrator(integrator);
    if (info.n_c() > 0) simulation->insertNonSmoothProblem(contact_problem(info.contacts.front().n_t));
    const double impulse = std::max((problem.mass_matrix(info.q0) * info.v0).norm(),
                                    info.end_time * problem.force(info.q0, info.v0).norm());
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
      ++counters.steps;
      ++counters.elements;
      counters.inner_iterations += simulation->getNewtonNbIterations();
      model.count(counters);
      solution.t = k + 1 == settings.steps ? info.end_time : (k + 1) * h;
      for (int i = 0; i < info.n_c(); ++i) {  // a contact that carries an impulse and did not before has closed
        const bool is_pressed = Lambda_n[i] > 0;
        if (is_pressed && !was_pressed[i]) {
          solution.events.push_back(
              {solution.t, EventKind::impact, i, q_minus, v_minus, solution.v, Lambda_n, Lambda_t, {}, {}});
          ++counters.events;
        }
        was_pressed[i] = is_pressed;
      }
      if (settings.recording >= Recording::grid)
        solution.samples.push_back({solution.t, solution.q, solution.v, solution.v});
    }
  } catch (const Siconos::exception& error) {
    stop(Status::inner_solver_failed, k, message_of(error));
  } catch (const NoContactSolution& failure) {
    stop(Status::inner_solver_failed, k, fmt::format("Siconos' contact solver ends with code {}", failure.info));
  }
  return solution;
}

}  // namespace ricochet::siconos
