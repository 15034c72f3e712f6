#include "reports/site/figure_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>
#include <vector>

#include "reports/table.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// Lines of a data block: its columns, each line with the number of its piece.
struct DataBlock {
  std::vector<std::vector<std::string>> rows;
  std::vector<int> pieces;
  std::size_t n_columns = 0;
};

/// The words of a line; quoted ones may hold spaces.
std::vector<std::string> words_of(const std::string& line) {
  std::vector<std::string> words;
  std::string word;
  char quote = 0;
  for (const char c : line + " ") {
    if (quote ? c == quote : c == '"' || c == '\'') {
      quote = quote ? 0 : c;
    } else if (!quote && (c == ' ' || c == '\t')) {
      if (!word.empty()) words.push_back(std::move(word));
      word.clear();
    } else {
      word += c;
    }
  }
  return words;
}

/// What stands between the quotes behind `keyword`, where a quote is doubled; empty without them.
std::string quoted_behind(const std::string& line, const std::string& keyword) {
  const auto at = line.find(keyword);
  if (at == std::string::npos) return "";
  const auto begin = line.find_first_of("'\"", at + keyword.size());
  if (begin == std::string::npos) return "";
  const char quote = line[begin];
  std::string text;
  for (std::size_t k = begin + 1; k < line.size(); ++k) {
    if (line[k] == quote && (k + 1 == line.size() || line[k + 1] != quote)) break;
    if (line[k] == quote) ++k;
    text += line[k];
  }
  return text;
}

/// "$name" of an item of a plot command; empty for one without a block.
std::string block_name(const std::string& line) {
  const auto at = line.find('$');
  if (at == std::string::npos) return "";
  std::size_t end = at + 1;
  while (end < line.size() && (std::isalnum(static_cast<unsigned char>(line[end])) || line[end] == '_')) ++end;
  return line.substr(at + 1, end - at - 1);
}

/// The style of an item, "with lines lc rgb '#2171b5'": what a key by itself repeats.
std::string item_style(const std::string& line) {
  const auto begin = line.find("with ");
  if (begin == std::string::npos) return "";
  const auto end = std::min(line.find(" title ", begin), line.find(" notitle", begin));
  return line.substr(begin, end == std::string::npos ? end : end - begin);
}

struct Use {
  std::string block, panel, x_label, y_label, curve, style;
};

}  // namespace

std::string gnuplot_csv(const std::string& script) {
  std::map<std::string, DataBlock> blocks;
  std::vector<Use> uses;
  std::map<std::string, std::string> key;  // titles of styles that a key by itself shows
  std::string panel, x_label, y_label, in_block;
  std::istringstream stream(script);
  for (std::string line; std::getline(stream, line);) {
    if (!in_block.empty()) {
      DataBlock& block = blocks[in_block];
      if (line == "EOD") {
        in_block.clear();
      } else if (line.empty()) {
        if (!block.pieces.empty() && block.pieces.back() > 0) block.pieces.back() = -block.pieces.back();  // ends here
      } else {
        const int last = block.pieces.empty() ? 1 : block.pieces.back();
        block.rows.push_back(words_of(line));
        block.n_columns = std::max(block.n_columns, block.rows.back().size());
        block.pieces.push_back(last < 0 ? 1 - last : last);
      }
    } else if (line.starts_with("$") && line.find("<< EOD") != std::string::npos) {
      in_block = block_name(line);
    } else if (line.starts_with("set title")) {
      panel = quoted_behind(line, "set title");
    } else if (line.starts_with("unset title")) {
      panel.clear();
    } else if (line.starts_with("set label 1 ")) {  // columns and rows of panels have labels for all of them
      panel = quoted_behind(line, "set label 1");
    } else if (line.starts_with("set label 2 ")) {
      y_label = quoted_behind(line, "set label 2");
    } else if (line.starts_with("set xlabel")) {
      x_label = quoted_behind(line, "set xlabel");
    } else if (line.starts_with("set ylabel")) {
      y_label = quoted_behind(line, "set ylabel");
    } else if (const std::string name = block_name(line); blocks.contains(name)) {
      uses.push_back({name, panel, x_label, y_label, quoted_behind(line, " title "), item_style(line)});
    } else if (line.find("NaN ") != std::string::npos) {
      key.emplace(item_style(line), quoted_behind(line, " title "));
    }
  }
  std::size_t n_columns = 0;
  for (const auto& [name, block] : blocks) n_columns = std::max(n_columns, block.n_columns);
  if (n_columns == 0) return "";
  std::string csv = "panel,x axis,y axis,curve,piece,x,y";
  for (std::size_t c = 2; c < n_columns; ++c) csv += fmt::format(",column {}", c + 1);
  csv += "\n";
  std::set<std::pair<std::string, std::string>> written;
  for (const Use& use : uses) {
    if (!written.emplace(use.block, use.panel).second) continue;  // drawn twice, as a line and as points
    const auto same_block = [&](const Use& other) { return other.block == use.block && other.panel == use.panel; };
    std::string curve;
    for (const Use& other : uses) {
      if (curve.empty() && same_block(other)) curve = other.curve;
    }
    for (const Use& other : uses) {
      if (curve.empty() && same_block(other) && key.contains(other.style)) curve = key.at(other.style);
    }
    if (curve.empty()) curve = use.block;
    const DataBlock& block = blocks.at(use.block);
    for (std::size_t k = 0; k < block.rows.size(); ++k) {
      csv += fmt::format("{},{},{},{},{}", csv_cell(use.panel), csv_cell(use.x_label), csv_cell(use.y_label),
                         csv_cell(curve), std::abs(block.pieces[k]));
      for (std::size_t c = 0; c < std::max<std::size_t>(n_columns, 2); ++c)
        csv += "," + (c < block.rows[k].size() ? csv_cell(block.rows[k][c]) : "");
      csv += "\n";
    }
  }
  return csv;
}

std::string motion_csv(const json& row) {
  const auto t = row.find("t"), q = row.find("q"), v = row.find("v");
  if (t == row.end() || q == row.end() || v == row.end() || t->empty() || q->size() != t->size() ||
      v->size() != t->size())
    return "";
  std::string csv = "t";
  for (const auto& [name, values] : {std::pair{"q", q}, std::pair{"v", v}}) {
    for (std::size_t k = 0; k < values->front().size(); ++k) csv += fmt::format(",{}[{}]", name, k);
  }
  csv += "\n";
  for (std::size_t k = 0; k < t->size(); ++k) {
    csv += t->at(k).dump();
    for (const auto& values : {q, v}) {
      for (const auto& number : values->at(k)) csv += "," + number.dump();
    }
    csv += "\n";
  }
  return csv;
}

}  // namespace ricochet
