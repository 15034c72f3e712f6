#include "bench/measure/built_method.h"

#include "methods/registry.h"

namespace ricochet {

std::string why_not_built(const std::string& spec) {
  for (const MethodEntry& entry : methods()) {
    if (entry.name == MethodSpec(spec).name() && !entry.make) return entry.not_built;
  }
  return "";
}

}  // namespace ricochet
