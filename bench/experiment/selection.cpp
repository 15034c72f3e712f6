#include "bench/experiment/selection.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>

#include "problems/input_error.h"

namespace ricochet {
namespace {

using nlohmann::json;

// Experiments name methods in lists of texts, and in "method" of entries of lists; a problem in "problem" of an object, which is
// the experiment itself or an entry of one of its lists.

bool lists_methods(const std::string& field) {
  return field == "methods" || field == "adaptive_methods" || field == "only_method";
}

/// Whether a field states what errors are measured against. Such fields are never deselected.
bool is_measure(const std::string& field) {
  return field == "reference" || field == "check";
}

bool is_selected(const json& name, const std::vector<std::string>& patterns) {
  return patterns.empty() ||
         std::ranges::any_of(patterns, [&](const auto& pattern) { return matches(name.get<std::string>(), pattern); });
}

/// @param is_entry  of a list: a "method" elsewhere is that of a figure or of a reference
void add_names(const json& node, bool is_entry, ListedNames& names) {
  if (node.is_array()) {
    for (const json& entry : node) add_names(entry, true, names);
  }
  if (!node.is_object()) return;
  for (const auto& [field, value] : node.items()) {
    if (field == "method" && value.is_string() && is_entry) names.methods.insert(value);
    if (field == "problem" && value.is_string()) names.problems.insert(value);
    if (lists_methods(field) && value.is_array()) {
      for (const json& entry : value) {
        if (entry.is_string()) names.methods.insert(entry);
      }
    }
    add_names(value, false, names);
  }
}

/// Whether a list has anything left, or had nothing.
bool select_entries(json& list, const std::function<bool(json& entry)>& keeps) {
  if (list.empty()) return true;
  json kept = json::array();
  for (json& entry : list) {
    if (keeps(entry)) kept.push_back(std::move(entry));
  }
  list = std::move(kept);
  return !list.empty();
}

bool select_object(json& node, const Selection& selection);

bool select_value(json& value, const Selection& selection) {
  if (value.is_object()) return select_object(value, selection);
  if (!value.is_array()) return true;
  return select_entries(value, [&](json& entry) { return select_value(entry, selection); });
}

/// An object goes where its own method or problem is not selected, or a list of it has nothing left: of methods, all of
/// its lists, with those of the objects inside it. What is an object inside it goes alone.
bool select_object(json& node, const Selection& selection) {
  bool had_methods = false, has_methods = false;
  std::vector<std::string> gone;
  for (auto& [field, value] : node.items()) {
    if (is_measure(field)) continue;
    if (field == "method" && value.is_string() && !is_selected(value, selection.methods)) return false;
    if (field == "problem" && value.is_string() && !is_selected(value, selection.problems)) return false;
    if (lists_methods(field) && value.is_array()) {
      had_methods |= !value.empty();
      has_methods |= select_entries(value,
                                    [&](json& entry) {
                                      return entry.is_string() ? is_selected(entry, selection.methods)
                                                               : select_value(entry, selection);
                                    }) &&
                     !value.empty();
    } else if (value.is_array()) {
      if (!select_value(value, selection)) return false;
    } else if (!select_value(value, selection)) {
      gone.push_back(field);
    } else if (value.is_object() && std::ranges::any_of(value.items(), [](const auto& inside) {
                 return lists_methods(inside.key()) && !inside.value().empty();
               })) {
      has_methods = true;
    }
  }
  for (const auto& field : gone) node.erase(field);
  return has_methods || !had_methods;
}

void require_match(const std::string& option, const std::vector<std::string>& patterns,
                   const std::set<std::string>& names) {
  for (const auto& pattern : patterns) {
    if (std::ranges::any_of(names, [&](const auto& name) { return matches(name, pattern); })) continue;
    throw InputError(option, pattern,
                     names.empty() ? std::string("the experiment has nothing to select from")
                                   : fmt::format("the experiment has no such name; it has {}", fmt::join(names, "  ")));
  }
}

}  // namespace

bool matches(const std::string& name, const std::string& pattern) {
  const auto star = pattern.find('*');
  if (star == std::string::npos) return name == pattern;
  if (!name.starts_with(pattern.substr(0, star))) return false;
  const std::string rest = pattern.substr(star + 1);
  for (std::size_t k = star; k <= name.size(); ++k) {
    if (matches(name.substr(k), rest)) return true;
  }
  return false;
}

ListedNames names_in(const json& document) {
  ListedNames names;
  add_names(document, false, names);
  return names;
}

void require_matches(const Selection& selection, const ListedNames& names) {
  require_match("--method", selection.methods, names.methods);
  require_match("--problem", selection.problems, names.problems);
}

bool select(json& document, const Selection& selection) {
  if (!select_object(document, selection)) return false;
  const ListedNames left = names_in(document);  // where it lists none, it has none that is selected
  if ((left.methods.empty() && !selection.methods.empty()) || (left.problems.empty() && !selection.problems.empty()))
    return false;
  if (const auto overhead = document.find("overhead_of"); overhead != document.end()) {
    const json pairs = *overhead;
    for (const auto& [method, compared] : pairs.items()) {
      if (!is_selected(method, selection.methods) || !is_selected(compared, selection.methods)) overhead->erase(method);
    }
  }
  return true;
}

}  // namespace ricochet
