#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace ricochet {

/// An experiment is data: a file in bench/experiments/ that says what a study (bench/studies/study.h) is to run.
///
///   "id", "title", "description"   of the results
///   "kind"                         of the study; "method_grid" without it
///   "quick_part"                   fields that replace those of the file in a --quick run
///   "parts"                        instead of those below "title": names of experiments, which are run one by one
///   "also_shown"                   beside "parts": names whose results go into the page when there are some
/// and the fields of the study, experiment_schema.h.
class ExperimentFile {
 public:
  ExperimentFile(std::string given, std::string found, nlohmann::json text)
      : name(std::move(given)), path(std::move(found)), document(std::move(text)) {}

  std::string name;  ///< as it was given
  std::string path;
  nlohmann::json document;

  std::string title() const { return document.value("title", name); }
  std::string kind() const;
  /// Names of experiments to run: the name itself when the file is one.
  std::vector<std::string> parts() const;
  /// Takes "quick_part" out of the document, and merges it into the other fields (RFC 7396) if it `is_wanted`.
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

/// A file of data_folder(), by its path there; as given when it exists.
std::string find_project_file(const std::string& path);

/// @param what  it is to be, for the message: "an experiment"  @throws InputError for a file that is not there, or
/// holds no JSON object
nlohmann::json read_json_object(const std::string& path, const std::string& what);

/// @param place  of `object`, for the message  @throws InputError for a field that is not known
void allow_only(const nlohmann::json& object, const std::set<std::string>& known, const std::string& place);

/// from * 10^(k / per_decade), k = 0, 1, ..., up to `to`, or from * 10^(-k / per_decade) down to it.
/// @param field  that it is of, for the message  @throws InputError unless all three are positive and finite
std::vector<double> logarithmic_grid(double from, double to, double per_decade, const std::string& field);
/// Of {"from", "to", "per_decade"}. @throws nlohmann::json::exception for one that is missing
std::vector<double> logarithmic_grid(const nlohmann::json& range, const std::string& field);

}  // namespace ricochet
