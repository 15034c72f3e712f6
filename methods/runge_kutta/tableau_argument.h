#pragma once

#include "methods/registry.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// The tableau that a method text names: "fesd:radau-iia:3" or "fesd:@my_tableau.json".
ButcherTableau tableau_argument(const MethodSpec& spec);

}  // namespace ricochet
