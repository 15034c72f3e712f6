#include "methods/complementarity/friction_cone.h"

#include "problems/input_error.h"

namespace ricochet {

int facets_argument(const MethodSpec& spec) {
  const int facets = spec.whole_number("facets", 8, 4, 1024);
  if (facets % 2) throw InputError(spec.name() + ": facets", facets, "an even number is required");
  return facets;
}

FrictionConeOptions cone_argument(const MethodSpec& spec) {
  const std::string cone = spec.choice("cone", {"exact", "squared", "polyhedral"});
  if (cone == "squared") return {.cone = FrictionCone::squared};
  if (cone == "polyhedral") return {.cone = FrictionCone::polyhedral, .facets = facets_argument(spec)};
  return {};
}

}  // namespace ricochet
