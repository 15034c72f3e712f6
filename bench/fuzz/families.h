#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/fuzz/scene_draw.h"

namespace ricochet {

/// A kind of random scene.
struct SceneFamily {
  const char* name;
  const char* title;
  void (*draw)(SceneDraw& draw);
};

/// All families. Another one is a function in families/ and a line in families.cpp.
const std::vector<SceneFamily>& scene_families();

/// Scene `number` of a family: always the same for the same arguments.
nlohmann::ordered_json random_scene(const SceneFamily& family, int seed, int number);

// families/*.cpp
void draw_drop(SceneDraw& draw);
void draw_blocks(SceneDraw& draw);
void draw_stack(SceneDraw& draw);
void draw_discs(SceneDraw& draw);
void draw_masses_in_space(SceneDraw& draw);
void draw_dropped_rod(SceneDraw& draw);
void draw_rod_chain(SceneDraw& draw);
void draw_pendulum(SceneDraw& draw);
void draw_column(SceneDraw& draw);
void draw_moving_surfaces(SceneDraw& draw);
void draw_fast_bodies(SceneDraw& draw);
void draw_changing_loads(SceneDraw& draw);
void draw_turning_loads(SceneDraw& draw);
void draw_unloaded_contacts(SceneDraw& draw);
void draw_mass_ratios(SceneDraw& draw);
void draw_other_units(SceneDraw& draw);
void draw_corners(SceneDraw& draw);
void draw_dry_friction(SceneDraw& draw);

/// A pendulum of one or two point masses, without contacts. @returns how many (families/turning.cpp)
int draw_point_masses_on_rods(SceneDraw& draw);

}  // namespace ricochet
