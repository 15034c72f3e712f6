// Siconos' half-explicit time-discontinuous Galerkin scheme, its classes TimeSteppingD1Minus and D1MinusLinearOSI:
//
//   M_k (v~ - v_k) = h (F_k + sum_i H_i' lambda_i),  0 <= lambda_i  _|_  y_i'' >= 0 for closed contacts at rest        (1)
//   q_{k+1} = q_k + h/2 (v_k + v~)                                                                                    (2)
//   M_{k+1} (v_{k+1} - v_k) = h/2 (R_k + R_{k+1}) + sum_i H_i' P_i,   R = F + H' lambda, lambda of (1) at both ends   (3)
//   0 <= P_i  _|_  U_i+ + eps_r^i U_i- >= 0   for closed contacts                                                     (4)
//
// Contacts have no friction. Forces and impulses are separate problems (1) and (4), where methods/time_stepping/d1_minus
// has one.
//
// Source: Schindler, Acary, Math. Comput. Simul. 95 (2014) 180-199.

#include <fmt/format.h>

#include <D1MinusLinearOSI.hpp>
#include <EventsManager.hpp>
#include <Interaction.hpp>
#include <LCP.hpp>
#include <TimeDiscretisation.hpp>
#include <TimeSteppingD1Minus.hpp>

#include "methods/peers/siconos/integrate.h"
#include "methods/peers/siconos/model.h"
#include "methods/regions/until_run.h"
#include "methods/time_limit.h"

namespace ricochet::siconos {

Solution integrate_d1_minus(const Problem& problem, const Settings& settings) {
  const ProblemInfo& info = problem.info();
  Solution solution;
  Counters& counters = solution.counters;
  solution.q = info.q0;
  solution.v = info.v0;
  const double h = info.end_time / settings.steps;
  const TimeLimit time_limit(settings.time_limit);
  Vector Lambda_n = Vector::Zero(info.n_c()), Lambda_t(0);
  const auto stop = [&](Status status, int k, const std::string& reason) {
    solution.status = status;
    solution.message = fmt::format("step {} of {}, from t = {:.6g} s: {}", k + 1, settings.steps, k * h, reason);
  };

  int k = 0;
  try {
    const Model model(problem, info.end_time + 2 * h, Bodies::one);
    auto simulation =
        std::make_shared<TimeSteppingD1Minus>(model.system(), std::make_shared<TimeDiscretisation>(0.0, h), 2);
    simulation->insertIntegrator(std::make_shared<D1MinusLinearOSI>());
    simulation->insertNonSmoothProblem(std::make_shared<LCP>(SICONOS_LCP_LEMKE), SICONOS_OSNSP_TS_VELOCITY);      // (4)
    simulation->insertNonSmoothProblem(std::make_shared<LCP>(SICONOS_LCP_LEMKE), SICONOS_OSNSP_TS_VELOCITY + 1);  // (1)
    for (; k < settings.steps; ++k) {
      if (time_limit.is_over()) {
        stop(Status::time_limit, k, time_limit.message());
        break;
      }
      const Vector q_minus = solution.q, v_minus = solution.v;
      simulation->advanceToEvent();
      model.read_state(solution.q, solution.v);
      simulation->processEvents();
      ++counters.steps;
      ++counters.elements;
      ++counters.inner_iterations;  // count() takes them for evaluations of a force that is a matrix
      model.count(counters);
      solution.t = k + 1 == settings.steps ? info.end_time : (k + 1) * h;
      if (!solution.q.allFinite() || !solution.v.allFinite()) {
        stop(Status::inner_solver_failed, k, "the state is not finite");
        break;
      }
      if (settings.recording >= Recording::grid)
        solution.samples.push_back({solution.t, solution.q, solution.v, solution.v});
      if (ends_here(settings, solution.t, solution.q, solution.v)) break;
    }
  } catch (const Siconos::exception& error) {
    stop(Status::inner_solver_failed, k, message_of(error));
  }
  return solution;
}

}  // namespace ricochet::siconos
