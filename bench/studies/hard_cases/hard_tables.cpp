#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>

#include "bench/studies/hard_cases/hard_cell.h"

namespace ricochet {
namespace {

using nlohmann::json;

std::string word_of(const HardCell& cell) {
  return text_of(cell.verdict()).word;
}

}  // namespace

bool is_right(const HardCell& cell) {
  return text_of(cell.verdict()).grade == Grade::good;
}

std::string HardCell::setting() const {
  return steps > 0 ? fmt::format("{} steps", steps) : fmt::format("tolerance {:.0e}", tolerance);
}

void to_json(json& j, const HardCell& c) {
  j = {{"case", c.hard_case},  {"title", c.case_title}, {"group", c.group},
       {"method", c.method},   {"steps", c.steps},      {"tolerance", c.tolerance},
       {"command", c.command}, {"verdict", word_of(c)},  // for readers of the file; the rule is applied again
       {"limits", c.limits},   {"outcome", c.outcome}};
  if (!c.outcome.succeeded()) return;
  j["metrics"] = c.metrics;
  j["peak_bytes"] = c.peak_bytes;
  j["reference_error"] = c.reference_error;
  j["solution_size"] = c.solution_size;
}

void from_json(const json& j, HardCell& c) {
  const HardCell none;
  c.hard_case = j.value("case", none.hard_case);
  c.case_title = j.value("title", none.case_title);
  c.group = j.value("group", none.group);
  c.method = j.value("method", none.method);
  c.steps = j.value("steps", none.steps);
  c.tolerance = j.value("tolerance", none.tolerance);
  c.command = j.value("command", none.command);
  c.limits = j.value("limits", none.limits);
  c.outcome = j.value("outcome", none.outcome);
  c.metrics = j.value("metrics", none.metrics);
  c.peak_bytes = j.value("peak_bytes", none.peak_bytes);
  c.reference_error = j.value("reference_error", none.reference_error);
  c.solution_size = j.value("solution_size", none.solution_size);
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
  struct Word {
    VerdictText text;
    int cells;
  };
  static const std::vector<Column<Word>> columns = {
      {"word", [](const Word& w) { return w.text.word; }},
      {"cells", "", "{}", &Word::cells},
      {"meaning", [](const Word& w) { return w.text.meaning; }},
  };
  std::map<CaseVerdict, int> count;
  for (const auto& cell : cells) ++count[cell.verdict()];
  std::vector<Word> words;
  for (const auto& [verdict, number] : count) words.push_back({text_of(verdict), number});
  return table_of("Verdicts", columns, words);
}

Table case_table(const std::vector<HardCell>& cells) {
  struct Count {
    std::string id;
    int right = 0, not_right = 0, declined = 0;
    double best = std::numeric_limits<double>::infinity();
    std::string by = "-";

    void add(const HardCell& cell) {
      ++(is_right(cell) ? right : cell.verdict() == CaseVerdict::declined ? declined : not_right);
      if (!is_right(cell) || !(cell.outcome.error < best)) return;
      best = cell.outcome.error;
      by = cell.method;
    }
  };
  static const std::vector<Column<Count>> columns = {
      {"case", &Count::id},
      {"right", "", "{}", &Count::right},
      {"not right", "", "{}", &Count::not_right},
      {"declined", "", "{}", &Count::declined},
      {"smallest error", "", "{:.2e}", &Count::best},
      {"by", &Count::by},
  };
  const HardMatrix matrix(cells);
  std::vector<Count> counts;
  for (std::size_t c = 0; c < matrix.cases().size(); ++c) {
    counts.push_back({.id = matrix.cases()[c].id});
    for (std::size_t m = 0; m < matrix.methods().size(); ++m) {
      if (const HardCell* cell = matrix.cell(m, c)) counts.back().add(*cell);
    }
  }
  return table_of("Cases: how many methods are right", columns, counts);
}

Table energy_table(const std::vector<HardCell>& cells) {
  using C = HardCell;
  static const std::vector<Column<C>> columns = {
      {"case", &C::hard_case},
      {"method", &C::method},
      {"setting", &C::setting},
      {"energy, end minus start", "J", "{:+.2e}", [](const C& c) { return c.outcome.energy_change; }},
      {"error", "", "{:.2e}", [](const C& c) { return c.outcome.error; }},
      {"seconds", "", "{:.2f}", [](const C& c) { return c.outcome.seconds; }},
  };
  std::vector<C> conserving;
  std::ranges::copy_if(cells, std::back_inserter(conserving),
                       [](const C& c) { return c.limits.conserves_energy && c.outcome.succeeded(); });
  return table_of("Energy drift where energy is conserved", columns, conserving);
}

Table hard_failures(const std::vector<HardCell>& cells) {
  using C = HardCell;
  static const std::vector<Column<C>> columns = {
      {"case", &C::hard_case},      {"method", &C::method},
      {"verdict", word_of},         {"because", [](const C& c) { return decisive_number(c.verdict(), c.outcome); }},
      {"repeat with", &C::command},
  };
  std::vector<C> failed;
  std::ranges::copy_if(cells, std::back_inserter(failed),
                       [](const C& c) { return !is_right(c) && c.verdict() != CaseVerdict::declined; });
  return table_of("Cells that are not right", columns, failed);
}

std::vector<MeasuredRun> measured_runs(const std::vector<HardCell>& cells) {
  std::vector<MeasuredRun> runs;
  for (const HardCell& cell : cells) {
    if (cell.outcome.succeeded())
      runs.push_back(
          {cell.hard_case, cell.method, cell.setting(), cell.metrics, cell.reference_error, cell.solution_size});
  }
  return runs;
}

Table hard_details(const std::vector<HardCell>& cells, const std::string& experiment) {
  using C = HardCell;
  const auto measured = [](double CellOutcome::*number) { return [=](const C& c) { return c.outcome.*number; }; };
  static const std::vector<Column<C>> columns = {
      {"case", &C::hard_case},
      {"method", &C::method},
      {"setting", &C::setting},
      {"verdict", word_of},
      {"error", "", "{:.2e}", measured(&CellOutcome::error)},
      {"energy gain", "", "{:.2e}", measured(&CellOutcome::energy_gain)},
      {"energy, end", "", "{:.2e}", measured(&CellOutcome::energy_change)},
      {"penetration", "", "{:.2e}", measured(&CellOutcome::penetration)},
      {"momentum", "", "{:.2e}", measured(&CellOutcome::momentum)},
      {"cone", "", "{:.2e}", measured(&CellOutcome::cone)},
      {"seconds", "", "{:.2e}", measured(&CellOutcome::seconds)},
      {"peak heap", "kB", "{:.1f}", [](const C& c) { return c.peak_bytes / 1e3; }},
      {"status", [](const C& c) { return c.outcome.status; }},
      {"message", [](const C& c) { return c.outcome.message; }},
  };
  Table table = table_of("All cells", columns, cells);
  for (const C& cell : cells) table.row_ids.push_back(cell.row_id(experiment));
  return table;
}

}  // namespace ricochet
