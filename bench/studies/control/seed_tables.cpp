#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "bench/studies/control/seed_rows.h"
#include "reports/quantile.h"

namespace ricochet {
namespace {

std::vector<double> values_of(const SeedGroup& runs, auto member) {
  std::vector<double> values;
  for (const SeedRun* run : runs) values.push_back(static_cast<double>(std::invoke(member, *run)));
  return values;
}

/// "12.1 | 13.4 | 20": the quartiles, '-' of nothing, or of times that were not measured.
std::string quartiles(std::vector<double> values) {
  std::erase_if(values, [](double value) { return std::isnan(value); });
  if (values.empty()) return "-";
  return fmt::format("{:.3g} | {:.3g} | {:.3g}", quantile(values, 0.25), median(values), quantile(values, 0.75));
}

SeedGroup solved(const SeedGroup& group) {
  return rows_where(group, &SeedRun::succeeded);
}

SeedGroup replayed(const SeedGroup& group) {
  return rows_where(group, &SeedRun::is_replayed);
}

/// "S 45, W 3", the strongest first.
std::string stationarities(const SeedGroup& runs) {
  std::string text;
  for (const char* kind : {"B", "B up to an edge", "not B", "S", "M", "C", "W", "unknown"}) {
    if (const auto count = std::ranges::count(runs, kind, &SeedRun::stationarity); count > 0)
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", kind, count);
  }
  return text.empty() ? "-" : text;
}

}  // namespace

std::string SeedRun::command() const {
  return fmt::format("ricochet control {} {} --seed {}", problem, arguments, seed);
}

double SeedRun::iteration_seconds() const {
  return iterations > 0 && solve_cpu_seconds > 0 ? solve_cpu_seconds / iterations
                                                 : std::numeric_limits<double>::quiet_NaN();
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

std::string solver_name(const SeedGroup& group, const std::vector<SeedGroup>& groups) {
  const auto short_name = [](const SeedGroup& of) {
    const SeedRun& run = *of.front();
    return run.linear_solver.empty() ? run.method : fmt::format("{}, {}", run.method, run.linear_solver);
  };
  const auto is_named_so = [&](const SeedGroup& other) {
    return other.front()->problem == group.front()->problem && short_name(other) == short_name(group);
  };
  const bool is_unique = std::ranges::count_if(groups, is_named_so) == 1;
  return is_unique ? short_name(group) : fmt::format("{} {}", short_name(group), group.front()->arguments);
}

Table seed_table(const std::vector<SeedRun>& runs) {
  using G = SeedGroup;
  // Statistics of the solved runs.
  const auto of_solved = [](auto value) { return [=](const G& g) { return value(solved(g)); }; };
  const auto cost = [](const G& g) { return values_of(g, &SeedRun::cost); };
  static const std::vector<Column<G>> columns = {
      {"problem", [](const G& g) { return g.front()->problem; }},
      {"method", [](const G& g) { return g.front()->method; }},
      {"solved", "", "{}",
       [](const G& g) {
         const std::size_t n = solved(g).size();
         return fmt::format("{} of {}, {:.0f} %", n, g.size(),
                            100 * static_cast<double>(n) / static_cast<double>(g.size()));
       }},
      {"stationary", of_solved(stationarities)},
      {"B", "", "{}", of_solved([](const G& g) { return std::ranges::count(g, true, &SeedRun::is_b_stationary); })},
      {"least cost", "", "{:.6g}", of_solved([=](const G& g) { return quantile(cost(g), 0); })},
      {"cost", "", "{}", of_solved([=](const G& g) { return quartiles(cost(g)); })},
      {"worst cost", "", "{:.6g}", of_solved([=](const G& g) { return quantile(cost(g), 1); })},
      {"CPU s", "", "{}", of_solved([](const G& g) { return quartiles(values_of(g, &SeedRun::cpu_seconds)); })},
      {"CPU ms/it.", "", "{}", of_solved([](const G& g) {
         return quartiles(values_of(g, [](const SeedRun& run) { return 1e3 * run.iteration_seconds(); }));
       })},
      {"wall s", "", "{}", of_solved([](const G& g) { return quartiles(values_of(g, &SeedRun::seconds)); })},
      {"iterations", "", "{}", of_solved([](const G& g) { return quartiles(values_of(g, &SeedRun::iterations)); })},
      {"replayed", "", "{}", of_solved([](const G& g) { return replayed(g).size(); })},
      {"to 1e-9", "", "{}", of_solved([](const G& g) { return rows_where(g, &SeedRun::is_replayed_exactly).size(); })},
      {"off by", "", "{:.1e}",
       of_solved([](const G& g) { return median(values_of(replayed(g), &SeedRun::terminal)); })},
      {"arguments", [](const G& g) { return g.front()->arguments; }},
  };
  Table table = table_of(
      "Random initial guesses", columns, seed_groups(runs),
      "Cost, times and iterations: quartiles and median of the solved runs; the time includes the guess, that per "
      "iteration does not. "
      "Stationary: strongest kind that the multipliers prove; B: no feasible descent direction exists, for shooting "
      "possibly up to an edge, across which the cost jumps up. Replayed: runs whose controls adaptive FESD-J could apply "
      "to the plant; to 1e-9: those that end so near to the claim. Off by: median of the max-norm of claim minus replay "
      "in (q, v) at T.");
  table.is_list = true;
  return without_empty(table, {"CPU s", "CPU ms/it.", "wall s"});
}

namespace {

/// Calls compare(problem, first, second) for every problem that has a group of both kinds.
template <class IsFirst, class IsSecond, class Compare>
void for_each_pair(const std::vector<SeedRun>& runs, const IsFirst& is_first, const IsSecond& is_second,
                   const Compare& compare) {
  const auto groups = seed_groups(runs);
  for (const auto& problem : different(runs, &SeedRun::problem)) {
    const auto group_where = [&](const auto& is_it) {
      return std::ranges::find_if(
          groups, [&](const SeedGroup& group) { return group.front()->problem == problem && is_it(*group.front()); });
    };
    const auto first = group_where(is_first), second = group_where(is_second);
    if (first != groups.end() && second != groups.end()) compare(problem, *first, *second);
  }
}

}  // namespace

std::vector<Comparison> seed_comparisons(const std::vector<SeedRun>& runs) {
  std::vector<Comparison> comparisons;
  const auto is_by = [](const char* method) { return [=](const SeedRun& run) { return run.method == method; }; };
  const auto compare = [&](const std::string& problem, const SeedGroup& homotopy, const SeedGroup& shooting) {
    const auto add_count = [&](const char* quantity, bool (SeedRun::*is_counted)() const) {
      const auto count = [&](const SeedGroup& g) { return rows_where(g, is_counted).size(); };
      comparisons.push_back({problem, quantity, fmt::format("{} of {}", count(homotopy), homotopy.size()),
                             fmt::format("{} of {}", count(shooting), shooting.size()),
                             static_cast<double>(count(shooting))});
    };
    add_count("solved", &SeedRun::succeeded);
    add_count("certified", &SeedRun::is_certified);
    add_count("replayed to 1e-9", &SeedRun::is_replayed_exactly);
    const SeedGroup of_homotopy = solved(homotopy), of_shooting = solved(shooting);
    if (of_homotopy.empty() || of_shooting.empty()) return;
    const auto add_ratio = [&](const char* quantity, double at, auto member) {
      comparisons.push_back(quotient(problem, quantity, quantile(values_of(of_homotopy, member), at),
                                     quantile(values_of(of_shooting, member), at)));
    };
    add_ratio("median cost", 0.5, &SeedRun::cost);
    add_ratio("least cost", 0, &SeedRun::cost);
    if (shooting.front()->is_timed()) add_ratio("median CPU time", 0.5, &SeedRun::cpu_seconds);
  };
  for_each_pair(runs, is_by(kHomotopy), is_by(kShooting), compare);
  return comparisons;
}

std::vector<Comparison> linear_solver_comparisons(const std::vector<SeedRun>& runs) {
  std::vector<Comparison> comparisons;
  const auto is_by = [](const char* linear_solver) {
    return [=](const SeedRun& run) { return run.method == kHomotopy && run.linear_solver == linear_solver; };
  };
  const auto compare = [&](const std::string& problem, const SeedGroup& mumps, const SeedGroup& ldl) {
    comparisons.push_back(quotient(problem, "guesses solved", static_cast<double>(solved(mumps).size()),
                                   static_cast<double>(solved(ldl).size())));
    const auto milliseconds = [](const SeedGroup& group) {  // of all runs, solved or not
      std::vector<double> values = values_of(group, &SeedRun::iteration_seconds);
      std::erase_if(values, [](double value) { return std::isnan(value); });
      return values.empty() ? std::numeric_limits<double>::quiet_NaN() : 1e3 * median(values);
    };
    if (mumps.front()->is_timed() && ldl.front()->is_timed())
      comparisons.push_back(quotient(problem, "CPU ms per iteration", milliseconds(mumps), milliseconds(ldl)));
  };
  for_each_pair(runs, is_by("mumps"), is_by("ldl"), compare);
  return comparisons;
}

Table seed_failures(const std::vector<SeedRun>& runs) {
  struct Failure {
    const SeedRun* first;
    std::string status, reason;
    std::vector<unsigned> seeds;
  };
  std::vector<Failure> failures;
  for (const auto& group : seed_groups(runs)) {
    std::map<std::pair<std::string, std::string>, std::vector<unsigned>> reasons;
    for (const SeedRun* run : group) {
      if (!run->succeeded())
        reasons[{run->status, run->message.substr(0, run->message.find(';'))}].push_back(run->seed);
    }
    for (const auto& [reason, seeds] : reasons) failures.push_back({group.front(), reason.first, reason.second, seeds});
  }
  using F = Failure;
  static const std::vector<Column<F>> columns = {
      {"problem", [](const F& f) { return f.first->problem; }},
      {"runs", "", "{}", [](const F& f) { return f.seeds.size(); }},
      {"status", &F::status},
      {"reason", &F::reason},
      {"seeds", [](const F& f) { return fmt::format("{}", fmt::join(f.seeds, ", ")); }},
      {"arguments", [](const F& f) { return f.first->arguments; }},
  };
  return table_of("Guesses without a solution", columns, failures);
}

Table seed_details(const std::vector<SeedRun>& runs) {
  using R = SeedRun;
  static const std::vector<Column<R>> columns = {
      {"problem", &R::problem},
      {"method", &R::method},
      {"seed", "", "{}", &R::seed},
      {"status", &R::status},
      {"cost", "", "{:.8g}", [](const R& r) { return when(r.succeeded(), r.cost); }},
      {"stationary", [](const R& r) { return r.succeeded() ? r.stationarity : "-"; }},
      {"B", [](const R& r) { return r.succeeded() && r.is_b_stationary ? "yes" : "-"; }},
      {"CPU s", "", "{:.2f}", &R::cpu_seconds},
      {"CPU ms/it.", "", "{:.3g}", [](const R& r) { return 1e3 * r.iteration_seconds(); }},
      {"wall s", "", "{:.2f}", &R::seconds},
      {"iterations", "", "{}", &R::iterations},
      {"off by", "", "{:.1e}", [](const R& r) { return when(r.succeeded() && r.is_replayed(), r.terminal); }},
      {"reason", &R::message},
      {"command", &R::command},
  };
  return without_empty(table_of("All guesses", columns, runs), {"CPU s", "CPU ms/it.", "wall s"});
}

}  // namespace ricochet
