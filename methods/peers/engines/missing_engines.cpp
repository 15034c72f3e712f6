#include "methods/registry.h"

namespace ricochet {
namespace {

// Engines are optional, and plugins: those that were not found are listed, with the reason why they cannot run.
[[maybe_unused]] bool is_missing(const char* name, const char* package) {
  return register_method<NotBuilt>({.name = name,
                                    .usage = std::string(name) + "[:defaults|tuned|@FILE.json]",
                                    .max_arguments = 1,
                                    .summary = "a physics engine with default settings, our tuned ones, or yours",
                                    .examples = {name, std::string(name) + ":tuned"},
                                    .not_built = std::string(package) + " not found",
                                    .scheme = std::string(name) + ".cpp"});
}

#ifndef RICOCHET_HAS_bullet
const bool bullet_is_missing = is_missing("bullet", "libbullet-dev");
#endif
#ifndef RICOCHET_HAS_ode
const bool ode_is_missing = is_missing("ode", "libode-dev");
#endif
#ifndef RICOCHET_HAS_mujoco
const bool mujoco_is_missing = is_missing("mujoco", "libmujoco-dev");
#endif
#ifndef RICOCHET_HAS_box2d
const bool box2d_is_missing = is_missing("box2d", "libbox2d-dev");
#endif

}  // namespace
}  // namespace ricochet
