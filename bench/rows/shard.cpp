#include "bench/rows/shard.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <regex>
#include <set>

#include "problems/input_error.h"
#include "reports/results.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

/// The shards in a folder that belong to one division of an experiment.
struct Division {
  std::set<int> of_key;  ///< complete ones of the results that are made
  std::set<int> others;  ///< complete ones of another experiment, other files or another program
};

/// Divisions by number of shards. A folder may also contain shards of an earlier program, even with another number.
std::map<int, Division> divisions_in(const std::string& folder, const std::string& experiment, const std::string& key) {
  static const std::regex tail(R"(\.shard-([1-9][0-9]{0,5})-of-([1-9][0-9]{0,5})\.jsonl(\.partial)?)");
  std::map<int, Division> divisions;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    std::smatch match;
    if (!name.starts_with(experiment)) continue;
    const std::string rest = name.substr(experiment.size());
    if (!std::regex_match(rest, match, tail)) continue;
    const Shard shard{std::stoi(match[1]), std::stoi(match[2])};
    if (shard.number > shard.of || shard.is_all()) continue;
    Division& division = divisions[shard.of];
    if (match[3].matched) continue;  // without a shard that is complete, the division is named nevertheless
    const bool is_of_key = read_header(entry.path().string()).value("key", "") == key;
    (is_of_key ? division.of_key : division.others).insert(shard.number);
  }
  if (error) throw InputError("folder of shards", folder, error.message());
  return divisions;
}

/// Names the missing shards of a division, which prevent a merge.
std::string lacks_of(const Division& division, int of) {
  std::vector<int> missing;
  for (int number = 1; number <= of; ++number) {
    if (!division.of_key.contains(number) && !division.others.contains(number)) missing.push_back(number);
  }
  std::vector<std::string> lacks;
  if (!missing.empty()) lacks.push_back(fmt::format("these are missing or not complete: {}", fmt::join(missing, ", ")));
  if (!division.others.empty())
    lacks.push_back(fmt::format("these are of another experiment, other files or another program: {}",
                                fmt::join(division.others, ", ")));
  return fmt::format("{}", fmt::join(lacks, ", and "));
}

/// The division that is complete. Rows of two are not the same where a run ends by its limit of wall time, so none of
/// them is chosen here.
/// @throws InputError where none is, with what each of them lacks, or where several are
int complete_division(const std::map<int, Division>& divisions, const std::string& folder,
                      const std::string& experiment) {
  if (divisions.empty())
    throw InputError("folder of shards", folder, fmt::format("the folder contains no shard of {}", experiment));
  std::vector<int> complete;
  std::vector<std::string> lacks;
  for (const auto& [of, division] : divisions) {
    if (static_cast<int>(division.of_key.size()) == of) {
      complete.push_back(of);
    } else {
      lacks.push_back(fmt::format("of the {} shards of {} {}", of, experiment, lacks_of(division, of)));
    }
  }
  if (complete.empty()) throw InputError("folder of shards", folder, fmt::format("{}", fmt::join(lacks, "; ")));
  if (complete.size() > 1)
    throw InputError(
        "folder of shards", folder,
        fmt::format(
            "it contains more than one complete set of {}, of {} shards; a folder with only one of them is required",
            experiment, fmt::join(complete, " and ")));
  return complete.front();
}

/// @throws InputError for a row that no shard has made
std::size_t piece_of(const nlohmann::json& row, const std::string& path) {
  const auto piece = row.find("piece");
  if (piece == row.end() || !piece->is_number_unsigned())
    throw InputError("shard", path, "a row does not name its piece of the work");
  return piece->get<std::size_t>();
}

}  // namespace

std::string Shard::name(const std::string& experiment) const {
  return is_all() ? experiment : fmt::format("{}.shard-{}-of-{}", experiment, number, of);
}

std::string shard_path(const std::string& path, const Shard& shard) {
  const fs::path file = path;
  return (file.parent_path() / (shard.name(file.stem().string()) + file.extension().string())).string();
}

Shard read_shard(const std::string& text) {
  static const std::regex form("([1-9][0-9]{0,5})/([1-9][0-9]{0,5})");
  std::smatch match;
  if (!std::regex_match(text, match, form)) throw InputError("--shard", text, "NUMBER/OF is required, as in 3/8");
  const Shard shard{std::stoi(match[1]), std::stoi(match[2])};
  if (shard.number > shard.of)
    throw InputError("--shard", text, fmt::format("a number from 1 to {} is required", shard.of));
  return shard;
}

ShardRows read_shards(const std::string& folder, const std::string& experiment, const std::string& key,
                      std::vector<nlohmann::json>& headers) {
  const int of = complete_division(divisions_in(folder, experiment, key), folder, experiment);
  ShardRows rows;
  for (int number = 1; number <= of; ++number) {
    const std::string path = shard_path((fs::path(folder) / (experiment + ".jsonl")).string(), {number, of});
    const Results shard = read_results(path);
    if (!shard.is_complete) throw InputError("shard", path, "it is not complete");
    headers.push_back(shard.header);
    for (const auto& row : shard.rows) rows[piece_of(row, path)].push_back(row);
  }
  return rows;
}

}  // namespace ricochet
