#pragma once

#include "methods/method_spec.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// The tableau that a method text names: "fesd:radau-iia:3" or "fesd:@my_tableau.json".
ButcherTableau tableau_argument(const MethodSpec& spec);

/// The tableau of a text alone: "radau-iia:3" or "@my_tableau.json".
ButcherTableau tableau_argument(const std::string& text);

}  // namespace ricochet
