#include "problems/control/controls_csv.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <sstream>
#include <string_view>
#include <vector>

#include "problems/input_error.h"
#include "problems/input_text.h"

namespace ricochet {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (;;) {
    const auto comma = line.find(',');
    cells.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

double number_of(std::string_view cell, const std::string& place) {
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value))
    throw InputError(place, std::string(cell), "a finite number is required");
  return value;
}

}  // namespace

std::string controls_csv(const Matrix& u, double H) {
  std::string text = "t";
  for (Eigen::Index c = 0; c < u.rows(); ++c) text += fmt::format(",u[{}]", c);
  for (Eigen::Index k = 0; k < u.cols(); ++k) {
    text += fmt::format("\n{}", static_cast<double>(k) * H);
    for (const double value : u.col(k)) text += fmt::format(",{}", value);
  }
  return text + "\n";
}

Matrix read_controls(const std::string& path, int n_u) {
  std::istringstream lines(read_input_text(path, "table of controls"));
  std::vector<double> values;
  bool has_names = false, has_time = false;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (trimmed(line).empty() || trimmed(line).front() == '#') continue;
    auto cells = cells_of(line);
    const std::string place = fmt::format("{}, line {}", path, number);
    if (!has_names) has_time = cells.front() == "t";
    if (has_time) cells.erase(cells.begin());
    if (cells.size() != static_cast<std::size_t>(n_u))
      throw InputError(place, fmt::format("{} columns beside t", cells.size()),
                       fmt::format("one for each of {} controls is required", n_u));
    if (has_names) {
      for (const std::string_view cell : cells) values.push_back(number_of(cell, place));
    }
    has_names = true;
  }
  if (values.empty())
    throw InputError(path, "no rows", "a line of names and a row of numbers per interval are required");
  return Eigen::Map<const Matrix>(values.data(), n_u, static_cast<Eigen::Index>(values.size()) / n_u);
}

}  // namespace ricochet
