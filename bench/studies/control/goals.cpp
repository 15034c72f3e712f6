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

Comparison quotient(const std::string& problem, const std::string& quantity, double homotopy, double shooting) {
  return {problem, quantity, cell_text("{:.4g}", homotopy), cell_text("{:.4g}", shooting), shooting / homotopy};
}

Table comparison_table(const std::vector<Comparison>& comparisons, const nlohmann::json& header) {
  const auto goals = header.value("goals", std::vector<ControlGoal>());
  std::vector<GoalLine> lines;
  for (const auto& comparison : comparisons) {
    const auto goal = std::ranges::find_if(goals, [&](const ControlGoal& g) {
      return g.problem == comparison.problem && g.quantity == comparison.quantity;
    });
    lines.push_back({comparison, goal == goals.end() ? nullptr : &*goal});
  }
  using L = GoalLine;
  static const std::vector<Column<L>> columns = {
      {"problem", [](const L& l) { return l.comparison.problem; }},
      {"quantity", [](const L& l) { return l.comparison.quantity; }},
      {"homotopy", "", "{}", [](const L& l) { return l.comparison.homotopy; }},
      {"shooting", "", "{}", [](const L& l) { return l.comparison.shooting; }},
      {"reached", "", "{:.3g}", [](const L& l) { return l.comparison.reached; }},
      {"goal", "", "{}", &L::text},
      {"kept", &L::verdict},
  };
  return table_of("Shooting against the homotopy", columns, lines,
                  "Reached: shooting divided by homotopy where both have a number, else that of shooting. Both methods "
                  "ran in one process, on the same machine.");
}

}  // namespace ricochet
