#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace ricochet {

/// Selection of methods and problems of an experiment, by name or by a pattern, in which * matches any text. The
/// selected rows are the same as in the complete experiment.
struct Selection {
  std::vector<std::string> methods, problems;  ///< patterns; empty: all

  bool empty() const { return methods.empty() && problems.empty(); }
};

/// Whether a name matches a pattern.
bool matches(const std::string& name, const std::string& pattern);

/// Methods and problems listed in an experiment.
struct ListedNames {
  std::set<std::string> methods, problems;

  void merge(ListedNames other) {
    methods.merge(other.methods);
    problems.merge(other.problems);
  }
};

/// @param document  of an experiment in which every method is named (Study::name_methods)
ListedNames names_in(const nlohmann::json& document);

/// @throws InputError for a pattern that no name matches, with the names
void require_matches(const Selection& selection, const ListedNames& names);

/// Takes out of an experiment what is not selected: methods, and problems with all that is theirs.
/// @returns whether anything is left
bool select(nlohmann::json& document, const Selection& selection);

}  // namespace ricochet
