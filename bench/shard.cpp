#include "bench/shard.h"

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

/// By their number how many shards of an experiment there are in a folder, complete or not.
std::map<int, std::set<int>> shards_in(const std::string& folder, const std::string& experiment) {
  static const std::regex tail(R"(\.shard-([1-9][0-9]{0,8})-of-([1-9][0-9]{0,8})\.jsonl(\.partial)?)");
  std::map<int, std::set<int>> complete;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    std::smatch match;
    if (!name.starts_with(experiment)) continue;
    const std::string rest = name.substr(experiment.size());
    if (!std::regex_match(rest, match, tail)) continue;
    auto& numbers = complete[std::stoi(match[2])];
    if (!match[3].matched) numbers.insert(std::stoi(match[1]));
  }
  if (error) throw InputError("folder of shards", folder, error.message());
  return complete;
}

/// The division that is complete. @throws InputError where none is, with what is missing of the first
int complete_division(const std::map<int, std::set<int>>& shards, const std::string& folder,
                      const std::string& experiment) {
  if (shards.empty()) throw InputError("folder of shards", folder, fmt::format("it has no shard of {}", experiment));
  for (const auto& [of, numbers] : shards) {
    if (static_cast<int>(numbers.size()) == of) return of;
  }
  const auto& [of, numbers] = *shards.begin();
  std::vector<int> missing;
  for (int number = 1; number <= of; ++number) {
    if (!numbers.contains(number)) missing.push_back(number);
  }
  throw InputError("folder of shards", folder,
                   fmt::format("of the {} shards of {} these are missing or not complete: {}", of, experiment,
                               fmt::join(missing, ", ")));
}

}  // namespace

std::string Shard::name(const std::string& experiment) const {
  return is_all() ? experiment : fmt::format("{}.shard-{}-of-{}", experiment, number, of);
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
  const int of = complete_division(shards_in(folder, experiment), folder, experiment);
  ShardRows rows;
  for (int number = 1; number <= of; ++number) {
    const std::string path = (fs::path(folder) / (Shard{number, of}.name(experiment) + ".jsonl")).string();
    const Results shard = read_results(path);
    if (!shard.is_complete) throw InputError("shard", path, "it is not complete");
    if (shard.header.value("key", "") != key)
      throw InputError("shard", path, "it is of another experiment, other files or another program");
    headers.push_back(shard.header);
    for (const auto& row : shard.rows) rows[row.at("piece").get<std::size_t>()].push_back(row);
  }
  return rows;
}

}  // namespace ricochet
