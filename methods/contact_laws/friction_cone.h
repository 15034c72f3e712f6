#pragma once

#include "methods/method_spec.h"

namespace ricochet {

/// The forms of Coulomb's friction cone (fesd/DIFFERENCES.md, correction 5):
///
///   exact       mu lambda_n v_t + ||v_t|| lambda_t = 0,   ||lambda_t|| <= mu lambda_n
///   squared     -v_t = 2 gamma lambda_t,   0 <= gamma  _|_  (mu lambda_n)^2 - ||lambda_t||^2 >= 0,   as published
///   polyhedral  in space a polygon in place of the disc; in the plane the polygon is the exact cone
enum class FrictionCone { exact, squared, polyhedral };

const Names<FrictionCone>& friction_cone_names();

struct FrictionConeOptions {
  FrictionCone cone = FrictionCone::exact;
  int facets = 0;  ///< of FrictionCone::polyhedral, in space; else 0
};

/// Option facets=8 of a method, an even number from 4 on.
int facets_argument(const MethodSpec& spec);

/// Options cone=exact|squared|polyhedral and, with the last, facets=8.
FrictionConeOptions cone_argument(const MethodSpec& spec);

}  // namespace ricochet
