#pragma once

#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace ricochet {

/// The part of an experiment that one machine of a campaign makes: the pieces of its rows (results_file.h) whose number
/// is `number` - 1 modulo `of`. Neighbouring pieces, which take about the same time, are thus in different shards.
struct Shard {
  int number = 1;  ///< from 1
  int of = 1;      ///< number of shards; 1: the whole experiment

  bool is_all() const { return of == 1; }
  bool has(std::size_t piece) const {
    return piece % static_cast<std::size_t>(of) == static_cast<std::size_t>(number - 1);
  }
  /// "hard_cases.shard-3-of-8", the name of its results.
  std::string name(const std::string& experiment) const;
};

/// "out/spring.shard-3-of-8.csv" for the complete file "out/spring.csv".
std::string shard_path(const std::string& path, const Shard& shard);

/// @param text  "3/8"  @throws InputError for another form, or a number outside 1 to 8
Shard read_shard(const std::string& text);

/// Rows of shards, as lines, by piece.
using ShardRows = std::map<std::size_t, std::vector<nlohmann::json>>;

/// Reads all rows of the shards of an experiment in a folder, which may also contain shards with other keys.
/// @param key  key in the header, which identifies experiment, files and program
/// @param headers  out, headers of the shards
/// @throws InputError if no set of shards with this key is complete, if several are, or if a shard is damaged
ShardRows read_shards(const std::string& folder, const std::string& experiment, const std::string& key,
                      std::vector<nlohmann::json>& headers);

}  // namespace ricochet
