#include "bench/site/site_texts.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bench/measure/environment.h"

namespace ricochet {

extern const char* const kSiteTexts;  // JSON, written by collect_texts

namespace {

using nlohmann::json;

const json& texts() {
  static const json all = json::parse(kSiteTexts);
  return all;
}

}  // namespace

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SourceText, file, text)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Source, entry, methods)

std::optional<SourceText> scheme_of(const MethodEntry& method) {
  const std::filesystem::path registered = method.file;
  const std::string file =
      (method.scheme.empty() ? registered : registered.parent_path() / method.scheme).lexically_normal();
  for (const auto& [name, text] : texts().at("schemes").items()) {
    if (file.ends_with("/" + name)) return SourceText{name, text};
  }
  return std::nullopt;
}

std::optional<SourceText> statement_of(const SceneEntry& scene) {
  const json& statements = texts().at("statements");
  const auto found = statements.find(scene.id);
  return found == statements.end() ? std::nullopt : std::optional(found->get<SourceText>());
}

std::vector<std::string> paragraphs_of(const SourceText& statement) {
  std::vector<std::string> paragraphs;
  std::istringstream lines(statement.text);
  bool is_open = false;
  for (std::string line; std::getline(lines, line);) {
    const bool is_prose = !line.empty() && line.front() != ' ';
    if (is_prose && is_open) paragraphs.back() += " " + line;
    if (is_prose && !is_open) paragraphs.push_back(line);
    is_open = is_prose;
  }
  return paragraphs;
}

const std::vector<Source>& sources() {
  static const std::vector<Source> list = texts().at("sources");
  return list;
}

std::string sources_of(const std::string& method) {
  std::string text;
  for (const Source& source : sources()) {
    if (std::ranges::find(source.methods, method) != source.methods.end())
      text += (text.empty() ? "" : "\n") + source.entry;
  }
  return text;
}

std::string program_entry() {
  return texts().at("program").get<std::string>() + fmt::format("  note = {{{}}}\n}}\n", version_text());
}

}  // namespace ricochet
