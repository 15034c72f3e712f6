#pragma once

#include "methods/fesd_homotopy/step_homotopy.h"
#include "methods/method_spec.h"

namespace ricochet {

/// The options of "fesd_homotopy:TABLEAU:STAGES,OPTION=VALUE...". @throws InputError for values that are not allowed
StepHomotopy::Options step_homotopy_options(const MethodSpec& spec);

}  // namespace ricochet
