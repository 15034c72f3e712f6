#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace ricochet {

/// A table, once: terminal text, Markdown, HTML and CSV are ways to print it.
struct Table {
  struct Column {
    std::string header;
    bool is_text = false;  ///< left-aligned; numbers are right-aligned
  };
  std::string title, note;
  std::vector<Column> columns;
  std::vector<std::vector<std::string>> rows;
  bool is_list = false;   ///< a terminal shows a paragraph per row: for cells that hold sentences
  bool is_whole = false;  ///< the page of results shows all rows, however many there are
  /// Identifiers of the rows in HTML, for links to them; empty, or one per row.
  std::vector<std::string> row_ids = {};
  std::vector<std::size_t> filters = {};  ///< columns of text by whose values the site can choose rows

  std::string text() const;
  std::string list() const;
  std::string terminal() const { return is_list ? list() : text(); }
  /// @param most  rows to print, with a line that says so when there are more; 0: all
  std::string markdown(std::size_t most = 0) const;
  std::string html() const;
  std::string csv() const;
};

/// The different values of some rows, in the order in which they come.
/// @param get  value of a row: a member, or a function
template <class Row, class Get>
auto different(const std::vector<Row>& rows, Get get) {
  std::vector<std::decay_t<std::invoke_result_t<Get, const Row&>>> values;
  for (const Row& row : rows) {
    const auto& value = std::invoke(get, row);
    if (std::find(values.begin(), values.end(), value) == values.end()) values.push_back(value);
  }
  return values;
}

/// The rows that fulfil a condition, in their order.
/// @param condition  of a row: a member, or a function
template <class Row, class Condition>
std::vector<Row> rows_where(const std::vector<Row>& rows, Condition condition) {
  std::vector<Row> chosen;
  for (const Row& row : rows) {
    if (std::invoke(condition, row)) chosen.push_back(row);
  }
  return chosen;
}

/// "-" where there is no finite number.
template <class Value>
std::string cell_text(const std::string& format, const Value& value) {
  if constexpr (std::is_floating_point_v<Value>) {
    if (!std::isfinite(value)) return "-";
  }
  return fmt::format(fmt::runtime(format), value);
}
template <class Value>
std::string cell_text(const std::string& format, const std::optional<Value>& value) {
  return value ? cell_text(format, *value) : "-";
}

/// The value where it means something, a cell with "-" elsewhere.
template <class Value>
std::optional<Value> when(bool is_there, const Value& value) {
  return is_there ? std::optional<Value>(value) : std::nullopt;
}

/// A column of a table of rows: header, unit, format of fmt, and what it shows, a member or a function of the row.
template <class Row>
struct Column {
  std::string header;
  bool is_text = false;
  std::function<std::string(const Row&)> cell;

  /// Text. @param get  of the row, a string
  template <class Get>
  Column(std::string header_text, Get get)
      : header(std::move(header_text)),
        is_text(true),
        cell([get](const Row& row) -> std::string { return std::invoke(get, row); }) {}
  /// Numbers. @param unit  empty for none  @param get  of the row, what the format prints, or an optional of that
  template <class Get>
  Column(const std::string& name, const std::string& unit, std::string format, Get get)
      : header(unit.empty() ? name : name + " [" + unit + "]"),
        cell([format = std::move(format), get](const Row& row) { return cell_text(format, std::invoke(get, row)); }) {}
};

/// The table with a line per row.
template <class Row>
Table table_of(std::string title, const std::vector<Column<Row>>& columns, const std::vector<Row>& rows,
               std::string note = "") {
  Table table{.title = std::move(title), .note = std::move(note), .columns = {}, .rows = {}};
  for (const auto& column : columns) table.columns.push_back({column.header, column.is_text});
  for (const auto& row : rows) {
    auto& line = table.rows.emplace_back();
    for (const auto& column : columns) line.push_back(column.cell(row));
  }
  return table;
}

/// Leaves out those columns, by their headers, of which every cell is "-", as of times where none were measured.
Table without_empty(Table table, const std::vector<std::string>& headers);

/// Text of a cell: "1.2e-05"; "-" for a number that is not finite.
std::string scientific(double x, int digits = 1);

/// In quotes where it needs them.
std::string csv_cell(const std::string& text);

}  // namespace ricochet
