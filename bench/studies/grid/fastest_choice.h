#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/studies/grid/fastest_rows.h"

namespace ricochet {

/// Which family to take for a group of scenes and an error, from the fastest runs by one rule: the family that reaches
/// the error on most scenes of the group; among those the one with the smallest
///
///     exp mean_s log( t_fs / min_f' t_f's ),   s: the scenes that f reaches                       (1)
///
/// With t in microseconds; the second is the next by the same rule. Scenes whose reference is not good enough for the error do not
/// count; a group without any has no choice.
struct Choice {
  struct Family {
    std::string name;
    int reached = 0;    ///< scenes of the group
    double slower = 1;  ///< (1)
  };

  std::string group;
  double level = 0;
  int scenes = 0;                ///< that are judged
  std::vector<Family> families;  ///< the choice, then the next; without those that reach no scene
  std::vector<std::string> never;
  FastestRun run;     ///< of the choice: the one whose time is in the middle
  double factor = 0;  ///< geometric mean of the time of the next over the choice's, where both reach it; NaN: none does
};

/// Groups and levels in the order of the runs. @param runs  of one solver
std::vector<Choice> choices(const std::vector<FastestRun>& runs);

/// The same for the site: {"groups", "levels", "choices": [{"group" and "level", places in these lists, "scenes",
/// "families": [{"name", "reached", "slower"}], "never", "run": {"method", "microseconds", "scene", "command"} or null,
/// "factor"}]}.
nlohmann::json choice_data(const std::vector<FastestRun>& runs);

/// A line per choice, with the reason in words.
Table which_to_take(const std::vector<FastestRun>& runs);

}  // namespace ricochet
