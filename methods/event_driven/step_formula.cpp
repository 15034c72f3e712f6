#include "methods/event_driven/step_formula.h"

#include <algorithm>

#include "methods/event_driven/radau_step.h"
#include "methods/modes/explicit_steps.h"

namespace ricochet {

int degree_between_ends(const StepFormula& formula) {
  const auto* implicit = std::get_if<ButcherTableau>(&formula);
  return implicit ? std::max(implicit->n_s + 1, 5) : 5;
}

std::unique_ptr<StepScheme> make_step(const StepFormula& formula, int n_q, ModeDynamics& dynamics) {
  if (const auto* pair = std::get_if<EmbeddedTableau>(&formula)) return make_explicit_step(*pair, n_q, dynamics);
  return std::make_unique<RadauStep>(std::get<ButcherTableau>(formula), n_q, dynamics);
}

}  // namespace ricochet
