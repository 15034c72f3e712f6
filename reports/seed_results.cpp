#include "reports/seed_results.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "reports/json_number.h"
#include "reports/quantile.h"

namespace ricochet {
namespace {

using nlohmann::json;

std::vector<double> values_of(const SeedGroup& runs, auto member) {
  std::vector<double> values;
  for (const SeedRun* run : runs) values.push_back(static_cast<double>(run->*member));
  return values;
}

/// "12.1 | 13.4 | 20": the quartiles, '-' of nothing.
std::string quartiles(const std::vector<double>& values) {
  if (values.empty()) return "-";
  return fmt::format("{:.3g} | {:.3g} | {:.3g}", quantile(values, 0.25), median(values), quantile(values, 0.75));
}

SeedGroup solved(const SeedGroup& group) {
  SeedGroup runs;
  std::ranges::copy_if(group, std::back_inserter(runs), &SeedRun::succeeded);
  return runs;
}

/// "S 45, W 3", the strongest first.
std::string stationarities(const SeedGroup& runs) {
  std::string text;
  for (const char* kind : {"S", "M", "C", "W", "unknown"}) {
    if (const auto count = std::ranges::count(runs, kind, &SeedRun::stationarity); count > 0)
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", kind, count);
  }
  return text.empty() ? "-" : text;
}

}  // namespace

std::string SeedRun::command() const {
  return fmt::format("ricochet control {} {} --seed {}", problem, arguments, seed);
}

json to_json(const SeedRun& r) {
  return {{"kind", "seed_run"},
          {"problem", r.problem},
          {"arguments", r.arguments},
          {"seed", r.seed},
          {"status", r.status},
          {"message", r.message},
          {"iterations", r.iterations},
          {"seconds", r.seconds},
          {"cpu_seconds", r.cpu_seconds},
          {"cost", r.cost},
          {"stationarity", r.stationarity},
          {"is_b_stationary", r.is_b_stationary},
          {"replay_status", r.replay_status},
          {"terminal", number_or_null(r.terminal)}};
}

SeedRun seed_run_from_json(const json& j) {
  SeedRun r;
  j.at("problem").get_to(r.problem);
  j.at("arguments").get_to(r.arguments);
  j.at("seed").get_to(r.seed);
  j.at("status").get_to(r.status);
  j.at("message").get_to(r.message);
  j.at("iterations").get_to(r.iterations);
  j.at("seconds").get_to(r.seconds);
  j.at("cpu_seconds").get_to(r.cpu_seconds);
  j.at("cost").get_to(r.cost);
  j.at("stationarity").get_to(r.stationarity);
  j.at("is_b_stationary").get_to(r.is_b_stationary);
  j.at("replay_status").get_to(r.replay_status);
  r.terminal = number_or_nan(j.at("terminal"));
  return r;
}

std::vector<SeedGroup> seed_groups(const std::vector<SeedRun>& runs) {
  std::vector<SeedGroup> groups;
  for (const auto& run : runs) {
    const auto own = std::ranges::find_if(groups, [&](const SeedGroup& group) {
      return group.front()->problem == run.problem && group.front()->arguments == run.arguments;
    });
    if (own == groups.end())
      groups.push_back({&run});
    else
      own->push_back(&run);
  }
  return groups;
}

Table seed_table(const std::vector<SeedRun>& runs) {
  Table table;
  table.title = "Random initial guesses";
  table.columns = {{"problem", true}, {"solved"},   {"stationary", true}, {"B"},
                   {"least cost"},    {"cost"},     {"worst cost"},       {"CPU s"},
                   {"iterations"},    {"replayed"}, {"off by"},           {"arguments", true}};
  for (const auto& group : seed_groups(runs)) {
    const SeedGroup good = solved(group);
    const auto costs = values_of(good, &SeedRun::cost);
    std::vector<double> terminal;
    for (const SeedRun* run : good) {
      if (run->is_replayed()) terminal.push_back(run->terminal);
    }
    const auto rate = 100 * static_cast<double>(good.size()) / static_cast<double>(group.size());
    table.rows.push_back({group.front()->problem, fmt::format("{} of {}, {:.0f} %", good.size(), group.size(), rate),
                          stationarities(good),
                          fmt::format("{}", std::ranges::count(good, true, &SeedRun::is_b_stationary)),
                          costs.empty() ? "-" : fmt::format("{:.6g}", std::ranges::min(costs)), quartiles(costs),
                          costs.empty() ? "-" : fmt::format("{:.6g}", std::ranges::max(costs)),
                          quartiles(values_of(good, &SeedRun::cpu_seconds)),
                          quartiles(values_of(good, &SeedRun::iterations)), fmt::format("{}", terminal.size()),
                          terminal.empty() ? "-" : fmt::format("{:.1e}", median(terminal)), group.front()->arguments});
  }
  table.note =
      "Cost, CPU time and iterations: quartiles and median of the solved runs; the time with that for the guess. "
      "Stationary: the strongest kind that the multipliers prove; B: no feasible direction descends. Replayed: the "
      "plant "
      "could be run under the controls with adaptive FESD-J; off by: median of the max-norm of claim minus replay in "
      "(q, v) at T.";
  return table;
}

Table seed_failures(const std::vector<SeedRun>& runs) {
  Table table;
  table.title = "Guesses without a solution";
  table.columns = {{"problem", true}, {"runs"},        {"status", true},
                   {"reason", true},  {"seeds", true}, {"arguments", true}};
  for (const auto& group : seed_groups(runs)) {
    std::map<std::pair<std::string, std::string>, std::vector<unsigned>> reasons;
    for (const SeedRun* run : group) {
      if (!run->succeeded())
        reasons[{run->status, run->message.substr(0, run->message.find(';'))}].push_back(run->seed);
    }
    for (const auto& [reason, seeds] : reasons)
      table.rows.push_back({group.front()->problem, fmt::format("{}", seeds.size()), reason.first, reason.second,
                            fmt::format("{}", fmt::join(seeds, ", ")), group.front()->arguments});
  }
  return table;
}

Table seed_details(const std::vector<SeedRun>& runs) {
  Table table;
  table.title = "All guesses";
  table.columns = {{"problem", true},    {"seed"},    {"status", true}, {"cost"},
                   {"stationary", true}, {"B", true}, {"CPU s"},        {"wall s"},
                   {"iterations"},       {"off by"},  {"reason", true}, {"command", true}};
  for (const auto& run : runs) {
    const bool good = run.succeeded();
    table.rows.push_back(
        {run.problem, fmt::format("{}", run.seed), run.status, good ? fmt::format("{:.8g}", run.cost) : "-",
         good ? run.stationarity : "-", good && run.is_b_stationary ? "yes" : "-",
         fmt::format("{:.1f}", run.cpu_seconds), fmt::format("{:.1f}", run.seconds), fmt::format("{}", run.iterations),
         good && run.is_replayed() ? fmt::format("{:.1e}", run.terminal) : "-", run.message, run.command()});
  }
  return table;
}

}  // namespace ricochet
