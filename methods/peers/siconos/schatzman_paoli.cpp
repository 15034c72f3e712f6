// Siconos' Schatzman-Paoli time stepping, its class SchatzmanPaoliOSI, for M v' + C v + K q = F and affine gaps:
//
//   q_1 = q_0 + h v_0                                                                                             (1)
//   A (q_{k+1} - q_k) = M (q_k - q_{k-1}) + h^2 F_k + sum_i H_i' P_i,   A = M + h theta C / 2 + h^2 theta^2 K     (2)
//   F_k = F - K q_k - C (theta (q_k - q_{k-1}) / (2 h) + (1 - theta) v_{k-1})                                    (2b)
//   0 <= P_i  _|_  y_i(q_{k+1}) + eps_r^i y_i(q_{k-1}) >= 0   for all contacts                                    (3)
//   v_k = (q_{k+1} - q_{k-1}) / (2 h)                                                                             (4)
//
// Siconos keeps q_{k+1} and v_k as its state at t_k. Here the state at t_k is q_k and v_k, which (4) is centred at. (1)
// is half a step of acceleration short, and (2) damps unless theta = 0: order 1. Contacts have no friction: Siconos
// would apply Coulomb's law to the tangential position.
//
// Source: Paoli, Schatzman, SIAM J. Numer. Anal. 40 (2002) 702-733; Acary, Brogliato (2008), section 10.2. The form (2)
// is Siconos'.

#include <fmt/format.h>

#include <Interaction.hpp>
#include <LCP.hpp>
#include <SchatzmanPaoliOSI.hpp>
#include <TimeDiscretisation.hpp>
#include <TimeStepping.hpp>

#include "methods/peers/siconos/integrate.h"
#include "methods/peers/siconos/model.h"
#include "methods/regions/until_run.h"
#include "methods/time_limit.h"

namespace ricochet::siconos {

Solution integrate_schatzman_paoli(const Problem& problem, const Settings& settings, double theta) {
  const ProblemInfo& info = problem.info();
  Solution solution;
  Counters& counters = solution.counters;
  solution.q = info.q0;
  solution.v = info.v0;
  const double h = info.end_time / settings.steps;
  const TimeLimit time_limit(settings.time_limit);
  const auto stop = [&](Status status, int k, const std::string& reason) {
    solution.status = status;
    solution.message = fmt::format("step {} of {}, from t = {:.6g} s: {}", k + 1, settings.steps, k * h, reason);
  };

  int k = 0;
  try {
    const Model model(problem, info.end_time + 2 * h, Bodies::as_coupled);
    auto simulation = std::make_shared<TimeStepping>(model.system(), std::make_shared<TimeDiscretisation>(0.0, h), 0);
    simulation->insertIntegrator(std::make_shared<SchatzmanPaoliOSI>(theta));
    simulation->insertNonSmoothProblem(std::make_shared<LCP>(SICONOS_LCP_LEMKE));
    simulation->initialize();  // (1)
    Vector q_next(info.n_q), v(info.n_q);
    model.read_state(q_next, v);
    for (; k < settings.steps; ++k) {
      if (time_limit.is_over()) {
        stop(Status::time_limit, k, time_limit.message());
        break;
      }
      simulation->computeOneStep();
      solution.q = q_next;
      model.read_state(q_next, solution.v);
      simulation->nextStep();
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
