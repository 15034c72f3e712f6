#pragma once

#include <memory>

#include "reference/integrator.h"

namespace ricochet::reference {

/// SUNDIALS' CVODE (Hindmarsh et al., ACM TOMS 31, 2005): Adams formulas of variable order up to 12 with a fixed point
/// iteration, or backward differences up to 5 with Newton's method and a dense matrix.
std::unique_ptr<Integrator> adams(SmoothSystem& system);
std::unique_ptr<Integrator> bdf(SmoothSystem& system);

}  // namespace ricochet::reference
