#include "bench/studies/grid/fastest_choice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace ricochet {
namespace {

using ByScene = std::map<std::string, const FastestRun*>;  // a family's runs that reach the level

double mean_ratio(const ByScene& times, const ByScene& over) {
  double sum = 0;
  int count = 0;
  for (const auto& [scene, run] : times) {
    const auto other = over.find(scene);
    if (other == over.end()) continue;
    sum += std::log(run->microseconds() / other->second->microseconds());
    ++count;
  }
  return count == 0 ? std::nan("") : std::exp(sum / count);
}

/// Median by time of an odd number of runs; of an even number, the faster of the two in the middle.
const FastestRun& middle_of(const ByScene& runs) {
  std::vector<const FastestRun*> list;
  for (const auto& [scene, run] : runs) list.push_back(run);
  std::ranges::sort(list, {}, &FastestRun::microseconds);
  return *list[(list.size() - 1) / 2];
}

Choice choice_of(const std::string& group, double level, const std::vector<FastestRun>& runs) {
  Choice choice{.group = group, .level = level, .scenes = 0, .families = {}, .never = {}, .run = {}};
  std::map<std::string, ByScene> reached;
  ByScene best, judged;
  for (const FastestRun& run : runs) {
    if (run.group != group || run.level() != level || !run.is_judged()) continue;
    judged[run.scene] = &run;
    if (!run.is_reached()) continue;
    reached[run.family()][run.scene] = &run;
    const FastestRun*& fastest = best[run.scene];
    if (!fastest || run.microseconds() < fastest->microseconds()) fastest = &run;
  }
  choice.scenes = static_cast<int>(judged.size());
  for (const auto& name : different(runs, &FastestRun::family)) {
    const ByScene& own = reached[name];
    if (own.empty())
      choice.never.push_back(name);
    else
      choice.families.push_back({name, static_cast<int>(own.size()), mean_ratio(own, best)});  // (1)
  }
  std::ranges::stable_sort(choice.families, {},
                           [](const Choice::Family& f) { return std::pair(-f.reached, f.slower); });
  if (choice.families.empty()) return choice;
  const ByScene& first = reached[choice.families[0].name];
  choice.run = middle_of(first);
  choice.factor = choice.families.size() > 1 ? mean_ratio(reached[choice.families[1].name], first) : std::nan("");
  return choice;
}

/// "1.9", "140"
std::string times(double factor) {
  return fmt::format("{:.{}f}", factor, factor < 9.95 ? 1 : 0);
}

std::string next_of(const Choice& choice) {
  return choice.families.size() > 1 ? choice.families[1].name : "-";
}

/// "on 3 of 3 scenes, 1.1 times the fastest; then CVODE on 2, 30 times; never time stepping"
std::string why_taken(const Choice& choice) {
  if (choice.families.empty()) return "no setting that was tried reaches it";
  const auto speed = [](const Choice::Family& f) {
    return f.slower < 1.005 ? std::string("always the fastest") : times(f.slower) + " times the fastest";
  };
  std::string text = fmt::format("reaches it on {} of {} scenes, {}", choice.families[0].reached, choice.scenes,
                                 speed(choice.families[0]));
  for (std::size_t k = 1; k < choice.families.size(); ++k) {
    const auto& family = choice.families[k];
    text += fmt::format("; {}: {} of {}, {}", family.name, family.reached, choice.scenes, speed(family));
  }
  if (!choice.never.empty()) text += fmt::format("; not reached by {}", fmt::join(choice.never, ", "));
  return text;
}

}  // namespace

std::vector<Choice> choices(const std::vector<FastestRun>& runs) {
  std::vector<Choice> list;
  for (const auto& group : different(runs, &FastestRun::group)) {
    for (const double level : different(runs, &FastestRun::level)) {
      Choice choice = choice_of(group, level, runs);
      if (choice.scenes > 0) list.push_back(std::move(choice));
    }
  }
  return list;
}

nlohmann::json choice_data(const std::vector<FastestRun>& runs) {
  using nlohmann::json;
  const auto groups = different(runs, &FastestRun::group);
  const auto levels = different(runs, &FastestRun::level);
  const auto place = [](const auto& list, const auto& value) { return std::ranges::find(list, value) - list.begin(); };
  json data = {{"groups", groups}, {"levels", levels}, {"choices", json::array()}};
  for (const Choice& choice : choices(runs)) {
    json families = json::array(), run;
    for (const auto& [name, reached, slower] : choice.families)
      families.push_back({{"name", name}, {"reached", reached}, {"slower", slower}});
    if (!choice.families.empty())
      run = {{"method", choice.run.method},
             {"microseconds", choice.run.microseconds()},
             {"scene", choice.run.scene},
             {"command", choice.run.command()}};
    data["choices"].push_back({{"group", place(groups, choice.group)},
                               {"level", place(levels, choice.level)},
                               {"scenes", choice.scenes},
                               {"families", families},
                               {"never", choice.never},
                               {"run", run},
                               {"factor", choice.families.size() > 1 ? json(choice.factor) : json()}});
  }
  return data;
}

Table which_to_take(const std::vector<FastestRun>& runs) {
  using C = Choice;
  const std::vector<Column<C>> columns = {
      {"class of scene", &C::group},
      {"wanted error", [](const C& c) { return fmt::format("{:.0e}", c.level); }},
      {"take", [](const C& c) { return c.families.empty() ? std::string("none") : c.families[0].name; }},
      {"for example", [](const C& c) { return c.run.method; }},
      {"time", "us", "{:.3g}", [](const C& c) { return when(!c.families.empty(), c.run.microseconds()); }},
      {"next", next_of},
      {"next takes", "times", "{}", [](const C& c) { return std::isfinite(c.factor) ? times(c.factor) : "-"; }},
      {"why", why_taken},
  };
  const bool is_kept = !runs.empty() && runs.front().solver() == "kept";
  Table table = table_of(
      std::string("Which method to take") + (is_kept ? ", solvers kept between runs" : ""), columns, choices(runs),
      "By class of scene and error in the final state: the family that reaches the error on most scenes and, among "
      "these, is fastest by the geometric mean of CPU times. Every family uses the best of its methods and settings on "
      "each scene. CPU time: median over the scenes.");
  table.filters = {0, 1};
  return table;
}

}  // namespace ricochet
