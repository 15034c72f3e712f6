#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <regex>

#include "bench/fuzz/fuzz_scene.h"

namespace ricochet {
namespace {

/// The columns of verdicts.
constexpr std::array kVerdicts = {
    FuzzVerdict::agree,    FuzzVerdict::wrong,     FuzzVerdict::sensitive, FuzzVerdict::open,     FuzzVerdict::outvoted,
    FuzzVerdict::collapse, FuzzVerdict::undecided, FuzzVerdict::declined,  FuzzVerdict::disagree, FuzzVerdict::hangs};

constexpr const char* kTruth = "truth";  // in lists of methods

std::string share(int part, int whole) {
  return part == 0 ? "0" : fmt::format("{} ({:.1f} %)", part, 100.0 * part / whole);
}

/// "fesd:radau-iia:3" of "fesd:radau-iia:3,elements=as_needed".
std::string short_name(const std::string& method) {
  return method.substr(0, method.find(','));
}

/// Names of the methods in the order of their first result.
std::vector<std::string> methods_of(const std::vector<FuzzScene>& scenes) {
  std::vector<std::string> names;
  for (const auto& scene : scenes) {
    for (const auto& result : scene.results) {
      if (std::ranges::find(names, short_name(result.method)) == names.end())
        names.push_back(short_name(result.method));
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
  return nlohmann::json(verdict);
}

bool is_finding(FuzzVerdict verdict) {
  return verdict == FuzzVerdict::wrong || verdict == FuzzVerdict::disagree || verdict == FuzzVerdict::hangs;
}

namespace {

std::string without_numbers_and_names(const std::string& message) {
  static const std::regex name("'[^']*'"), number(R"([-+]?\d+(\.\d+)?(e[-+]?\d+)?)");
  return std::regex_replace(std::regex_replace(message, name, "C"), number, "#");
}

}  // namespace

std::string FuzzTruth::reason_class() const {
  return is_known() || grade.empty() ? ""
                                     : fmt::format("{}: {}", grade, without_numbers_and_names(reason).substr(0, 160));
}

std::string FuzzResult::reason_class() const {
  if (succeeded()) return "";
  if (is_killed_or_crashed()) return status;
  static const std::regex count(R"( \(# \w+\)$)");
  std::string text = std::regex_replace(without_numbers_and_names(message), count, "");
  // Time and step are no part of the reason.
  static const std::regex place(R"(^(from )?(step # of #, from )?t = # s(, with a step of # s)?: )");
  text = std::regex_replace(text, place, "");
  return fmt::format("{}: {}", status, text.substr(0, 160));
}

std::string FuzzResult::command(const std::string& scene_file) const {
  return fmt::format("ricochet run --scene {} --method {} {}", scene_file, method, setting.option());
}

namespace {

/// The scenes of a family, or all.
struct FamilyCount {
  std::string family;
  int scenes = 0;
  std::map<FuzzVerdict, int> verdicts;
  std::map<std::string, int> declines;  ///< by short name of a method
  std::map<std::string, int> grades;    ///< of truths
  double seconds = 0;                   ///< of all proofs

  void add(const FuzzScene& scene) {
    ++scenes;
    ++verdicts[scene.verdict];
    ++grades[scene.truth.grade];
    seconds += scene.truth.seconds;
    for (const auto& result : scene.results) declines[short_name(result.method)] += result.succeeded() ? 0 : 1;
  }
  template <class Map, class Key>
  std::string share_of(const Map& counts, const Key& key) const {
    const auto found = counts.find(key);
    return share(found == counts.end() ? 0 : found->second, scenes);
  }
};

}  // namespace

Table fuzz_table(const std::vector<FuzzScene>& scenes) {
  using F = FamilyCount;
  std::vector<Column<F>> columns = {{"family", &F::family}, {"scenes", "", "{}", &F::scenes}};
  for (const FuzzVerdict verdict : kVerdicts)
    columns.push_back({word_of(verdict), "", "{}", [=](const F& f) { return f.share_of(f.verdicts, verdict); }});
  for (const auto& method : methods_of(scenes))
    columns.push_back({method + " declines", "", "{}", [=](const F& f) { return f.share_of(f.declines, method); }});
  for (const char* grade : {"proven", "assumed"})
    columns.push_back({grade, "", "{}", [=](const F& f) { return f.share_of(f.grades, std::string(grade)); }});
  columns.push_back({"mean time of a proof", "s", "{:.3f}", [](const F& f) { return f.seconds / f.scenes; }});
  std::vector<FamilyCount> counts;
  for (const auto& family : families_of(scenes)) {
    counts.emplace_back().family = family;
    for (const auto& scene : scenes) {
      if (scene.family == family) counts.back().add(scene);
    }
  }
  counts.emplace_back().family = "all";
  for (const auto& scene : scenes) counts.back().add(scene);
  return table_of("Random scenes: what the methods say of each other", columns, counts);
}

Table fuzz_reasons(const std::vector<FuzzScene>& scenes) {
  struct Reason {
    std::string method, text;
    int count = 0;
    std::map<std::string, int> families;
    std::string first;
  };
  std::map<std::pair<std::string, std::string>, Reason> reasons;
  for (const auto& scene : scenes) {
    std::vector<std::pair<std::string, std::string>> declined{{kTruth, scene.truth.reason_class()}};
    for (const auto& result : scene.results) declined.emplace_back(short_name(result.method), result.reason_class());
    for (const auto& [method, text] : declined) {
      if (text.empty()) continue;
      Reason& reason = reasons
                           .try_emplace({method, text},
                                        Reason{method, text, 0, {}, fmt::format("{} {}", scene.family, scene.number)})
                           .first->second;
      ++reason.count;
      ++reason.families[scene.family];
    }
  }
  std::vector<Reason> sorted;
  for (const auto& [key, reason] : reasons) sorted.push_back(reason);
  std::ranges::stable_sort(sorted, [](const Reason& a, const Reason& b) {
    return a.method != b.method ? a.method < b.method : a.count > b.count;
  });
  const auto families_of_reason = [](const Reason& reason) {
    std::vector<std::string> families;
    for (const auto& [family, count] : reason.families) families.push_back(fmt::format("{} {}", family, count));
    return fmt::format("{}", fmt::join(families, ", "));
  };
  const std::vector<Column<Reason>> columns = {
      {"method", &Reason::method}, {"scenes", "", "{}", &Reason::count},
      {"reason", &Reason::text},   {"families", families_of_reason},
      {"first", &Reason::first},
  };
  Table table = table_of("Why methods declined", columns, sorted);
  table.is_list = true;
  return table;
}

Table fuzz_accuracy(const std::vector<FuzzScene>& scenes) {
  struct Accuracy {
    std::string family, method;
    std::vector<double> errors;  ///< in multiples of the tolerance, sorted

    double at_most(double part) const {
      return errors[static_cast<std::size_t>(std::ceil(part * static_cast<double>(errors.size()))) - 1];
    }
  };
  constexpr double kFewTolerances = 100;
  std::vector<Accuracy> rows;
  for (const auto& family : families_of(scenes)) {
    for (const std::size_t i : {0U, 4U}) {  // fesd_adaptive, event_driven
      Accuracy row{family, "", {}};
      for (const auto& scene : scenes) {
        if (scene.family != family || i >= scene.results.size()) continue;
        row.method = short_name(scene.results[i].method);
        if (scene.truth.is_known() && scene.results[i].succeeded()) row.errors.push_back(scene.results[i].tolerances);
      }
      std::ranges::sort(row.errors);
      if (!row.errors.empty()) rows.push_back(row);
    }
  }
  const auto few = [&](const Accuracy& a) {
    const auto within = std::ranges::count_if(a.errors, [&](double error) { return error <= kFewTolerances; });
    return fmt::format("{:.1f} %", 100.0 * static_cast<double>(within) / static_cast<double>(a.errors.size()));
  };
  const std::vector<Column<Accuracy>> columns = {
      {"family", &Accuracy::family},
      {"method", &Accuracy::method},
      {"scenes with a truth", "", "{}", [](const Accuracy& a) { return static_cast<int>(a.errors.size()); }},
      {"median", "", "{:.2g}", [](const Accuracy& a) { return a.at_most(0.5); }},
      {"99 % at most", "", "{:.2g}", [](const Accuracy& a) { return a.at_most(0.99); }},
      {"largest", "", "{:.2g}", [](const Accuracy& a) { return a.errors.back(); }},
      {"up to 100", few},
  };
  return table_of("Error of the final state, in multiples of the tolerance", columns, rows);
}

Table fuzz_findings(const std::vector<FuzzScene>& scenes) {
  using S = FuzzScene;
  static const std::vector<Column<S>> columns = {
      {"scene", [](const S& s) { return fmt::format("{} {} (seed {})", s.family, s.number, s.seed); }},
      {"verdict", [](const S& s) { return word_of(s.verdict); }},
      {"detail", &S::detail},
      {"file", &S::file},
  };
  const auto found = rows_where(scenes, [](const S& s) { return is_finding(s.verdict); });
  return table_of("Scenes on which methods disagree, are wrong or hang", columns, found);
}

}  // namespace ricochet
