#include "bench/studies/verify/scorecard.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

#include "bench/experiment/selection.h"
#include "reports/markup.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// "pass", "FAIL", "known", "-"
const char* word_of(const Scorecard& card, const CheckRow& row) {
  switch (row.verdict) {
    case CheckVerdict::pass:
      return "pass";
    case CheckVerdict::fail:
      return card.is_known(row) ? "known" : "FAIL";
    case CheckVerdict::not_applicable:
      return "-";
  }
  return "";
}

std::string counts_of(const Scorecard& card) {
  std::string text = fmt::format("{} passed, {} failed", card.count(CheckVerdict::pass),
                                 card.count(CheckVerdict::fail) - card.known_failures());
  if (card.known_failures() > 0) text += fmt::format(", {} known to fail", card.known_failures());
  return text + fmt::format(", {} not applicable", card.count(CheckVerdict::not_applicable));
}

/// Pixels of a text of Verdana at 11 px, near enough for a badge.
double width_of(const std::string& text) {
  return 6.6 * static_cast<double>(text.size()) + 10;
}

}  // namespace

int Scorecard::count(CheckVerdict verdict) const {
  return static_cast<int>(std::ranges::count(rows, verdict, &CheckRow::verdict));
}

bool Scorecard::is_known(const CheckRow& row) const {
  return std::ranges::any_of(known, [&](const std::string& pattern) { return matches(row.name(), pattern); });
}

int Scorecard::known_failures() const {
  return static_cast<int>(std::ranges::count_if(
      rows, [&](const CheckRow& row) { return row.verdict == CheckVerdict::fail && is_known(row); }));
}

bool Scorecard::holds() const {
  return count(CheckVerdict::fail) == known_failures() && count(CheckVerdict::pass) > 0;
}

std::vector<std::string> Scorecard::mended() const {
  std::vector<std::string> list;
  for (const auto& pattern : known) {
    const bool fails = std::ranges::any_of(
        rows, [&](const CheckRow& row) { return row.verdict == CheckVerdict::fail && matches(row.name(), pattern); });
    if (!fails) list.push_back(pattern);
  }
  return list;
}

double Scorecard::seconds() const {
  return std::accumulate(rows.begin(), rows.end(), 0.0,
                         [](double sum, const CheckRow& row) { return sum + row.seconds; });
}

std::string scorecard_text(const Scorecard& card) {
  std::size_t width = 0;
  for (const auto& row : card.rows) width = std::max(width, row.check.size());
  std::string text, group;
  for (const auto& row : card.rows) {
    if (row.group != group) text += fmt::format("\n{}\n", group = row.group);
    text += fmt::format("  {:<5}  {:<{}}  {}\n", word_of(card, row), row.check, width, row.reason);
    if (row.verdict == CheckVerdict::fail && !row.command.empty())
      text += fmt::format("  {:<5}  {:<{}}  {}\n", "", "", width, row.command);
  }
  for (const auto& pattern : card.mended()) text += fmt::format("\n--known '{}': none of these fails\n", pattern);
  return text + fmt::format("\n{}: {}; {:.1f} s\n", card.method, counts_of(card), card.seconds());
}

json scorecard_json(const Scorecard& card) {
  json checks = json::array();
  for (const auto& row : card.rows) {
    json check = row;
    check.erase("method");
    check["known"] = row.verdict == CheckVerdict::fail && card.is_known(row);
    checks.push_back(std::move(check));
  }
  return {{"schema", "ricochet-scorecard-1"},
          {"method", card.method},
          {"holds", card.holds()},
          {"passed", card.count(CheckVerdict::pass)},
          {"failed", card.count(CheckVerdict::fail) - card.known_failures()},
          {"known", card.known_failures()},
          {"not_applicable", card.count(CheckVerdict::not_applicable)},
          {"mended", card.mended()},
          {"checks", checks}};
}

std::string scorecard_junit(const Scorecard& card) {
  const int failed = card.count(CheckVerdict::fail) - card.known_failures();
  const int skipped = card.count(CheckVerdict::not_applicable) + card.known_failures();
  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n";
  text += fmt::format(
      "  <testsuite name=\"ricochet verify {}\" tests=\"{}\" failures=\"{}\" skipped=\"{}\" time=\"{:.3f}\">\n",
      escape_xml(card.method), card.rows.size(), failed, skipped, card.seconds());
  for (const auto& row : card.rows) {
    text += fmt::format("    <testcase classname=\"{}\" name=\"{}\" time=\"{:.3f}\"", escape_xml(row.group),
                        escape_xml(row.check), row.seconds);
    if (row.verdict == CheckVerdict::pass) {
      text += "/>\n";
      continue;
    }
    const bool fails = row.verdict == CheckVerdict::fail && !card.is_known(row);
    const std::string reason = (row.verdict == CheckVerdict::fail && !fails ? "known: " : "") + row.reason;
    text += fmt::format(">\n      <{} message=\"{}\">{}</{}>\n    </testcase>\n", fails ? "failure" : "skipped",
                        escape_xml(reason), escape_xml(row.command), fails ? "failure" : "skipped");
  }
  return text + "  </testsuite>\n</testsuites>\n";
}

std::string scorecard_markdown(const Scorecard& card) {
  std::string text =
      fmt::format("### {} {}\n\n{}.\n", card.holds() ? "✅" : "❌", escape_markdown(card.method), counts_of(card));
  std::string lines;
  for (const auto& row : card.rows) {
    if (row.verdict == CheckVerdict::fail)
      lines += fmt::format("| {} | {} | {} |\n", escape_markdown(row.name()), word_of(card, row),
                           escape_markdown(row.reason));
  }
  if (!lines.empty()) text += "\n| check | | reason |\n|:--|:--|:--|\n" + lines;
  for (const auto& pattern : card.mended())
    text += fmt::format("\nKnown failure {}: none of these fails.\n", escape_markdown(pattern));
  return text + "\n";
}

std::string scorecard_badge(const Scorecard& card) {
  const int passed = card.count(CheckVerdict::pass), tried = passed + card.count(CheckVerdict::fail);
  const std::string label = "ricochet", value = fmt::format("{} of {}", passed, tried);
  const double left = width_of(label), right = width_of(value);
  const char* color = card.holds() ? "#2a7d2e" : "#b3261e";
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"20\" role=\"img\" aria-label=\"{1}: {2}\">\n"
      "<title>{3}: {4}</title>\n",
      left + right, label, value, escape_xml(card.method), counts_of(card));
  text += fmt::format("<rect width=\"{:.0f}\" height=\"20\" rx=\"3\" fill=\"{}\"/>\n", left + right, color);
  text += fmt::format("<path d=\"M3 0H{0:.0f}V20H3A3 3 0 0 1 0 17V3A3 3 0 0 1 3 0Z\" fill=\"#444\"/>\n", left);
  text += "<g fill=\"#fff\" font-family=\"Verdana,DejaVu Sans,sans-serif\" font-size=\"11\" text-anchor=\"middle\">\n";
  text += fmt::format("<text x=\"{:.1f}\" y=\"14\">{}</text>\n<text x=\"{:.1f}\" y=\"14\">{}</text>\n</g>\n</svg>\n",
                      left / 2, label, left + right / 2, value);
  return text;
}

Table scorecard_table(const std::vector<CheckRow>& rows) {
  Table table{
      .title = "Scorecards",
      .note =
          "Checks passed, of those that apply; -: none applies. `ricochet verify --method METHOD` prints each check "
          "with its reason.",
      .columns = {{"method", true}},
      .rows = {},
      .is_whole = true};
  const auto groups = different(rows, &CheckRow::group);
  for (const auto& group : groups) table.columns.push_back({group});
  table.columns.push_back({"all"});
  table.columns.push_back({"time [s]"});
  for (const auto& method : different(rows, &CheckRow::method)) {
    const auto cell = [&](const auto& fits) -> std::string {
      int passed = 0, applicable = 0;
      for (const auto& row : rows) {
        if (row.method != method || !fits(row) || row.verdict == CheckVerdict::not_applicable) continue;
        ++applicable;
        passed += row.verdict == CheckVerdict::pass ? 1 : 0;
      }
      return applicable == 0 ? "-" : fmt::format("{} of {}", passed, applicable);
    };
    auto& line = table.rows.emplace_back(std::vector<std::string>{method});
    for (const auto& group : groups) line.push_back(cell([&](const CheckRow& row) { return row.group == group; }));
    line.push_back(cell([](const CheckRow&) { return true; }));
    double seconds = 0;
    for (const auto& row : rows) seconds += row.method == method ? row.seconds : 0;
    line.push_back(fmt::format("{:.1f}", seconds));
  }
  return table;
}

Table check_table(const std::vector<CheckRow>& rows, bool only_failures) {
  std::vector<CheckRow> chosen;
  for (const auto& row : rows) {
    if (!only_failures || row.verdict == CheckVerdict::fail) chosen.push_back(row);
  }
  return table_of<CheckRow>(only_failures ? "Checks that fail" : "All checks",
                            {{"method", &CheckRow::method},
                             {"check", &CheckRow::name},
                             {"verdict", [](const CheckRow& row) { return to_string(row.verdict); }},
                             {"reason", &CheckRow::reason},
                             {"command", &CheckRow::command}},
                            chosen);
}

}  // namespace ricochet
