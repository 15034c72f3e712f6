#include "bench/studies/hard_cases/verdict_matrix.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "reports/markup.h"

namespace ricochet {
namespace {

// In pixels.
constexpr int kCellWidth = 62, kCellHeight = 19, kLetterWidth = 7, kGroupSpace = 10, kLegendLine = 22;
constexpr double kSlope = 0.7071;  // of the case names, turned by 45 degrees

struct Colour {
  const char *fill, *ink;
};

/// From Okabe and Ito's palette, which has no red against green; light tints where the ink is dark.
Colour colour_of(CaseVerdict verdict) {
  switch (verdict) {
    case CaseVerdict::exact:
      return {"#0072b2", "#ffffff"};
    case CaseVerdict::accurate:
    case CaseVerdict::keeps:
      return {"#9ad0f0", "#000000"};
    case CaseVerdict::refuses:
    case CaseVerdict::resolves:
      return {"#b3e2d4", "#000000"};
    case CaseVerdict::declined:
      return {"#f2f2f2", "#777777"};
    case CaseVerdict::inaccurate:
      return {"#f7eea0", "#000000"};
    case CaseVerdict::violates_energy:
    case CaseVerdict::penetrates:
    case CaseVerdict::changes_momentum:
    case CaseVerdict::leaves_cone:
      return {"#e69f00", "#000000"};
    case CaseVerdict::fails:
    case CaseVerdict::time_limit:
      return {"#d9b8cc", "#000000"};
    case CaseVerdict::wrong:
      return {"#d55e00", "#ffffff"};
    case CaseVerdict::not_finite:
    case CaseVerdict::killed:
    case CaseVerdict::crashed:
      return {"#000000", "#ffffff"};
  }
  return {"#ffffff", "#000000"};
}

std::string box(int x, int y, CaseVerdict verdict, const std::string& title) {
  const auto [fill, ink] = colour_of(verdict);
  return fmt::format(
      "<g><title>{}</title><rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\"/>"
      "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" fill=\"{}\">{}</text></g>\n",
      escape_html(title), x, y, kCellWidth - 2, kCellHeight - 2, fill, x + kCellWidth / 2 - 1, y + kCellHeight - 6, ink,
      text_of(verdict).word);
}

}  // namespace

std::string verdict_matrix_svg(const std::vector<HardCell>& cells) {
  const HardMatrix matrix(cells);
  std::size_t longest_method = 0, longest_case = 0;
  for (const auto& method : matrix.methods()) longest_method = std::max(longest_method, method.size());
  for (const auto& hard_case : matrix.cases()) longest_case = std::max(longest_case, hard_case.id.size());
  const int left = 12 + kLetterWidth * static_cast<int>(longest_method);
  const int names = static_cast<int>(kSlope * kLetterWidth * static_cast<double>(longest_case));
  const int top = 24 + names;

  std::string body;
  int x = left;
  std::vector<int> at;
  for (std::size_t c = 0; c < matrix.cases().size(); ++c) {
    const auto& [id, title, group] = matrix.cases()[c];
    if (c > 0 && matrix.cases()[c - 1].group != group) x += kGroupSpace;
    at.push_back(x);
    body += fmt::format("<text transform=\"translate({},{}) rotate(-45)\"><title>{}</title>{}</text>\n",
                        x + kCellWidth / 2, top - 6, escape_html(title), escape_html(id));
    x += kCellWidth;
  }
  int y = top;
  std::set<CaseVerdict> used;
  for (std::size_t m = 0; m < matrix.methods().size(); ++m, y += kCellHeight) {
    body += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>\n", left - 8, y + kCellHeight - 6,
                        escape_html(matrix.methods()[m]));
    for (std::size_t c = 0; c < at.size(); ++c) {
      const HardCell* cell = matrix.cell(m, c);
      if (!cell) continue;
      const CaseVerdict verdict = cell->verdict();
      used.insert(verdict);
      body += box(at[c], y, verdict,
                  fmt::format("{} on {}, {}: {}\n{}", cell->method, cell->scene, cell->setting.text(),
                              decisive_number(verdict, *cell), cell->command()));
    }
  }
  y += kLegendLine;
  int right = x + names;
  for (const CaseVerdict verdict : used) {
    const std::string meaning = text_of(verdict).meaning;
    body += box(left, y, verdict, meaning);
    body += fmt::format("<text x=\"{}\" y=\"{}\">{}</text>\n", left + kCellWidth + 6, y + kCellHeight - 6,
                        escape_html(meaning));
    right = std::max(right, left + kCellWidth + 6 + kLetterWidth * static_cast<int>(meaning.size()));
    y += kLegendLine;
  }
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"Helvetica, Arial, sans-serif\" "
      "font-size=\"12\" fill=\"#222222\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{}</svg>\n",
      right + 12, y + 8, body);
}

Figure draw_verdict_matrix(const FigureFolder& folder, const std::vector<HardCell>& cells, const std::string& name) {
  const std::string file = name + ".svg";
  folder.write(file, verdict_matrix_svg(cells));
  return {file, "Verdicts on the hard cases",
          "Methods by cases. The colour and the word say the same; the number behind a verdict, and the command that "
          "repeats the run, appear where the pointer rests."};
}

Section::Chart verdict_matrix_chart(const std::vector<HardCell>& cells, const std::string& experiment) {
  using nlohmann::json;
  const HardMatrix matrix(cells);
  json cases = json::array(), rows = json::array();
  std::map<std::string, std::string> meanings;
  for (const auto& [id, title, group] : matrix.cases())
    cases.push_back({{"id", id}, {"title", title}, {"group", group}});
  for (std::size_t m = 0; m < matrix.methods().size(); ++m) {
    json row = json::array();
    for (std::size_t c = 0; c < matrix.cases().size(); ++c) {
      const HardCell* cell = matrix.cell(m, c);
      if (!cell) {
        row.push_back(nullptr);
        continue;
      }
      const VerdictText& text = text_of(cell->verdict());
      meanings.emplace(text.word, text.meaning);
      row.push_back({{"verdict", text.word},
                     {"grade", text.grade},
                     {"number", decisive_number(cell->verdict(), *cell)},
                     {"setting", cell->setting.text()},
                     {"row", cell->row_id(experiment)},
                     {"command", cell->command()}});
    }
    rows.push_back({{"method", matrix.methods()[m]}, {"cells", row}});
  }
  return {.kind = "verdicts",
          .name = "matrix",
          .table = "cells",
          .title = "Verdicts on the hard cases",
          .caption = "Verdicts of all methods on all cases.",
          .data = {{"cases", cases}, {"methods", rows}, {"meanings", meanings}},
          .still = {[=](const FigureFolder& folder) {
                      return std::vector{draw_verdict_matrix(folder, cells, experiment + "_matrix")};
                    },
                    false}};
}

}  // namespace ricochet
