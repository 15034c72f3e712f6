#include "reports/hard_cases.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "problems/named_values.h"
#include "reports/ending_names.h"
#include "reports/json_number.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// The numbers of the two structs with their names in a file.
const std::vector<std::pair<const char*, double CaseLimits::*>> kLimits = {
    {"exact", &CaseLimits::exact},       {"error", &CaseLimits::error},
    {"energy", &CaseLimits::energy},     {"penetration", &CaseLimits::penetration},
    {"momentum", &CaseLimits::momentum}, {"cone", &CaseLimits::cone}};
const std::vector<std::pair<const char*, double CellOutcome::*>> kMeasured = {
    {"t", &CellOutcome::t},
    {"error", &CellOutcome::error},
    {"energy_gain", &CellOutcome::energy_gain},
    {"energy_change", &CellOutcome::energy_change},
    {"penetration", &CellOutcome::penetration},
    {"momentum", &CellOutcome::momentum},
    {"cone", &CellOutcome::cone},
    {"seconds", &CellOutcome::seconds}};

std::string number(double x) {
  return std::isfinite(x) ? fmt::format("{:.2e}", x) : "-";
}

bool is_right(const HardCell& cell) {
  return text_of(cell.verdict()).grade == Grade::good;
}

}  // namespace

std::string HardCell::setting() const {
  return steps > 0 ? fmt::format("{} steps", steps) : fmt::format("tolerance {:.0e}", tolerance);
}

json to_json(const HardCell& c) {
  json limits = {{"paradox", c.limits.paradox}, {"conserves_energy", c.limits.conserves_energy}};
  for (const auto& [name, member] : kLimits) limits[name] = number_or_null(c.limits.*member);
  json outcome = {{"status", c.outcome.status}, {"message", c.outcome.message}, {"is_finite", c.outcome.is_finite}};
  for (const auto& entry : kEndings) {
    if (entry.second == c.outcome.ending) outcome["ending"] = entry.first;
  }
  for (const auto& [name, member] : kMeasured) outcome[name] = number_or_null(c.outcome.*member);
  return {{"kind", "hard_cell"},
          {"case", c.hard_case},
          {"title", c.case_title},
          {"group", c.group},
          {"method", c.method},
          {"steps", c.steps},
          {"tolerance", c.tolerance},
          {"command", c.command},
          {"verdict", text_of(c.verdict()).word},  // for readers of the file; the rule is applied again
          {"limits", limits},
          {"outcome", outcome}};
}

HardCell hard_cell_from_json(const json& j) {
  HardCell c;
  j.at("case").get_to(c.hard_case);
  j.at("title").get_to(c.case_title);
  j.at("group").get_to(c.group);
  j.at("method").get_to(c.method);
  j.at("steps").get_to(c.steps);
  j.at("tolerance").get_to(c.tolerance);
  j.at("command").get_to(c.command);
  const json &limits = j.at("limits"), &outcome = j.at("outcome");
  limits.at("paradox").get_to(c.limits.paradox);
  limits.at("conserves_energy").get_to(c.limits.conserves_energy);
  for (const auto& [name, member] : kLimits) c.limits.*member = number_or_nan(limits.at(name));
  const std::string ending = outcome.at("ending");
  for (const auto& entry : kEndings) {
    if (entry.first == ending) c.outcome.ending = entry.second;
  }
  outcome.at("status").get_to(c.outcome.status);
  outcome.at("message").get_to(c.outcome.message);
  outcome.at("is_finite").get_to(c.outcome.is_finite);
  for (const auto& [name, member] : kMeasured) c.outcome.*member = number_or_nan(outcome.at(name));
  return c;
}

HardMatrix::HardMatrix(const std::vector<HardCell>& cells) {
  std::map<std::string, std::size_t> row, column;
  for (const auto& cell : cells) {
    if (row.emplace(cell.method, methods_.size()).second) methods_.push_back(cell.method);
    if (column.emplace(cell.hard_case, cases_.size()).second)
      cases_.push_back({cell.hard_case, cell.case_title, cell.group});
  }
  cells_.assign(methods_.size() * cases_.size(), nullptr);
  for (const auto& cell : cells) cells_[row[cell.method] * cases_.size() + column[cell.hard_case]] = &cell;
}

std::vector<Table> verdict_tables(const std::vector<HardCell>& cells) {
  const HardMatrix matrix(cells);
  std::vector<Table> tables;
  for (std::size_t first = 0, last = 0; first < matrix.cases().size(); first = last) {
    const std::string& group = matrix.cases()[first].group;
    for (last = first; last < matrix.cases().size() && matrix.cases()[last].group == group;) ++last;
    Table table;
    table.title = group;
    table.columns.push_back({"method", true});
    for (std::size_t c = first; c < last; ++c) {
      table.columns.push_back({matrix.cases()[c].id, true});
      table.note += fmt::format("{}{}: {}", c > first ? "\n  " : "", matrix.cases()[c].id, matrix.cases()[c].title);
    }
    for (std::size_t m = 0; m < matrix.methods().size(); ++m) {
      table.rows.push_back({matrix.methods()[m]});
      for (std::size_t c = first; c < last; ++c) {
        const HardCell* cell = matrix.cell(m, c);
        table.rows.back().emplace_back(cell ? text_of(cell->verdict()).word : "-");
      }
    }
    tables.push_back(std::move(table));
  }
  return tables;
}

Table verdict_legend(const std::vector<HardCell>& cells) {
  std::map<CaseVerdict, int> count;
  for (const auto& cell : cells) ++count[cell.verdict()];
  Table table;
  table.title = "Verdicts";
  table.columns = {{"word", true}, {"cells"}, {"meaning", true}};
  for (const auto& [verdict, number_of] : count)
    table.rows.push_back({text_of(verdict).word, fmt::format("{}", number_of), text_of(verdict).meaning});
  return table;
}

Table case_table(const std::vector<HardCell>& cells) {
  const HardMatrix matrix(cells);
  Table table;
  table.title = "Cases: how many methods are right";
  table.columns = {{"case", true}, {"right"}, {"not right"}, {"declined"}, {"smallest error"}, {"by", true}};
  for (std::size_t c = 0; c < matrix.cases().size(); ++c) {
    int right = 0, not_right = 0, declined = 0;
    double best = std::numeric_limits<double>::infinity();
    std::string by = "-";
    for (std::size_t m = 0; m < matrix.methods().size(); ++m) {
      const HardCell* cell = matrix.cell(m, c);
      if (!cell) continue;
      ++(is_right(*cell) ? right : cell->verdict() == CaseVerdict::declined ? declined : not_right);
      if (!is_right(*cell) || !(cell->outcome.error < best)) continue;
      best = cell->outcome.error;
      by = cell->method;
    }
    table.rows.push_back({matrix.cases()[c].id, fmt::format("{}", right), fmt::format("{}", not_right),
                          fmt::format("{}", declined), number(best), by});
  }
  return table;
}

Table energy_table(const std::vector<HardCell>& cells) {
  Table table;
  table.title = "Energy drift where energy is conserved";
  table.columns = {{"case", true}, {"method", true}, {"setting", true}, {"energy, end minus start [J]"},
                   {"error"},      {"seconds"}};
  for (const auto& cell : cells) {
    if (!cell.limits.conserves_energy || cell.outcome.status != "success") continue;
    table.rows.push_back({cell.hard_case, cell.method, cell.setting(),
                          fmt::format("{:+.2e}", cell.outcome.energy_change), number(cell.outcome.error),
                          fmt::format("{:.2f}", cell.outcome.seconds)});
  }
  return table;
}

Table hard_failures(const std::vector<HardCell>& cells) {
  Table table;
  table.title = "Cells that are not right";
  table.columns = {{"case", true}, {"method", true}, {"verdict", true}, {"because", true}, {"repeat with", true}};
  for (const auto& cell : cells) {
    const CaseVerdict verdict = cell.verdict();
    if (is_right(cell) || verdict == CaseVerdict::declined) continue;
    table.rows.push_back(
        {cell.hard_case, cell.method, text_of(verdict).word, decisive_number(verdict, cell.outcome), cell.command});
  }
  return table;
}

Table hard_details(const std::vector<HardCell>& cells) {
  Table table;
  table.title = "All cells";
  table.columns = {{"case", true},  {"method", true}, {"setting", true}, {"verdict", true}, {"error"},
                   {"energy gain"}, {"energy, end"},  {"penetration"},   {"momentum"},      {"cone"},
                   {"seconds"},     {"status", true}, {"message", true}};
  for (const auto& cell : cells) {
    const CellOutcome& o = cell.outcome;
    table.rows.push_back({cell.hard_case, cell.method, cell.setting(), text_of(cell.verdict()).word, number(o.error),
                          number(o.energy_gain), number(o.energy_change), number(o.penetration), number(o.momentum),
                          number(o.cone), number(o.seconds), o.status, o.message});
  }
  return table;
}

}  // namespace ricochet
