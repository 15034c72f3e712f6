#include "reports/fuzz_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <regex>

#include "problems/named_values.h"
#include "reports/ending_names.h"

namespace ricochet {
namespace {

using nlohmann::json;

const Names<FuzzVerdict> kVerdicts = {
    {"agree", FuzzVerdict::agree},       {"sensitive", FuzzVerdict::sensitive}, {"open", FuzzVerdict::open},
    {"outvoted", FuzzVerdict::outvoted}, {"collapse", FuzzVerdict::collapse},   {"undecided", FuzzVerdict::undecided},
    {"declined", FuzzVerdict::declined}, {"disagree", FuzzVerdict::disagree},   {"hangs", FuzzVerdict::hangs}};

template <class Value>
const std::string& name_of(const Names<Value>& names, Value value) {
  for (const auto& [name, known] : names) {
    if (known == value) return name;
  }
  static const std::string unknown = "?";
  return unknown;
}

template <class Value>
Value value_of(const Names<Value>& names, const json& j) {
  const std::string text = j;
  return *find(names, text);
}

json to_json(const FuzzOpinion& o) {
  return {{"method", o.method},
          {"steps", o.steps},
          {"tolerance", o.tolerance},
          {"ending", name_of(kEndings, o.ending)},
          {"status", o.status},
          {"message", o.message},
          {"q", o.q},
          {"v", o.v},
          {"error", o.error},
          {"seconds", o.seconds}};
}

FuzzOpinion opinion_from_json(const json& j) {
  FuzzOpinion o;
  j.at("method").get_to(o.method);
  j.at("steps").get_to(o.steps);
  j.at("tolerance").get_to(o.tolerance);
  o.ending = value_of(kEndings, j.at("ending"));
  j.at("status").get_to(o.status);
  j.at("message").get_to(o.message);
  j.at("q").get_to(o.q);
  j.at("v").get_to(o.v);
  j.at("error").get_to(o.error);
  j.at("seconds").get_to(o.seconds);
  return o;
}

std::string share(int part, int whole) {
  return part == 0 ? "0" : fmt::format("{} ({:.1f} %)", part, 100.0 * part / whole);
}

/// "fesd" of "fesd:radau-iia:3,elements=as_needed".
std::string short_name(const std::string& method) {
  return method.substr(0, method.find_first_of(":,"));
}

/// Names of the methods in the order of their first opinion.
std::vector<std::string> methods_of(const std::vector<FuzzScene>& scenes) {
  std::vector<std::string> names;
  for (const auto& scene : scenes) {
    for (const auto& opinion : scene.opinions) {
      if (std::ranges::find(names, short_name(opinion.method)) == names.end())
        names.push_back(short_name(opinion.method));
    }
  }
  return names;
}

std::vector<std::string> families_of(const std::vector<FuzzScene>& scenes) {
  std::vector<std::string> names;
  for (const auto& scene : scenes) {
    if (std::ranges::find(names, scene.family) == names.end()) names.push_back(scene.family);
  }
  return names;
}

}  // namespace

std::string word_of(FuzzVerdict verdict) {
  return name_of(kVerdicts, verdict);
}

std::string FuzzOpinion::reason_class() const {
  if (succeeded()) return "";
  if (ending != Ending::returned && ending != Ending::declined) return name_of(kEndings, ending);
  static const std::regex name("'[^']*'"), number(R"([-+]?\d+(\.\d+)?(e[-+]?\d+)?)"), count(R"( \(# \w+\)$)");
  std::string text = std::regex_replace(message, name, "C");
  text = std::regex_replace(text, number, "#");
  text = std::regex_replace(text, count, "");
  // Where and in which step is no part of why.
  static const std::regex place(R"(^(from )?(step # of #, from )?t = # s(, with a step of # s)?: )");
  text = std::regex_replace(text, place, "");
  return fmt::format("{}: {}", ending == Ending::declined ? "declined" : status, text.substr(0, 160));
}

std::string FuzzOpinion::command(const std::string& scene_file) const {
  return fmt::format("ricochet run --scene {} --method {} {}", scene_file, method,
                     steps > 0 ? fmt::format("--steps {}", steps) : fmt::format("--tolerance {:g}", tolerance));
}

json to_json(const FuzzScene& s) {
  json opinions = json::array();
  for (const auto& opinion : s.opinions) opinions.push_back(to_json(opinion));
  return {{"kind", "fuzz_scene"},          {"family", s.family}, {"seed", s.seed},       {"number", s.number},
          {"verdict", word_of(s.verdict)}, {"detail", s.detail}, {"parties", s.parties}, {"difference", s.difference},
          {"sensitivity", s.sensitivity},  {"file", s.file},     {"opinions", opinions}};
}

FuzzScene fuzz_scene_from_json(const json& j) {
  FuzzScene s;
  j.at("family").get_to(s.family);
  j.at("seed").get_to(s.seed);
  j.at("number").get_to(s.number);
  s.verdict = value_of(kVerdicts, j.at("verdict"));
  j.at("detail").get_to(s.detail);
  j.at("parties").get_to(s.parties);
  j.at("difference").get_to(s.difference);
  j.at("sensitivity").get_to(s.sensitivity);
  j.at("file").get_to(s.file);
  for (const auto& opinion : j.at("opinions")) s.opinions.push_back(opinion_from_json(opinion));
  return s;
}

Table fuzz_table(const std::vector<FuzzScene>& scenes) {
  const std::vector<std::string> methods = methods_of(scenes);
  Table table;
  table.title = "Random scenes: what the methods say of each other";
  table.columns = {{"family", true}, {"scenes"}};
  for (const auto& [name, verdict] : kVerdicts) table.columns.push_back({name});
  for (const auto& method : methods) table.columns.push_back({method + " declines"});
  const auto add_row = [&](const std::string& title, auto belongs) {
    int n = 0;
    std::map<FuzzVerdict, int> verdicts;
    std::map<std::string, int> declines;
    for (const auto& scene : scenes) {
      if (!belongs(scene)) continue;
      ++n;
      ++verdicts[scene.verdict];
      for (const auto& opinion : scene.opinions) declines[short_name(opinion.method)] += opinion.succeeded() ? 0 : 1;
    }
    if (n == 0) return;
    table.rows.push_back({title, fmt::format("{}", n)});
    for (const auto& [name, verdict] : kVerdicts) table.rows.back().push_back(share(verdicts[verdict], n));
    for (const auto& method : methods) table.rows.back().push_back(share(declines[method], n));
  };
  for (const auto& family : families_of(scenes))
    add_row(family, [&](const FuzzScene& scene) { return scene.family == family; });
  add_row("all", [](const FuzzScene&) { return true; });
  return table;
}

Table fuzz_reasons(const std::vector<FuzzScene>& scenes) {
  struct Reason {
    int count = 0;
    std::map<std::string, int> families;
    std::string example;
  };
  std::map<std::pair<std::string, std::string>, Reason> reasons;
  for (const auto& scene : scenes) {
    for (const auto& opinion : scene.opinions) {
      if (opinion.succeeded()) continue;
      Reason& reason = reasons[{short_name(opinion.method), opinion.reason_class()}];
      if (reason.count++ == 0) reason.example = fmt::format("{} {}", scene.family, scene.number);
      ++reason.families[scene.family];
    }
  }
  std::vector<std::pair<std::pair<std::string, std::string>, Reason>> sorted(reasons.begin(), reasons.end());
  std::ranges::stable_sort(sorted, [](const auto& a, const auto& b) {
    return a.first.first != b.first.first ? a.first.first < b.first.first : a.second.count > b.second.count;
  });
  Table table;
  table.title = "Why methods declined";
  table.columns = {{"method", true}, {"scenes"}, {"reason", true}, {"families", true}, {"first", true}};
  for (const auto& [key, reason] : sorted) {
    std::string families;
    for (const auto& [family, count] : reason.families)
      families += fmt::format("{}{} {}", families.empty() ? "" : ", ", family, count);
    table.rows.push_back({key.first, fmt::format("{}", reason.count), key.second, families, reason.example});
  }
  return table;
}

Table fuzz_findings(const std::vector<FuzzScene>& scenes) {
  Table table;
  table.title = "Scenes on which methods disagree or hang";
  table.columns = {{"scene", true}, {"verdict", true}, {"detail", true}, {"file", true}};
  for (const auto& scene : scenes) {
    if (scene.verdict != FuzzVerdict::disagree && scene.verdict != FuzzVerdict::hangs) continue;
    table.rows.push_back({fmt::format("{} {} (seed {})", scene.family, scene.number, scene.seed),
                          word_of(scene.verdict), scene.detail, scene.file});
  }
  return table;
}

}  // namespace ricochet
