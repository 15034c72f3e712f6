#include "reports/latex_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace ricochet {
namespace {

bool is_empty(const std::string& cell) {
  return cell.empty() || cell == "-";
}

/// Few rows have one: such a column is almost empty, and its texts are long.
bool holds_remarks(const Table& table, std::size_t column) {
  constexpr std::size_t kShort = 24;  // letters
  std::size_t empty = 0, longest = 0;
  for (const auto& row : table.rows) {
    empty += is_empty(row[column]);
    longest = std::max(longest, row[column].size());
  }
  return column > 0 && table.columns[column].is_text && 2 * empty > table.rows.size() && longest > kShort;
}

/// "a", "b", ..., "z", "aa"
std::string mark_of(std::size_t k) {
  return (k < 26 ? "" : mark_of(k / 26 - 1)) + static_cast<char>('a' + k % 26);
}

/// Below the table, each once, with a mark on the first cell of their rows.
void add_remarks(const Table& table, std::size_t column, LatexContent& content, std::vector<std::string>& remarks) {
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    const std::string& remark = table.rows[r][column];
    if (is_empty(remark)) continue;
    const std::string text = table.columns[column].header + ": " + remark;
    const auto known = std::ranges::find(remarks, text);
    const std::string mark =
        fmt::format("\\textsuperscript{{{}}}", mark_of(static_cast<std::size_t>(known - remarks.begin())));
    if (known == remarks.end()) {
      remarks.push_back(text);
      content.note(mark + "\\,", text);
    }
    LatexCell& first = content.columns.front().cells[r];
    first.tex += mark;
    first.width += 5;
    first.word += 5;
  }
}

constexpr LatexType kNinePoints = {9, 10.8, .93}, kSevenPoints = {7, 8.4, .81};

constexpr double kAny = 1e9;
constexpr std::array<LatexAttempt, 11> kAttempts = {{{false, kTenPoints, kLatexGap, LatexWraps::nothing, 1},
                                                     {false, kTenPoints, 4, LatexWraps::headers, 1},
                                                     {false, kNinePoints, 4, LatexWraps::headers, 1},
                                                     {false, kNinePoints, 4, LatexWraps::text, 1.6},
                                                     {false, kEightPoints, 3, LatexWraps::headers, 1},
                                                     {false, kEightPoints, 3, LatexWraps::text, 3},
                                                     {true, kNinePoints, 4, LatexWraps::headers, 1},
                                                     {true, kNinePoints, 4, LatexWraps::text, 1.6},
                                                     {true, kEightPoints, 3, LatexWraps::headers, 1},
                                                     {true, kEightPoints, 3, LatexWraps::text, kAny},
                                                     {true, kSevenPoints, 2.5, LatexWraps::text, kAny}}};

double lines_of(double text, double width) {
  constexpr double kRagged = 1.12;  // lines end before the margin
  return text <= width ? 1 : std::ceil(kRagged * text / width);
}

class Fit {
 public:
  Fit(const LatexContent& content, const LatexAttempt& attempt, double width) : content_(content), attempt_(attempt) {
    room_ = width - 2 * attempt.gap * (static_cast<double>(content.columns.size()) - 1);
  }

  std::optional<LatexLayout> layout() {
    LatexLayout layout{.attempt = attempt_, .widths = {}, .lines = static_cast<double>(content_.rows)};
    if (attempt_.wraps == LatexWraps::nothing) {
      double sum = 0;
      for (const auto& column : content_.columns) sum += std::max(column.widest(), column.header.width);
      return sum <= room_ ? std::optional(layout) : std::nullopt;
    }
    for (const auto& column : content_.columns) {
      const double least = attempt_.wraps == LatexWraps::text ? column.longest_word() : column.widest();
      widths_.push_back(kSlack + attempt_.type.factor * std::max(least, column.header.word));
    }
    if (left() < 0) return std::nullopt;
    if (attempt_.wraps == LatexWraps::text) widen_text();
    widen_headers();
    layout.widths = widths_;
    layout.lines = lines();
    const bool holds = layout.lines <= attempt_.most_lines * static_cast<double>(content_.rows) || has_wide_sentences();
    return holds ? std::optional(layout) : std::nullopt;
  }

 private:
  static constexpr double kSlack = 2;       // [pt] for what the widths of letters do not say
  static constexpr double kSentence = 300;  // [pt] from which on a cell is one
  static constexpr double kReadable = 150;  // [pt] that a column of them needs

  double left() const { return room_ - std::accumulate(widths_.begin(), widths_.end(), 0.0); }
  double scaled(double width) const { return attempt_.type.factor * width; }

  /// Room goes where a column is most often too narrow for its cells.
  void widen_text() {
    constexpr double kStep = 3;  // [pt]
    while (left() >= kStep) {
      std::size_t best = 0;
      double most = 0;
      for (std::size_t c = 0; c < widths_.size(); ++c) {
        double needs = 0;
        for (const LatexCell& cell : content_.columns[c].cells)
          needs += std::max(0.0, scaled(cell.width) + kSlack - widths_[c]) / widths_[c];
        if (needs > most) {
          most = needs;
          best = c;
        }
      }
      if (most == 0) return;
      widths_[best] += kStep;
    }
  }
  /// What is left goes to headers that wrap, those that lack least first.
  void widen_headers() {
    std::vector<std::pair<double, std::size_t>> lacks;
    for (std::size_t c = 0; c < widths_.size(); ++c) {
      const double lack = scaled(content_.columns[c].header.width) + kSlack - widths_[c];
      if (lack > 0) lacks.emplace_back(lack, c);
    }
    std::ranges::sort(lacks);
    for (const auto& [lack, c] : lacks) {
      if (lack > left()) return;
      widths_[c] += lack;
    }
  }
  double lines() const {
    double sum = 0;
    for (std::size_t r = 0; r < content_.rows; ++r) {
      double most = 1;
      for (std::size_t c = 0; c < widths_.size(); ++c)
        most = std::max(most, lines_of(scaled(content_.columns[c].cells[r].width), widths_[c]));
      sum += most;
    }
    return sum;
  }
  /// Sentences take many lines anyway, where they have a column that can be read.
  bool has_wide_sentences() const {
    bool has = false;
    for (std::size_t c = 0; c < widths_.size(); ++c) {
      if (content_.columns[c].widest() < kSentence) continue;
      if (widths_[c] < kReadable) return false;
      has = true;
    }
    return has;
  }

  const LatexContent& content_;
  LatexAttempt attempt_;
  double room_;
  std::vector<double> widths_;
};

}  // namespace

LatexContent latex_content(const Table& table) {
  constexpr std::size_t kThroughout = 4;  // rows from which on one value is worth a line below the table
  LatexContent content;
  content.rows = table.rows.size();
  if (!table.note.empty()) content.note("", table.note);
  std::vector<std::size_t> remarks;
  std::string throughout;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const auto& [header, is_text] = table.columns[c];
    const auto has = [&](const auto& holds) {
      return c > 0 && std::ranges::all_of(table.rows, [&](const auto& row) { return holds(row[c]); });
    };
    if (has(is_empty) && content.rows > 0) continue;
    if (content.rows >= kThroughout && !is_text && has([&](const auto& cell) { return cell == table.rows[0][c]; })) {
      throughout += (throughout.empty() ? "" : "; ") + header + ": " + table.rows[0][c] + " throughout";
      continue;
    }
    if (holds_remarks(table, c)) {
      remarks.push_back(c);
      continue;
    }
    auto& column = content.columns.emplace_back(
        LatexContent::Column{.is_text = is_text, .header = latex_cell(header), .cells = {}});
    const bool is_interval = header.find("interval") != std::string::npos;
    for (const auto& row : table.rows) column.cells.push_back(latex_cell(row[c], is_interval));
  }
  if (!throughout.empty()) content.note("", throughout + ".");
  std::vector<std::string> texts;
  for (const std::size_t c : remarks) add_remarks(table, c, content, texts);
  return content;
}

std::optional<LatexLayout> latex_layout(const LatexContent& content, const LatexPage& page) {
  for (const LatexAttempt& attempt : kAttempts) {
    if (auto layout = Fit(content, attempt, attempt.is_turned ? page.height : page.width).layout()) return layout;
  }
  return std::nullopt;
}

}  // namespace ricochet
