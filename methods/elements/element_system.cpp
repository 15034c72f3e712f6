#include "methods/elements/element_system.h"

#include <cmath>

namespace ricochet {
namespace {

// Largest residual of the equations of redundant contacts after Newton's method, relative to the accelerations.
constexpr double kContradiction = 1e-9;

}  // namespace

ElementSystem::ElementSystem(const Problem& the_problem, const ButcherTableau& the_tableau, Counters& the_counters,
                             const FrictionPolygon& polygon, Form form)
    : problem(the_problem),
      tableau(the_tableau),
      counters(the_counters),
      active(problem.info(), polygon, tableau.n_s),
      equations(problem, tableau, active, counters),
      unknowns(problem, active, tableau.n_s),
      end(problem, tableau, active, counters),
      affine_stages(problem, tableau, active),
      newton(problem, tableau.n_s, counters),
      maps_(problem, counters),
      form_(form) {
  equations.prepare(work);
  end.prepare(end_work);
  take_active_set();
}

/// Sizes of the workspace, and the closed form or the Newton system.
void ElementSystem::take_active_set() {
  end.resize(end_work);
  const bool has_closed_form = form_ != Form::newton && affine_stages.has_closed_form(!active.empty());
  map_ = has_closed_form ? maps_.of(active) : nullptr;
  if (map_) return;
  equations.resize(work);
  newton.set_active(active.closed(), active.n_rows());
}

void ElementSystem::restart() {
  work.gap_size.setZero();
  newton.forget_factors();
}

void ElementSystem::set_active(Element& e) {
  if (active.set(e.modes, e.facets) || (map_ && map_->u != problem.info().u)) take_active_set();
  unknowns.set_dependent_forces(e);
}

bool ElementSystem::solve_affine(const StageCoefficients& k, Element& e) {
  equations.set_initial_values(e, k.h, work);
  ++counters.linear_solves;
  ++counters.inner_iterations;
  return affine_stages.solve(*map_, equations, k, e, work);
}

void ElementSystem::set_right_end(const StageCoefficients& k, Element& e) {
  equations.set_right_end(k, e);
  e.is_projected = end.applies_to(e);
  if (e.is_projected) end.project(e, end_work);
}

void ElementSystem::set_end_forces(Element& e) {
  const bool by_map = map_ && !active.empty() && !tableau.ends_with_stage;
  e.has_end_forces = by_map || end.gives_forces();
  if (by_map)
    affine_stages.set_end_forces(*map_, e);
  else if (e.has_end_forces)
    end.set_end_forces(e, end_work);
  else
    end.set_stage_end_forces(e);
}

bool ElementSystem::is_consistent(const Element& e, double h) const {
  const double acceleration = unknowns.velocity_scale(e, h, work.load) / h;
  const int n_x = active.n_unknowns();
  for (int j = 0; j < tableau.n_s; ++j) {
    for (int row = j * n_x + problem.n_q(); row < (j + 1) * n_x; ++row) {
      if (!(std::abs(work.r[row]) <= kContradiction * acceleration)) return false;
    }
  }
  return true;
}

}  // namespace ricochet
