#pragma once

#include <nlohmann/json.hpp>

namespace ricochet {

/// CPU time of a run over repeated measurements [s].
struct Timing {
  double median = 0, minimum = 0, lower_quartile = 0, upper_quartile = 0;
  int repetitions = 0;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Timing, median, minimum, lower_quartile, upper_quartile, repetitions)

}  // namespace ricochet
