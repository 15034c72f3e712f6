#include "bench/contacts/contact_set_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "methods/contact_laws/redundant_contacts.h"
#include "problems/input_error.h"
#include "reports/quantile.h"

namespace ricochet {
namespace {

constexpr double kNotSolved = std::numeric_limits<double>::infinity();
constexpr double kHardCondition = 1e6;
// Velocities below this part of the largest are zero in a solution that fulfils the laws to 1e-8.
constexpr double kZeroVelocity = 1e-7;

bool is_solved(const ContactSolution& solution, double accuracy) {
  return solution.declined.empty() && solution.status == ContactStatus::solved && solution.violation <= accuracy;
}

}  // namespace

Conditioning conditioning_of(const StoredContactProblem& stored) {
  const RedundantContacts redundant(stored.problem);
  return {.scene = stored.title.substr(0, stored.title.find(',')),
          .contacts = static_cast<int>(stored.problem.G.n_contacts()),
          .rows = redundant.n_rows(),
          .redundant = redundant.n_redundant(),
          .condition = redundant.condition()};
}

Table conditioning_table(const std::vector<Conditioning>& all) {
  Table table;
  table.title = "Conditioning of the Delassus operator";
  table.note = fmt::format(
      "median, and largest in brackets; condition: largest over smallest eigenvalue that is no zero (1e-13 of the "
      "largest); redundant: problems with a null space, and the largest share of rows that are in one; ill: condition "
      "above {:.0e}",
      kHardCondition);
  table.columns = {{"scene", true}, {"problems"},  {"contacts"},           {"condition"},
                   {"ill"},         {"redundant"}, {"most redundant rows"}};
  const auto add = [&](const std::string& name, const auto& belongs) {
    std::vector<double> contacts, conditions;
    int ill = 0, redundant = 0;
    double rows = 0;
    for (const auto& c : all) {
      if (!belongs(c)) continue;
      contacts.push_back(c.contacts);
      conditions.push_back(c.condition);
      ill += c.condition > kHardCondition;
      redundant += c.redundant > 0;
      rows = std::max(rows, static_cast<double>(c.redundant) / c.rows);
    }
    const auto n = contacts.size();
    const auto percent = [&](int part) { return fmt::format("{:.0f} %", 100.0 * part / static_cast<double>(n)); };
    table.rows.push_back({name, std::to_string(n),
                          fmt::format("{:g} ({:g})", median(contacts), std::ranges::max(contacts)),
                          fmt::format("{:.1e} ({:.1e})", median(conditions), std::ranges::max(conditions)),
                          percent(ill), percent(redundant), fmt::format("{:.0f} %", 100 * rows)});
  };
  for (const auto& scene : different(all, &Conditioning::scene))
    add(scene, [&](const Conditioning& c) { return c.scene == scene; });
  if (!all.empty()) add("all", [](const Conditioning&) { return true; });
  return table;
}

ContactSolution solve_of_set(const StoredContactProblem& stored, const std::string& solver, bool from_guess,
                             Timer timer) {
  const ContactSolverOptions options = contact_solver_options(solver);
  ContactSolution declined;
  declined.solver = solver;
  if (const int most = contact_solver(options.kind).most_contacts; stored.problem.G.n_contacts() > most) {
    declined.declined = fmt::format("more than {} contacts, which take it seconds", most);
    return declined;
  }
  try {
    return solve_stored(stored, solver, from_guess, timer);
  } catch (const InputError& error) {
    declined.declined = error.what();
    return declined;
  }
}

ContactSetSolutions solve_set(const std::vector<StoredContactProblem>& problems,
                              const std::vector<std::string>& solvers, bool from_guess) {
  ContactSetSolutions set{.solvers = solvers, .solutions = {}};
  set.solutions.resize(solvers.size());
  for (const auto& stored : problems) {
    for (std::size_t s = 0; s < solvers.size(); ++s)
      set.solutions[s].push_back(solve_of_set(stored, solvers[s], from_guess));
  }
  return set;
}

bool ContactSetSolutions::all_are_solved() const {
  return std::ranges::all_of(solutions, [](const auto& of_solver) {
    return std::ranges::all_of(of_solver,
                               [](const auto& s) { return !s.declined.empty() || s.status == ContactStatus::solved; });
  });
}

PerformanceProfile ContactSetSolutions::profile(double accuracy) const {
  std::vector<std::vector<double>> costs;
  for (const auto& of_solver : solutions) {
    auto& row = costs.emplace_back();
    for (const auto& solution : of_solver) row.push_back(is_solved(solution, accuracy) ? solution.seconds : kNotSolved);
  }
  return {solvers, costs};
}

Table internal_force_table(const std::vector<StoredContactProblem>& problems, const ContactSetSolutions& set,
                           double accuracy) {
  struct Shares {
    std::vector<double> internal, above_least;
  };
  std::vector<Shares> shares(set.solvers.size());
  std::vector<double> least_internal, spread;
  for (std::size_t p = 0; p < problems.size(); ++p) {
    const ContactProblem& problem = problems[p].problem;
    const RedundantContacts redundant(problem);
    if (redundant.n_redundant() == 0) continue;
    Vector least;  // of the first solver that solves it
    std::vector<Vector> internal;
    double size = 0;
    for (std::size_t s = 0; s < set.solvers.size(); ++s) {
      const ContactSolution& solution = set.solutions[s][p];
      if (!is_solved(solution, accuracy) || solution.r.norm() == 0) continue;
      if (least.size() == 0) {
        least = redundant.least_norm(problem, solution.r, kZeroVelocity);
        size = least.norm();
        if (!(size > 0)) break;
        least_internal.push_back(redundant.internal_part(least).norm() / size);
      }
      internal.push_back(redundant.internal_part(solution.r));
      shares[s].internal.push_back(internal.back().norm() / solution.r.norm());
      shares[s].above_least.push_back((internal.back() - redundant.internal_part(least)).norm() / size);
    }
    double widest = 0;
    for (const auto& a : internal) {
      for (const auto& b : internal) widest = std::max(widest, (a - b).norm() / size);
    }
    if (internal.size() > 1) spread.push_back(widest);
  }
  const auto text = [](const std::vector<double>& x) {
    return x.empty() ? "-" : fmt::format("{:.2g} ({:.2g})", median(x), quantile(x, 1));
  };
  Table table;
  table.title = "Internal forces of redundant contacts";
  table.note = fmt::format(
      "||r_0|| / ||r||, r_0 the part of the impulses that moves nothing; and how far r_0 is from that of the least-norm "
      "solution r*, over ||r*||: median, and largest in brackets. Of r* itself: {}. Largest difference between two "
      "solvers of a problem: {}",
      text(least_internal), text(spread));
  table.columns = {{"solver", true}, {"problems"}, {"internal force"}, {"from the least norm"}};
  for (std::size_t s = 0; s < set.solvers.size(); ++s) {
    table.rows.push_back({set.solvers[s], std::to_string(shares[s].internal.size()), text(shares[s].internal),
                          text(shares[s].above_least)});
  }
  return table;
}

}  // namespace ricochet
