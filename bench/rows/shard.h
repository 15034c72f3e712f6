#pragma once

#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace ricochet {

/// A part of an experiment that a machine of a campaign makes: of the pieces 0, 1, ... of its rows (results_file.h) those
/// that leave `number` - 1 when divided by `of`, so that neighbours, which take as long, are spread over the shards.
struct Shard {
  int number = 1;  ///< from 1
  int of = 1;      ///< 1: all of it

  bool is_all() const { return of == 1; }
  bool has(std::size_t piece) const {
    return piece % static_cast<std::size_t>(of) == static_cast<std::size_t>(number - 1);
  }
  /// "hard_cases.shard-3-of-8", of the results of an experiment.
  std::string name(const std::string& experiment) const;
};

/// "out/spring.shard-3-of-8.csv", of the file "out/spring.csv" of the whole.
std::string shard_path(const std::string& path, const Shard& shard);

/// @param text  "3/8"  @throws InputError for another text, or a number that is not from 1 to 8
Shard read_shard(const std::string& text);

/// Rows that shards have made, as lines, by piece.
using ShardRows = std::map<std::size_t, std::vector<nlohmann::json>>;

/// All rows of the shards of an experiment in a folder. Shards of another key may be there, too.
/// @param key  of the header: of the same experiment, files and program
/// @param headers  out, of the shards
/// @throws InputError when no division into shards of this key is complete, or several are, or one of them is damaged
ShardRows read_shards(const std::string& folder, const std::string& experiment, const std::string& key,
                      std::vector<nlohmann::json>& headers);

}  // namespace ricochet
