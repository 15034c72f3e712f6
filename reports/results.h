#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "problems/input_error.h"

namespace ricochet {

constexpr int kResultsSchema = 1;

/// A line of a results file. JSON has neither NaN nor infinity; the library writes null for them, and null is read as
/// NaN here and nowhere else. @throws InputError
nlohmann::json parse_line(const std::string& text);

/// A row as a line of a results file. A row is a struct with a JSON conversion (NLOHMANN_DEFINE_TYPE_*_WITH_DEFAULT, so
/// that files from before a field was there can be read) and with the name of its kind as Row::kKind.
template <class Row>
nlohmann::json line_of(const Row& row) {
  nlohmann::json line = row;
  line["kind"] = Row::kKind;
  return line;
}

/// State of the machine while times were measured, from "times" in the header of results; ordered by reliability.
enum class TimesMark {
  shared,       ///< other programs ran on the machine
  unspecified,  ///< not stated
  exclusive     ///< no other program ran
};

std::string to_string(TimesMark mark);             ///< "shared", "exclusive", or nothing
TimesMark times_mark_of(const std::string& word);  ///< unspecified for another word
TimesMark times_mark(const nlohmann::json& header);
void set_times_mark(nlohmann::json& header, TimesMark mark);

/// Integers of `example` are integers in `row`, where it has them: the library would turn 1e120, or NaN, into an int,
/// which has no meaning. @throws InputError with the field
void require_integers(const nlohmann::json& example, const nlohmann::json& row);

/// A results file: what was run, where, and the rows of the study that wrote it.
struct Results {
  std::string path;
  nlohmann::json header;
  std::vector<nlohmann::json> rows;  ///< each with its "kind"
  bool is_complete = false;

  std::string experiment() const { return header.value("experiment", ""); }
  std::string title() const { return header.value("title", experiment()); }

  /// The rows of one kind, in the order of the file. @throws InputError for one that is damaged
  template <class Row>
  std::vector<Row> all() const {
    std::vector<Row> list;
    const nlohmann::json example = Row();
    for (std::size_t k = 0; k < rows.size(); ++k) {
      if (rows[k].at("kind") != Row::kKind) continue;
      try {
        require_integers(example, rows[k]);
        list.push_back(rows[k].get<Row>());
      } catch (const std::exception& error) {
        throw InputError(fmt::format("{}: row {}: not a {}: {}", path, k + 1, Row::kKind, error.what()));
      }
    }
    return list;
  }
};

/// Warnings that precede the numbers, one sentence each: an interrupted run, times measured beside other work or on
/// different processors. Every output of results shows them.
std::vector<std::string> warnings(const Results& results);

/// The header of a results file, complete or not; an empty object of a file that is not there, or has none.
nlohmann::json read_header(const std::string& path);

/// Reads a results file (JSON lines: header, rows, end).
/// @throws InputError when it cannot be read, is damaged, or has another schema
Results read_results(const std::string& path);
/// Reads a results file from its text. @param path  for messages
Results parse_results(const std::string& path, const std::string& text);

}  // namespace ricochet
