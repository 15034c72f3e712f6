#include "bench/experiment/experiment_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bench/experiment/experiment_schema.h"
#include "bench/experiment/study.h"
#include "bench/measure/data_folder.h"
#include "problems/input_error.h"
#include "problems/input_text.h"
#include "problems/names.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const char* const kFolder = "bench/experiments";

constexpr int kMostGridIntervals = 1000000;  // a slip of the keyboard would fill the memory
constexpr double kGridRounding = 1e-9;       // of a number of intervals that is whole on paper

}  // namespace

std::vector<std::string> experiment_names() {
  std::vector<std::string> names;
  const fs::path folder = find_project_file(kFolder);
  if (fs::exists(folder)) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.path().extension() == ".json") names.push_back(entry.path().stem());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

ExperimentFile read_experiment_file(const std::string& name) {
  std::string path = name;
  if (!fs::is_regular_file(path)) path = find_project_file(fmt::format("{}/{}.json", kFolder, name));
  if (!fs::is_regular_file(path)) throw_unknown_name("experiment", name, experiment_names());
  ExperimentFile file(name, path, read_json_object(path, "an experiment"));
  const std::string place = path + ": ";
  if (file.document.contains("parts")) experiment_group_schema().check(file.document, place);
  for (const char* field : {"kind", "title"}) {
    if (file.document.contains(field) && !file.document[field].is_string())
      throw InputError(place + field, file.document[field].dump(), "a text in quotes is required");
  }
  return file;
}

json read_json_object(const std::string& path, const std::string& what) {
  json document = read_input_json(path, what);
  if (!document.is_object()) throw InputError(fmt::format("{}: not {}: a JSON object is required", path, what));
  return document;
}

std::string ExperimentFile::kind() const {
  return document.value("kind", kDefaultStudy);
}

std::vector<std::string> ExperimentFile::parts() const {
  return document.value("parts", std::vector<std::string>{name});
}

bool ExperimentFile::take_quick_part(bool is_wanted) {
  const auto found = document.find("quick_part");
  if (found == document.end()) return false;
  const json part = *found;
  if (!part.is_object()) throw InputError(path + ": quick_part", part.type_name(), "an object is required");
  document.erase(found);
  if (is_wanted) document.merge_patch(part);
  return true;
}

void ExperimentFile::change(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0) throw InputError("--set", text, "FIELD=VALUE is required");
  const std::string value = text.substr(equals + 1), field = text.substr(0, equals);
  if (!changed_.insert(field).second) throw InputError("--set", text, "this field is given twice");
  const bool is_json = json::accept(value);
  const json parsed = is_json ? parse_input_json(value, "--set " + field) : json();
  document[field] = is_json ? parsed : json(value);
}

void allow_only(const json& object, const std::set<std::string>& known, const std::string& place) {
  for (const auto& [key, value] : object.items()) {
    if (!known.contains(key)) throw_unknown_name("field of " + place, key, {known.begin(), known.end()});
  }
}

std::vector<double> logarithmic_grid(double from, double to, double per_decade, const std::string& field) {
  for (const double x : {from, to, per_decade}) {
    if (!(x > 0) || !std::isfinite(x))
      throw InputError(field, fmt::format("from {} to {}, {} per decade", from, to, per_decade),
                       "finite numbers > 0 are required");
  }
  const double intervals = std::abs(std::log10(to / from)) * per_decade;
  if (intervals > kMostGridIntervals)
    throw InputError(field, intervals, fmt::format("at most {} intervals are allowed", kMostGridIntervals));
  const int n = static_cast<int>(intervals + kGridRounding);
  std::vector<double> values;
  for (int k = 0; k <= n; ++k) values.push_back(from * std::pow(10, (to < from ? -k : k) / per_decade));
  return values;
}

std::vector<double> logarithmic_grid(const json& range, const std::string& field) {
  return logarithmic_grid(range.at("from"), range.at("to"), range.at("per_decade"), field);
}

}  // namespace ricochet
