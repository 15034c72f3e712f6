#include "bench/fuzz/families.h"

#include <fmt/format.h>

namespace ricochet {

const std::vector<SceneFamily>& scene_families() {
  static const std::vector<SceneFamily> families = {
      {"drops", "a block that falls obliquely on a slope, beside a wall", draw_drop},
      {"blocks", "blocks on the ground in a row, with springs and walls", draw_blocks},
      {"stacks", "boxes upon each other, pushed and pulled sideways", draw_stack},
      {"discs", "spinning discs on the ground and between walls", draw_discs},
      {"space", "masses in space on the ground, with springs and a wall", draw_masses_in_space},
      {"rod_drops", "a dropped rod, both ends rough", draw_dropped_rod},
      {"rods", "masses joined by rods, on the ground or on a hinge", draw_rod_chain},
      {"pendula", "single and double pendula between walls, above a floor", draw_pendulum},
      {"columns", "balls on a vertical line between floor and ceiling", draw_column},
      {"moving", "masses on shaken tables and belts, with driven anchors and pivots", draw_moving_surfaces},
      {"fast", "fast discs, round posts and a washboard", draw_fast_bodies},
      {"loads", "resting blocks under loads that change with time", draw_changing_loads},
      {"turning", "a block in space under a load whose direction turns", draw_turning_loads},
      {"unloaded", "contacts that touch without a load, and rows that touch", draw_unloaded_contacts},
      {"ratios", "masses from 1e-4 to 1e4 kg on a vertical line", draw_mass_ratios},
      {"units", "scenes in other units of length, mass and time", draw_other_units},
      {"corners", "masses under forces that bend, jump in time or jump in position", draw_corners},
      {"dry_friction", "masses and pendula with friction elements, or forces with sign(v)", draw_dry_friction},
  };
  return families;
}

nlohmann::ordered_json random_scene(const SceneFamily& family, int seed, int number) {
  SceneDraw draw(fmt::format("{}/{}/{}", family.name, seed, number));
  family.draw(draw);
  return draw.scene(fmt::format("fuzz_{}_{}_{}", family.name, seed, number), family.title);
}

}  // namespace ricochet
