#include "methods/elements/element_system.h"

#include <cmath>

namespace ricochet {
namespace {

// What equations of redundant contacts may be left with at the end of Newton's method, relative to the accelerations.
constexpr double kContradiction = 1e-9;

}  // namespace

ElementSystem::ElementSystem(const Problem& the_problem, const ButcherTableau& the_tableau, Counters& the_counters,
                             const FrictionPolygon& polygon)
    : problem(the_problem),
      tableau(the_tableau),
      counters(the_counters),
      active(problem.info(), polygon, tableau.n_s),
      equations(problem, tableau, active, counters),
      unknowns(problem, active, tableau.n_s),
      end(problem, tableau, active, counters),
      newton(problem, tableau.n_s, counters) {
  equations.prepare(work);
  end.prepare(end_work);
  newton.set_active(active.closed(), active.n_rows());
}

void ElementSystem::set_active(Element& e) {
  if (active.set(e.modes, e.facets)) {
    equations.resize(work);
    end.resize(end_work);
    newton.set_active(active.closed(), active.n_rows());
  }
  unknowns.set_dependent_forces(e);
}

void ElementSystem::set_right_end(const StageCoefficients& k, Element& e) {
  equations.set_right_end(k, e);
  if (end.applies()) end.project(e, end_work);
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
