#include "bench/measure/setting_kind.h"

#include <fmt/format.h>

#include "problems/input_error.h"

namespace ricochet {

void require_kind_of_setting(const Method& method, const std::string& steps, const std::string& tolerance) {
  const MethodInfo info = method.info();
  if (info.is_adaptive && !steps.empty())
    throw InputError(fmt::format("{}: {} controls its error, it takes a tolerance and no steps", steps, info.id));
  if (!info.is_adaptive && !tolerance.empty())
    throw InputError(fmt::format("{}: {} takes fixed steps and no tolerance", tolerance, info.id));
}

}  // namespace ricochet
