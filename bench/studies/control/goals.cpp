#include "bench/studies/control/goals.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

struct GoalLine {
  Comparison comparison;
  const ControlGoal* goal;

  bool has_goal() const { return goal != nullptr; }
  std::string text() const {
    if (!has_goal()) return "-";
    return std::isfinite(goal->at_most) ? fmt::format("<= {:.3g}", goal->at_most)
                                        : fmt::format(">= {:.3g}", goal->at_least);
  }
  std::string verdict() const {
    if (!has_goal()) return "-";
    return comparison.reached <= goal->at_most || comparison.reached >= goal->at_least ? "yes" : "no";
  }
};

}  // namespace

Comparison quotient(const std::string& problem, const std::string& quantity, double first, double second) {
  return {problem, quantity, cell_text("{:.4g}", first), cell_text("{:.4g}", second), second / first};
}

Table comparison_table(const std::vector<Comparison>& comparisons, const nlohmann::json& header, const Sides& sides) {
  const auto goals = header.value("goals", std::vector<ControlGoal>());
  std::vector<GoalLine> lines;
  for (const auto& comparison : comparisons) {
    const auto goal = std::ranges::find_if(goals, [&](const ControlGoal& g) {
      return g.problem == comparison.problem && g.quantity == comparison.quantity;
    });
    lines.push_back({comparison, goal == goals.end() ? nullptr : &*goal});
  }
  using L = GoalLine;
  const std::vector<Column<L>> columns = {
      {"problem", [](const L& l) { return l.comparison.problem; }},
      {"quantity", [](const L& l) { return l.comparison.quantity; }},
      {sides.first, "", "{}", [](const L& l) { return l.comparison.first; }},
      {sides.second, "", "{}", [](const L& l) { return l.comparison.second; }},
      {"reached", "", "{:.3g}", [](const L& l) { return l.comparison.reached; }},
      {"goal", "", "{}", &L::text},
      {"kept", &L::verdict},
  };
  return table_of(
      sides.title, columns, lines,
      fmt::format("Reached: {1} divided by {0} where both have a number, else that of {1}. Both methods ran in one "
                  "process, on the same machine.",
                  sides.first, sides.second));
}

}  // namespace ricochet
