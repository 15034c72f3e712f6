#include "bench/site/scheme.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <sstream>
#include <vector>

#include "bench/experiment/data_folder.h"
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

/// Those whose numbered equations a text counts on: "moreau_extrapolation.h, (1)-(5)".
std::vector<std::string> headers_counted_on_in(const std::string& text) {
  static const std::regex header("([a-z0-9_/]+\\.h), \\(\\d");
  std::vector<std::string> names;
  for (std::sregex_iterator found(text.begin(), text.end(), header), end; found != end; ++found)
    names.push_back((*found)[1]);
  return names;
}

/// A file of the source tree, wherever the compiler saw it: the longest end of its path that is there. Else the file
/// itself, which a plugin of the user's may be from; empty where neither is there.
fs::path source_file(const fs::path& compiled) {
  const fs::path root = data_folder();
  std::error_code error;
  if (const fs::path relative = fs::relative(compiled, root, error);
      !error && !relative.empty() && *relative.begin() == ".." && fs::exists(compiled, error))
    return compiled;
  for (auto begin = compiled.begin(); begin != compiled.end(); ++begin) {
    fs::path end;
    for (auto part = begin; part != compiled.end(); ++part) end /= part->relative_path();
    if (!end.empty() && fs::is_regular_file(root / end, error)) return root / end;
  }
  return {};
}

/// As a reader finds it: from the root of the source tree, or the name of a file that is not in it.
std::string shown_name(const fs::path& file) {
  const fs::path relative = fs::relative(file, data_folder());
  return relative.empty() || *relative.begin() == ".." ? file.filename().string() : relative.string();
}

/// A header that a file names: beside it, in a folder beside it, or from the root.
fs::path header_of(const fs::path& file, const std::string& name) {
  std::error_code error;
  const fs::path folder = file.parent_path();
  if (fs::exists(folder / name, error)) return folder / name;
  if (fs::exists(data_folder() / fs::path(name), error)) return data_folder() / fs::path(name);
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (fs::exists(entry.path() / name, error)) return entry.path() / name;
  }
  return {};
}

}  // namespace

std::optional<Scheme> scheme_of(const MethodEntry& method) {
  if (method.file.empty()) return std::nullopt;
  const fs::path registered = method.file;
  const fs::path file =
      source_file(method.scheme.empty() ? registered : registered.parent_path() / fs::path(method.scheme));
  if (file.empty()) return std::nullopt;
  const auto lines = lines_of(read_text(file));
  Scheme scheme{shown_name(file), head_comment(lines)};
  const bool has_head = !scheme.text.empty();
  if (!has_head) scheme.text = class_comment(lines);
  for (const auto& name : has_head ? headers_counted_on_in(scheme.text) : headers_named_in(scheme.text)) {
    if (const fs::path header = header_of(file, name); !header.empty())
      scheme.text += fmt::format("\n{}:\n\n{}", shown_name(header), main_comment(header));
  }
  return scheme;
}

std::optional<Scheme> statement_of(const SceneEntry& scene) {
  constexpr std::size_t kLeast = 3;  // lines; shorter comments explain a line of code
  if (scene.file.empty()) return std::nullopt;
  const fs::path file = source_file(scene.file);
  if (file.empty()) return std::nullopt;
  const std::string source = read_text(file);
  const auto text = source.find(fmt::format("\"{}\",", scene.id));  // its SceneText, the id first
  if (text == std::string::npos || source.substr(0, text).find("SceneText") == std::string::npos) return std::nullopt;
  const auto lines = lines_of(source.substr(0, text));
  Scheme statement{shown_name(file), ""};
  for (std::size_t begin = 0, end = 0; begin < lines.size(); begin = end + 1) {
    for (end = begin; end < lines.size() && comment_line(lines[end], "//");) ++end;
    if (end - begin >= kLeast)
      statement.text = head_comment(
          {lines.begin() + static_cast<std::ptrdiff_t>(begin), lines.begin() + static_cast<std::ptrdiff_t>(end)});
  }
  return statement;
}

std::vector<std::string> paragraphs_of(const Scheme& statement) {
  std::vector<std::string> paragraphs;
  bool is_open = false;
  for (const auto& line : lines_of(statement.text)) {
    const bool is_prose = !line.empty() && line.front() != ' ';
    if (is_prose && is_open) paragraphs.back() += " " + line;
    if (is_prose && !is_open) paragraphs.push_back(line);
    is_open = is_prose;
  }
  return paragraphs;
}

}  // namespace ricochet
