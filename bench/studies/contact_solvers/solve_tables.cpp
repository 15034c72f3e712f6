#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <limits>

#include "bench/studies/contact_solvers/contact_solve.h"
#include "reports/quantile.h"

namespace ricochet {
namespace {

using C = ContactSolve;
using Group = std::vector<const C*>;  // never empty

Group group_of(const std::vector<C>& solves, const std::function<bool(const C&)>& belongs) {
  Group group;
  for (const C& solve : solves) {
    if (belongs(solve)) group.push_back(&solve);
  }
  return group;
}

/// Values of the solved problems.
std::vector<double> of_solved(const Group& group, double accuracy, const std::function<double(const C&)>& value) {
  std::vector<double> values;
  for (const C* solve : group) {
    if (solve->is_solved(accuracy)) values.push_back(value(*solve));
  }
  return values;
}

/// Median, and the largest in brackets.
std::string spread(const std::vector<double>& values) {
  return values.empty() || std::isnan(values.front())
             ? "-"
             : fmt::format("{:.3g} ({:.3g})", median(values), quantile(values, 1));
}

/// The same of work, where a solver has some.
std::string work_spread(const std::vector<double>& values) {
  return values.empty() || quantile(values, 1) == 0 ? "-" : spread(values);
}

std::vector<Column<Group>> columns_of(double accuracy) {
  const auto of = [=](auto value) {
    return [=](const Group& group) { return spread(of_solved(group, accuracy, value)); };
  };
  const auto work = [=](std::int64_t C::*member) {
    return [=](const Group& group) {
      return work_spread(of_solved(group, accuracy, [=](const C& c) { return static_cast<double>(c.*member); }));
    };
  };
  return {
      {"solver", [](const Group& g) { return g.front()->solver; }},
      {"problems", "", "{}", [](const Group& g) { return g.size(); }},
      {"solved", "", "{}", [=](const Group& g) { return of_solved(g, accuracy, [](const C&) { return 0; }).size(); }},
      {"time", "us", "{}", of([](const C& c) { return 1e6 * c.seconds; })},
      {"pivots", "", "{}", work(&C::pivots)},
      {"iterations", "", "{}", work(&C::iterations)},
      {"factorizations", "", "{}", work(&C::factorizations)},
      {"violation", "", "{}", of([](const C& c) { return c.violation; })},
  };
}

}  // namespace

PerformanceProfile contact_profile(const std::vector<C>& solves, int least_contacts, double accuracy) {
  const auto solvers = different(solves, &C::solver);
  std::vector<std::vector<double>> costs;
  for (const auto& solver : solvers) {
    auto& row = costs.emplace_back();
    for (const C& solve : solves) {
      if (solve.solver == solver && solve.contacts >= least_contacts)
        row.push_back(solve.is_solved(accuracy) ? solve.seconds : std::numeric_limits<double>::infinity());
    }
  }
  return {solvers, costs};
}

Table recorded_conditioning(const std::vector<C>& solves) {
  std::vector<Conditioning> problems;
  for (const C* solve : group_of(solves, [&](const C& c) { return c.solver == solves.front().solver; }))
    problems.push_back(*solve);
  return conditioning_table(problems);
}

Table solver_table(const std::vector<C>& solves, double accuracy) {
  std::vector<Group> groups;
  for (const auto& solver : different(solves, &C::solver))
    groups.push_back(group_of(solves, [&](const C& c) { return c.solver == solver; }));
  return without_empty(
      table_of(
          "Contact solvers", columns_of(accuracy), groups,
          fmt::format(
              "From zero to a violation of the laws of at most {:g}, whatever the solver's own tolerance. "
              "Median over the solved problems, the largest value in brackets. Times are CPU times and include the "
              "construction of the solver. lemke replaces the friction disc in space by a polygon and is not run above "
              "{} contacts.",
              accuracy, contact_solver(ContactSolverKind::lemke).most_contacts)),
      {"time [us]"});
}

Table solver_scene_table(const std::vector<C>& solves, double accuracy) {
  std::vector<Group> groups;
  for (const auto& scene : different(solves, &C::scene)) {
    for (const auto& solver : different(solves, &C::solver))
      groups.push_back(group_of(solves, [&](const C& c) { return c.scene == scene && c.solver == solver; }));
  }
  auto columns = columns_of(accuracy);
  columns.insert(columns.begin(), {"scene", [](const Group& g) { return g.front()->scene; }});
  return without_empty(table_of("Contact solvers on each scene", columns, groups), {"time [us]"});
}

}  // namespace ricochet
