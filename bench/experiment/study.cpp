#include "bench/experiment/study.h"

#include <algorithm>
#include <stdexcept>

#include "problems/input_error.h"
#include "problems/input_text.h"
#include "problems/names.h"

namespace ricochet {
namespace {

std::vector<Study>& registered() {
  static std::vector<Study> list;
  return list;
}

}  // namespace

bool register_study(Study study) {
  if (study.rows.empty()) throw std::logic_error("study " + study.kind + " has no kind of row");
  const auto place = std::ranges::upper_bound(registered(), study.kind, {}, &Study::kind);
  registered().insert(place, std::move(study));
  return true;
}

const std::vector<Study>& studies() {
  return registered();
}

const Study& find_study(const std::string& kind) {
  const auto found = std::ranges::find(registered(), kind, &Study::kind);
  if (found != registered().end()) return *found;
  std::vector<std::string> kinds;
  for (const auto& study : registered()) kinds.push_back(study.kind);
  throw_unknown_name("kind of experiment", kind, kinds);
}

const Study& study_of(const Results& results) {
  if (results.header.contains("study")) return find_study(results.header["study"]);
  for (const auto& study : registered()) {
    const auto is_its = [&](const nlohmann::json& row) {
      return std::ranges::find(study.rows, row.at("kind").get<std::string>()) != study.rows.end();
    };
    if (std::ranges::any_of(results.rows, is_its)) return study;
  }
  return find_study(kDefaultStudy);
}

Results read_any_results(const std::string& path) {
  const std::string text = read_input_text(path, "results file");
  for (const auto& study : registered()) {
    if (!study.read_foreign) continue;
    if (auto results = study.read_foreign(path, text)) return std::move(*results);
  }
  return parse_results(path, text);
}

ShownResults shown_results(const std::string& path) {
  ShownResults shown{read_any_results(path), {}};
  study_of(shown.results).show(shown.results, shown.section);
  return shown;
}

int unexpected_failures(const Results& results) {
  const Study& study = study_of(results);
  return study.unexpected_failures ? study.unexpected_failures(results) : 0;
}

}  // namespace ricochet
