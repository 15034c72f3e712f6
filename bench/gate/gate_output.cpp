#include "bench/gate/gate_output.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "reports/markup.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr std::size_t kMostInSummary = 200;
constexpr std::size_t kMostAnnotations = 10;

std::string findings_of(const GateLine& line) {
  return fmt::format("{}", fmt::join(line.findings, "; "));
}

bool blocks(const GateLine& line) {
  return line.verdict == GateVerdict::worse || line.verdict == GateVerdict::not_compared;
}

bool hold_all(const std::vector<GateReport>& reports) {
  return std::ranges::all_of(reports, &GateReport::holds);
}

std::string counts_of(const GateReport& report) {
  return fmt::format("{} lines compared with {}: {} regressions, {} not compared, {} improvements", report.compared(),
                     report.baseline, report.count(GateVerdict::worse), report.count(GateVerdict::not_compared),
                     report.count(GateVerdict::better));
}

/// @param is_property  of a workflow command, where ":" and "," have a meaning as well
std::string escape_command(const std::string& text, bool is_property) {
  std::string escaped;
  for (const char c : text) {
    if (c == '%' || c == '\r' || c == '\n' || (is_property && (c == ':' || c == ',')))
      escaped += fmt::format("%{:02X}", static_cast<int>(c));
    else
      escaped += c;
  }
  return escaped;
}

void add_rows(const std::vector<const GateLine*>& lines, std::string& text) {
  text += "\n| run | verdict | finding |\n|:--|:--|:--|\n";
  for (std::size_t k = 0; k < std::min(lines.size(), kMostInSummary); ++k)
    text += fmt::format("| {} | {} | {} |\n", escape_markdown(lines[k]->name()), to_string(lines[k]->verdict),
                        escape_markdown(findings_of(*lines[k])));
  if (lines.size() > kMostInSummary) text += fmt::format("\n{} more.\n", lines.size() - kMostInSummary);
}

struct Annotation {
  std::string file;
  int line;
  std::string title, text;
};

void add_annotations(const char* command, const std::vector<Annotation>& list, std::string& text) {
  for (std::size_t k = 0; k < list.size(); ++k) {
    const Annotation& a = list[k];
    const bool is_last_shown = k + 1 == kMostAnnotations && list.size() > kMostAnnotations;
    if (is_last_shown) {
      text += fmt::format("::{} title=ricochet check::and {} more, see the summary\n", command, list.size() - k);
      return;
    }
    text += fmt::format("::{} file={},{}title={}::{}\n", command, escape_command(a.file, true),
                        a.line > 0 ? fmt::format("line={},", a.line) : "", escape_command(a.title, true),
                        escape_command(a.text, false));
  }
}

}  // namespace

std::string gate_text(const GateReport& report) {
  std::string text;
  for (const GateVerdict verdict : {GateVerdict::better, GateVerdict::not_compared, GateVerdict::worse}) {
    const char* word = verdict == GateVerdict::worse    ? "regression:   "
                       : verdict == GateVerdict::better ? "better:       "
                                                        : "not compared: ";
    for (const GateLine& line : report.lines) {
      if (line.verdict == verdict) text += fmt::format("{}{}: {}\n", word, line.name(), findings_of(line));
    }
  }
  return text + counts_of(report) + "\n";
}

json gate_json(const std::vector<GateReport>& reports) {
  json experiments = json::array();
  for (const GateReport& report : reports) {
    json lines = json::array();
    for (const GateLine& line : report.lines)
      lines.push_back({{"method", line.method},
                       {"what", line.what},
                       {"setting", line.setting},
                       {"verdict", to_string(line.verdict)},
                       {"findings", line.findings},
                       {"line", line.line}});
    experiments.push_back({{"experiment", report.experiment},
                           {"results", report.results},
                           {"baseline", report.baseline},
                           {"holds", report.holds()},
                           {"compared", report.compared()},
                           {"worse", report.count(GateVerdict::worse)},
                           {"not_compared", report.count(GateVerdict::not_compared)},
                           {"better", report.count(GateVerdict::better)},
                           {"lines", lines}});
  }
  return {{"holds", hold_all(reports)}, {"experiments", experiments}};
}

std::string gate_junit(const std::vector<GateReport>& reports) {
  std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"ricochet check\">\n";
  for (const GateReport& report : reports) {
    xml += fmt::format("  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"0\">\n",
                       escape_xml(report.experiment), report.lines.size(), report.count(GateVerdict::worse),
                       report.count(GateVerdict::not_compared));
    for (const GateLine& line : report.lines) {
      const std::string findings = escape_xml(findings_of(line));
      xml += fmt::format("    <testcase classname=\"{}\" name=\"{}\" time=\"0\"", escape_xml(report.experiment),
                         escape_xml(line.name()));
      switch (line.verdict) {
        case GateVerdict::same:
          xml += "/>\n";
          break;
        case GateVerdict::better:
          xml += fmt::format("><system-out>{}</system-out></testcase>\n", findings);
          break;
        case GateVerdict::worse:
          xml += fmt::format("><failure type=\"regression\" message=\"{}\"/></testcase>\n", findings);
          break;
        case GateVerdict::not_compared:
          xml += fmt::format("><error type=\"not compared\" message=\"{}\"/></testcase>\n", findings);
          break;
      }
    }
    xml += "  </testsuite>\n";
  }
  return xml + "</testsuites>\n";
}

std::string gate_markdown(const std::vector<GateReport>& reports) {
  std::string text;
  for (const GateReport& report : reports) {
    text += fmt::format("### {}: {}\n\n{}\n", escape_markdown(report.experiment),
                        report.holds() ? "holds" : "does not hold", escape_markdown(counts_of(report)));
    std::vector<const GateLine*> blocking, better;
    for (const GateLine& line : report.lines) {
      if (blocks(line)) blocking.push_back(&line);
      if (line.verdict == GateVerdict::better) better.push_back(&line);
    }
    if (!blocking.empty()) add_rows(blocking, text);
    if (!better.empty()) {
      text += fmt::format("\n<details><summary>{} better</summary>\n", better.size());
      add_rows(better, text);
      text += "\n</details>\n";
    }
    text += "\n";
  }
  return text;
}

std::string gate_annotations(const std::vector<GateReport>& reports) {
  std::vector<Annotation> errors, notices;
  for (const GateReport& report : reports) {
    for (const GateLine& line : report.lines) {
      if (line.verdict == GateVerdict::same) continue;
      auto& list = blocks(line) ? errors : notices;
      list.push_back({report.baseline, line.line, fmt::format("{}: {}", report.experiment, to_string(line.verdict)),
                      fmt::format("{}: {}", line.name(), findings_of(line))});
    }
    if (report.compared() == 0)
      errors.push_back({report.baseline, 0, report.experiment + ": not compared", "nothing was compared"});
  }
  std::string text;
  add_annotations("error", errors, text);
  add_annotations("notice", notices, text);
  return text;
}

}  // namespace ricochet
