#include "bench/site/scheme.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <sstream>
#include <vector>

#include "bench/data_folder.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// A line of a comment without its mark; empty optional for another line.
std::optional<std::string> comment_line(const std::string& line, const std::string& mark) {
  if (!line.starts_with(mark)) return std::nullopt;
  const std::string rest = line.substr(mark.size());
  return rest.starts_with(" ") ? rest.substr(1) : rest;
}

std::string head_comment(const std::vector<std::string>& lines) {
  std::string text;
  for (const auto& line : lines) {
    const auto comment = comment_line(line, "//");
    if (!comment) break;
    text += *comment + "\n";
  }
  return text;
}

/// Blocks of "///" at the beginning of a line, each with the line behind it.
std::vector<std::pair<std::string, std::string>> documented(const std::vector<std::string>& lines) {
  std::vector<std::pair<std::string, std::string>> blocks;
  std::string text;
  for (const auto& line : lines) {
    if (const auto comment = comment_line(line, "///")) {
      text += *comment + "\n";
    } else if (!text.empty()) {
      blocks.emplace_back(text, line);
      text.clear();
    }
  }
  return blocks;
}

/// Of the class that is a method, else of the first.
std::string class_comment(const std::vector<std::string>& lines) {
  static const std::regex is_method("class .*: public \\w*Method .*");
  std::string first;
  for (const auto& [text, what] : documented(lines)) {
    if (std::regex_match(what, is_method)) return text;
    if (what.starts_with("class ") && first.empty()) first = text;
  }
  return first;
}

/// The longest comment of a header: what it is there for.
std::string main_comment(const fs::path& header) {
  std::string longest;
  for (const auto& [text, what] : documented(lines_of(read_text(header)))) {
    if (text.size() > longest.size()) longest = text;
  }
  return longest;
}

/// "fesd_run.h" of "(fesd_run.h)", "methods/elements/stage_equations.h"
std::vector<std::string> headers_named_in(const std::string& text) {
  static const std::regex header("[a-z0-9_/]+\\.h\\b");
  std::vector<std::string> names;
  for (std::sregex_iterator found(text.begin(), text.end(), header), end; found != end; ++found) {
    if (std::ranges::find(names, found->str()) == names.end()) names.push_back(found->str());
  }
  return names;
}

bool registers(const std::string& text, const std::string& method) {
  return text.find("register_method<") != std::string::npos &&
         text.find(fmt::format(".name = \"{}\"", method)) != std::string::npos;
}

}  // namespace

std::optional<Scheme> scheme_of(const std::string& method) {
  const fs::path root = data_folder(), methods = root / "methods";
  if (!fs::is_directory(methods)) return std::nullopt;
  for (const auto& entry : fs::recursive_directory_iterator(methods)) {
    if (entry.path().extension() != ".cpp") continue;
    const std::string source = read_text(entry.path());
    if (!registers(source, method)) continue;
    const auto lines = lines_of(source);
    Scheme scheme{fs::relative(entry.path(), root).string(), head_comment(lines)};
    if (!scheme.text.empty()) return scheme;
    scheme.text = class_comment(lines);
    for (const auto& header : headers_named_in(scheme.text)) {
      const fs::path beside = entry.path().parent_path() / header, path = fs::exists(beside) ? beside : root / header;
      if (fs::exists(path)) scheme.text += "\n" + main_comment(path);
    }
    return scheme;
  }
  return std::nullopt;
}

std::optional<Scheme> statement_of(const std::string& scene) {
  constexpr std::size_t kLeast = 3;  // lines; shorter comments explain a line of code
  const fs::path root = data_folder(), scenes = root / "problems/scenes";
  if (!fs::is_directory(scenes)) return std::nullopt;
  for (const auto& entry : fs::directory_iterator(scenes)) {
    const std::string source = read_text(entry.path());
    const auto text = source.find(fmt::format("\"{}\",", scene));  // its SceneText, the id first
    if (text == std::string::npos || source.substr(0, text).find("SceneText") == std::string::npos) continue;
    const auto lines = lines_of(source.substr(0, text));
    Scheme statement{fs::relative(entry.path(), root).string(), ""};
    for (std::size_t begin = 0, end = 0; begin < lines.size(); begin = end + 1) {
      for (end = begin; end < lines.size() && comment_line(lines[end], "//");) ++end;
      if (end - begin >= kLeast)
        statement.text = head_comment(
            {lines.begin() + static_cast<std::ptrdiff_t>(begin), lines.begin() + static_cast<std::ptrdiff_t>(end)});
    }
    return statement;
  }
  return std::nullopt;
}

}  // namespace ricochet
