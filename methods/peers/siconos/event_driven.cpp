// Siconos' event-driven scheme, its classes EventDriven and LsodarOSI:
//
//   M v' = F + sum_i H_i' lambda_i,  0 <= lambda_i  _|_  y_i'' >= 0 for i in I_2, else lambda_i = 0               (1)
//   an event where y_i of a contact that is not in I_2, or lambda_i of one that is, falls through zero              (2)
//   there, for i in I_1:  0 <= P_i  _|_  U_i+ + eps_r^i U_i- >= 0,  M (v+ - v-) = sum_i H_i' P_i                    (3)
//   I_1 = {i: |y_i| <= tol},  I_2 = {i in I_1: |y_i'| <= tol}                                                      (4)
//
// ODEPACK's LSODAR integrates (1), in which each evaluation solves an LCP, and locates (2). Without friction.
//
// Source: Acary, Bonnefon, Bremond, Huber, Perignon, Sinclair: An introduction to Siconos, INRIA RT-0340; Hindmarsh,
// ODEPACK (1983).

#include <fmt/format.h>

#include <EventDriven.hpp>
#include <EventsManager.hpp>
#include <Interaction.hpp>
#include <LCP.hpp>
#include <LsodarOSI.hpp>
#include <TimeDiscretisation.hpp>
#include <algorithm>

#include "methods/peers/siconos/integrate.h"
#include "methods/peers/siconos/model.h"
#include "methods/time_limit.h"

namespace ricochet::siconos {
namespace {

constexpr int kMaxLsodarSteps = 1000000;  // between two events
constexpr int kMaxEvents = 100000;

}  // namespace

Solution integrate_event_driven(const Problem& problem, const Settings& settings) {
  const ProblemInfo& info = problem.info();
  Solution solution;
  Counters& counters = solution.counters;
  solution.q = info.q0;
  solution.v = info.v0;
  Vector Lambda_n = Vector::Zero(info.n_c()), Lambda_t = Vector::Zero(info.n_lambda_t);
  Vector q = info.q0, v = info.v0;
  const TimeLimit time_limit(settings.time_limit);
  const auto stop = [&](Status status, const std::string& reason) {
    solution.status = status;
    solution.message = fmt::format("from t = {:.6g} s: {}", solution.t, reason);
  };

  const Model model(problem, 2 * info.end_time, Bodies::one);
  const auto lsodar = std::make_shared<LsodarOSI>();
  try {
    auto simulation =
        std::make_shared<EventDriven>(model.system(), std::make_shared<TimeDiscretisation>(1u, 0.0, info.end_time));
    simulation->insertIntegrator(lsodar);
    simulation->insertNonSmoothProblem(std::make_shared<LCP>(), SICONOS_OSNSP_ED_IMPACT);
    simulation->insertNonSmoothProblem(std::make_shared<LCP>(), SICONOS_OSNSP_ED_SMOOTH_ACC);
    simulation->setToleranceED(std::max(10 * settings.tolerance, 1e-13));
    simulation->initialize();
    lsodar->setTol(1, settings.tolerance, settings.tolerance);
    lsodar->setMaxNstep(kMaxLsodarSteps);
    LagrangianDS& system = *model.bodies().front().system;
    while (solution.t < info.end_time) {  // hasNextEvent() goes on after the end
      if (time_limit.is_over()) {
        stop(Status::time_limit, time_limit.message());
        break;
      }
      if (counters.events >= kMaxEvents) {
        stop(Status::step_limit, fmt::format("{} events", kMaxEvents));
        break;
      }
      simulation->advanceToEvent();
      system.update_inverse_mass();
      model.read_state(q, v);
      const Vector v_minus = v;
      simulation->processEvents();
      model.read_state(solution.q, solution.v);
      solution.t = std::min(simulation->startingTime(), info.end_time);
      model.read_impulses(Lambda_n, Lambda_t);
      for (int i = 0; i < info.n_c(); ++i) {
        if (!(Lambda_n[i] > 0)) continue;
        solution.events.push_back(
            {solution.t, EventKind::impact, i, solution.q, v_minus, solution.v, Lambda_n, Lambda_t, {}, {}});
        ++counters.events;
      }
    }
  } catch (const Siconos::exception& error) {
    stop(Status::inner_solver_failed, message_of(error));
  }
  counters.steps = counters.elements = LsodarOSI::count_steps();  // static, set to zero by initialize()
  counters.force_evaluations = LsodarOSI::count_rhs_call();
  return solution;
}

}  // namespace ricochet::siconos
