#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace ricochet {

/// An experiment is a file in bench/experiments/ that defines the runs of a study (bench/experiment/study.h).
///
///   "id", "title", "description"   of the results
///   "kind"                         of the study; "method_grid" without it
///   "quick_part"                   fields that replace those of the file in a --quick run
///   "parts"                        names of experiments, which are run one after the other; replaces all other fields
///   "also_shown"                   with "parts": names whose results are shown on the page if they exist
/// and the fields of the study, see experiment_schema.h.
class ExperimentFile {
 public:
  ExperimentFile(std::string given, std::string found, nlohmann::json text)
      : name(std::move(given)), path(std::move(found)), document(std::move(text)) {}

  std::string name;  ///< as given by the user
  std::string path;
  nlohmann::json document;

  std::string title() const { return document.value("title", name); }
  std::string kind() const;
  /// Names of the experiments to run: "parts", or the name itself.
  std::vector<std::string> parts() const;
  /// Removes "quick_part" from the document and, if it `is_wanted`, merges it into the other fields (RFC 7396).
  /// @returns whether there was one
  bool take_quick_part(bool is_wanted);
  /// Sets a field, "FIELD=VALUE", with a value in JSON, or a text. @throws InputError
  void change(const std::string& text);

 private:
  std::set<std::string> changed_;
};

/// @param name  of a file in bench/experiments/ without ".json", or a path
/// @throws InputError with file and field
ExperimentFile read_experiment_file(const std::string& name);

/// Names of the files in bench/experiments/.
std::vector<std::string> experiment_names();

/// @param what  kind of file for the message: "an experiment"  @throws InputError if the file does not exist or
/// contains no JSON object
nlohmann::json read_json_object(const std::string& path, const std::string& what);

/// @param place  of `object`, for the message  @throws InputError for an unknown field
void allow_only(const nlohmann::json& object, const std::set<std::string>& known, const std::string& place);

/// from * 10^(k / per_decade), k = 0, 1, ..., up to `to`, or from * 10^(-k / per_decade) down to it.
/// @param field  name of the field, for the message  @throws InputError unless all three are positive and finite
std::vector<double> logarithmic_grid(double from, double to, double per_decade, const std::string& field);
/// The same for {"from", "to", "per_decade"}. @throws nlohmann::json::exception for a missing field
std::vector<double> logarithmic_grid(const nlohmann::json& range, const std::string& field);

}  // namespace ricochet
