#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "reference/agreement.h"
#include "reference/truths.h"

namespace ricochet {

inline std::string test_data(const std::string& name) {
  return RICOCHET_TEST_DATA "/" + name;
}

inline std::string reference_data(const std::string& name) {
  return RICOCHET_TEST_DATA "/../../reference/data/" + name;
}

inline const std::vector<reference::GroundTruth>& ground_truth() {
  return reference::certified_cases();
}

inline std::unique_ptr<Problem> ground_truth_problem(const std::string& id) {
  return make_problem(id);
}

/// Scenes that move by themselves, and their truth with the clock that a solution has after the bodies' coordinates:
/// T, 1, and no derivative.
inline const std::vector<reference::GroundTruth>& moving_scenes() {
  static const auto cases = [] {
    auto list = reference::read_ground_truth(reference_data("moving_scenes.json"));
    const auto append = [](Vector& x, double value) {
      x.conservativeResize(x.size() + 1);
      x[x.size() - 1] = value;
    };
    for (auto& truth : list) {
      append(truth.q, read_scene_file(reference_data("moving_scenes.json") + "#" + truth.id)->info().end_time);
      append(truth.v, 1);
      for (auto& sensitivity : truth.sensitivities) {
        append(sensitivity.dq, 0);
        append(sensitivity.dv, 0);
      }
    }
    return list;
  }();
  return cases;
}

inline std::unique_ptr<Problem> moving_scene(const std::string& id, const ParameterChanges& changes = {}) {
  return read_scene_file(reference_data("moving_scenes.json") + "#" + id, changes);
}

inline std::vector<EventKind> kinds(const Solution& s) {
  std::vector<EventKind> result;
  for (const auto& event : s.events) result.push_back(event.kind);
  return result;
}

inline double state_error(const Solution& s, const reference::GroundTruth& truth) {
  return reference::final_state_difference(s.q, s.v, truth.q, truth.v);
}

/// A tolerance that was measured, but no less than what processors may differ by in the last bits: twenty roundings.
inline double with_rounding(double tolerance) {
  return std::max(tolerance, 20 * std::numeric_limits<double>::epsilon());
}

/// GoogleTest allows letters, digits and underscores in the name of a test.
inline std::string test_name(std::string text) {
  for (char& c : text) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return text;
}

/// Of a test with one mode of the contacts of a scene: the signs of slip in the plane are no letters.
inline std::string test_name(const std::string& scene, ContactMode mode, const std::string& tableau) {
  const int sign = slip_sign(mode);
  return test_name(scene + "_" + (sign > 0 ? "slip_plus" : sign < 0 ? "slip_minus" : to_string(mode)) + "_" + tableau);
}

/// Every scene the tests run: those of the program, the cases of the ground truth among them, and scene files of the
/// tests.
struct NamedProblem {
  std::string id;
  std::shared_ptr<const Problem> problem;
};

inline const std::vector<NamedProblem>& all_problems() {
  static const auto list = [] {
    std::vector<NamedProblem> problems;
    for (const auto& scene : scenes()) problems.push_back({scene.id, make_problem(scene.id)});
    for (const char* file :
         {"simultaneous_balls", "touching_row", "joined_blocks", "crank_with_friction", "moving_table"}) {
      problems.push_back({file, read_scene_file(test_data(std::string(file) + ".json"))});
    }
    return problems;
  }();
  return list;
}

/// Scenes with a geometry in which other forces than the weight act: springs, drags, loads, and the weight of small
/// angles.
inline const std::set<std::string>& scenes_with_other_forces() {
  static const std::set<std::string> names = {"two_balls_spring", "belt_oscillator", "woodpecker_toy",
                                              "double_pendulum_wall"};
  return names;
}

/// One mode for contacts of a scene, and the tableau of the elements that have it.
struct SceneMode {
  std::string problem_id, tableau;
  ContactMode mode = ContactMode::open;
  std::shared_ptr<const Problem> problem;
};

inline void PrintTo(const SceneMode& c, std::ostream* out) {
  *out << c.problem_id << ", " << to_string(c.mode) << ", " << c.tableau;
}

}  // namespace ricochet
