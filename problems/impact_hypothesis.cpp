#include "problems/impact_hypothesis.h"

#include "problems/names.h"

namespace ricochet {

ImpactHypothesis impact_hypothesis(const std::string& name) {
  std::vector<std::string> known;
  for (const auto law : kImpactHypotheses) {
    if (name == name_of(law)) return law;
    known.emplace_back(name_of(law));
  }
  throw_unknown_name("impact law", name, known);
}

}  // namespace ricochet
