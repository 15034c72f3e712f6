#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>

#include "bench/studies/hard_cases/hard_cell.h"

namespace ricochet {
namespace {

using nlohmann::json;

double wall_seconds(const HardCell& cell) {
  return cell.has_time() ? cell.timing.median : kNoNumber;
}

std::string word_of(const HardCell& cell) {
  return text_of(cell.verdict()).word;
}

}  // namespace

bool is_right(const HardCell& cell) {
  return text_of(cell.verdict()).grade == Grade::good;
}

void to_json(json& j, const HardCell& cell) {
  to_json(j, static_cast<const Run&>(cell));
  j["limits"] = cell.limits;
  j["verdict"] = word_of(cell);  // for readers of the file; the rule is applied again
}

void from_json(const json& j, HardCell& cell) {
  from_json(j, static_cast<Run&>(cell));
  cell.limits = j.value("limits", CaseLimits());
}

HardMatrix::HardMatrix(const std::vector<HardCell>& cells) {
  std::map<std::string, std::size_t> row, column;
  for (const auto& cell : cells) {
    if (row.emplace(cell.method, methods_.size()).second) methods_.push_back(cell.method);
    if (column.emplace(cell.scene, cases_.size()).second)
      cases_.push_back({cell.scene, cell.label("title"), cell.group});
  }
  cells_.assign(methods_.size() * cases_.size(), nullptr);
  for (const auto& cell : cells) cells_[row[cell.method] * cases_.size() + column[cell.scene]] = &cell;
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
      if (!is_right(cell) || !(cell.error < best)) return;
      best = cell.error;
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
      {"case", &C::scene},
      {"method", &C::method},
      {"setting", [](const C& c) { return c.setting.text(); }},
      {"energy, end minus start", "J", "{:+.2e}", [](const C& c) { return c.value("energy_change"); }},
      {"error", "", "{:.2e}", &C::error},
      {"seconds", "", "{:.2f}", wall_seconds},
  };
  const auto conserving = rows_where(cells, [](const C& c) { return c.limits.conserves_energy && c.succeeded(); });
  return table_of("Energy drift where energy is conserved", columns, conserving);
}

Table hard_failures(const std::vector<HardCell>& cells) {
  using C = HardCell;
  static const std::vector<Column<C>> columns = {
      {"case", &C::scene},          {"method", &C::method},
      {"verdict", word_of},         {"because", [](const C& c) { return decisive_number(c.verdict(), c); }},
      {"repeat with", &C::command},
  };
  const auto failed =
      rows_where(cells, [](const C& c) { return !is_right(c) && c.verdict() != CaseVerdict::declined; });
  return table_of("Cells that are not right", columns, failed);
}

std::vector<MeasuredRun> measured_runs(const std::vector<HardCell>& cells) {
  std::vector<MeasuredRun> runs;
  for (const HardCell& cell : cells) {
    if (cell.succeeded())
      runs.push_back(
          {cell.scene, cell.method, cell.setting.text(), cell.metrics, cell.reference_error, cell.solution_size});
  }
  return runs;
}

Table hard_details(const std::vector<HardCell>& cells, const std::string& experiment) {
  using C = HardCell;
  const auto measured = [](const char* name) { return [=](const C& c) { return c.value(name); }; };
  static const std::vector<Column<C>> columns = {
      {"case", &C::scene},
      {"method", &C::method},
      {"setting", [](const C& c) { return c.setting.text(); }},
      {"verdict", word_of},
      {"error", "", "{:.2e}", &C::error},
      {"energy gain", "", "{:.2e}", measured("energy_gain")},
      {"energy, end", "", "{:.2e}", measured("energy_change")},
      {"penetration", "", "{:.2e}", measured("penetration")},
      {"momentum", "", "{:.2e}", measured("momentum")},
      {"cone", "", "{:.2e}", measured("cone")},
      {"seconds", "", "{:.2e}", wall_seconds},
      {"peak heap", "kB", "{:.1f}", [](const C& c) { return c.peak_bytes / 1e3; }},
      {"status", &C::status},
      {"message", &C::message},
  };
  Table table = table_of("All cells", columns, cells);
  for (const C& cell : cells) table.row_ids.push_back(cell.row_id(experiment));
  return table;
}

}  // namespace ricochet
