#include "methods/contact_laws/friction_cone.h"

#include "problems/input_error.h"

namespace ricochet {

const Names<FrictionCone>& friction_cone_names() {
  static const Names<FrictionCone> names = {
      {"exact", FrictionCone::exact}, {"squared", FrictionCone::squared}, {"polyhedral", FrictionCone::polyhedral}};
  return names;
}

int facets_argument(const MethodSpec& spec) {
  const int facets = spec.whole_number("facets", 8, 4, 1024);
  if (facets % 2) throw InputError(spec.name() + ": facets", facets, "an even number is required");
  return facets;
}

FrictionConeOptions cone_argument(const MethodSpec& spec) {
  const FrictionCone cone = spec.choice("cone", friction_cone_names());
  return {.cone = cone, .facets = cone == FrictionCone::polyhedral ? facets_argument(spec) : 0};
}

}  // namespace ricochet
