#include "bench/ensemble/ensemble_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>
#include <sstream>

#include "bench/experiment/experiment_file.h"
#include "bench/measure/data_folder.h"
#include "bench/measure/environment.h"
#include "bench/rows/in_order.h"
#include "problems/input_error.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Key of an ensemble: the ensemble, its scene file and the program. Rows are taken over while it is unchanged.
std::string key_of(const Ensemble& ensemble) {
  const std::string& problem = ensemble.problem.problem;
  const std::string scene =
      ensemble.problem.is_scene_file() ? read_text(find_project_file(problem.substr(0, problem.rfind('#')))) : "";
  return hash_of(ensemble.document().dump() + scene + program_hash());
}

constexpr std::size_t kMostBuffered = 1 << 20;

/// N of the shards of a file of which any are there.
std::set<int> numbers_of_shards(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  std::set<int> numbers;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, error)) {
    const std::string name = entry.path().filename().string();
    static const std::regex form(R"(.*\.shard-[1-9][0-9]{0,5}-of-([1-9][0-9]{0,5})\..*)");
    std::smatch match;
    if (std::regex_match(name, match, form) && name.starts_with(fs::path(path).stem().string() + ".shard-"))
      numbers.insert(std::stoi(match[1]));
  }
  if (error) throw InputError("--from-shards", folder.string(), error.message());
  if (numbers.empty())
    throw InputError("--from-shards", folder.string(),
                     fmt::format("the folder contains no shard of {}", fs::path(path).filename().string()));
  return numbers;
}

/// Reason why a shard cannot be merged; empty if it can.
std::string reason_not_taken(const std::string& path, const std::string& key) {
  if (!fs::exists(path)) return "it is missing, or not complete";
  const json known = json::parse(read_text(path + ".json"), nullptr, false);
  return known.is_object() && known.value("key", "") == key ? "" : "it is of another ensemble or another program";
}

}  // namespace

EnsembleFile::EnsembleFile(std::string path, const Ensemble& ensemble, const ProblemInfo& problem, Shard shard)
    : path_(std::move(path)),
      partial_(path_ + ".partial"),
      status_column_(1 + ensemble.varied.size()),
      begin_(ensemble.n_runs() / shard.of * (shard.number - 1) +
             std::min<std::int64_t>(shard.number - 1, ensemble.n_runs() % shard.of)),
      end_(begin_ + ensemble.n_runs() / shard.of + (shard.number <= ensemble.n_runs() % shard.of ? 1 : 0)),
      n_done_(begin_) {
  json description = {{"ensemble", ensemble.document()}, {"environment", environment()}, {"key", key_of(ensemble)}};
  if (!shard.is_all()) description["shard"] = fmt::format("{}/{}", shard.number, shard.of);
  const std::string header = csv_header(ensemble, problem);
  const bool is_there = fs::exists(path_), is_begun = fs::exists(partial_);
  if (is_there || is_begun) {
    const json known = json::parse(read_text(path_ + ".json"), nullptr, false);
    if (!known.is_object() || known.value("key", "") != description["key"])
      throw InputError(
          "-o", path_,
          "the file contains another ensemble, or one of another build; choose another name, or remove the file");
  }
  if (is_there) {
    is_complete_ = true;
    n_done_ = end_;
  } else if (is_begun) {
    take_lines(header);
  } else {
    write_header(header, description);
  }
}

void EnsembleFile::write_header(const std::string& header, const json& description) {
  std::error_code error;
  if (const fs::path folder = fs::path(path_).parent_path(); !folder.empty()) fs::create_directories(folder, error);
  std::ofstream beside(path_ + ".json");
  beside << description.dump(2) << "\n";
  beside.close();
  file_.open(partial_, std::ios::binary | std::ios::trunc);
  file_ << header << std::flush;
  if (!beside || !file_) throw InputError("-o", path_, "it cannot be written");
}

/// Takes over the lines that are whole and in their order, and cuts off what follows them.
void EnsembleFile::take_lines(const std::string& header) {
  std::uintmax_t size = 0;
  {
    std::ifstream file(partial_, std::ios::binary);
    std::string line;
    if (std::getline(file, line) && !file.eof() && line + "\n" == header) {
      size = header.size();
      while (n_done_ < end_ && std::getline(file, line) && !file.eof() &&
             line.starts_with(fmt::format("{},", n_done_))) {
        size += line.size() + 1;
        ++n_done_;
      }
    }
  }
  fs::resize_file(partial_, size);
  file_.open(partial_, std::ios::binary | std::ios::app);
  if (size == 0) file_ << header << std::flush;
  if (!file_) throw InputError("-o", partial_, "it cannot be written");
}

void EnsembleFile::append(std::int64_t end, const std::string& lines) {
  if (!(file_ << lines << std::flush)) throw InputError("-o", partial_, "it cannot be written");
  n_done_ = end;
}

void EnsembleFile::finish() {
  file_.close();
  std::error_code error;
  fs::rename(partial_, path_, error);
  if (!file_ || error) throw InputError("-o", path_, "it cannot be written");
  is_complete_ = true;
}

std::map<std::string, std::int64_t> EnsembleFile::endings() const {
  std::map<std::string, std::int64_t> counts;
  std::ifstream file(is_complete_ ? path_ : partial_, std::ios::binary);
  std::string line;
  std::getline(file, line);  // headers
  while (std::getline(file, line)) {
    std::istringstream cells(line);  // those before the status are numbers
    std::string cell;
    for (std::size_t k = 0; k <= status_column_; ++k) std::getline(cells, cell, ',');
    ++counts[cell];
  }
  return counts;
}

std::vector<std::string> complete_shards(const std::string& path, const std::string& folder, const Ensemble& ensemble) {
  const std::string here = (fs::path(folder) / fs::path(path).filename()).string(), key = key_of(ensemble);
  std::string first_missing, why;
  for (const int of : numbers_of_shards(here)) {
    std::vector<std::string> paths;
    for (int number = 1; number <= of; ++number) {
      paths.push_back(shard_path(here, {number, of}));
      const std::string reason = reason_not_taken(paths.back(), key);
      if (reason.empty()) continue;
      if (why.empty()) first_missing = paths.back();
      if (why.empty()) why = reason;
      paths.clear();
      break;
    }
    if (!paths.empty()) return paths;
  }
  throw InputError("shard", first_missing, why);
}

void merge_shards(EnsembleFile& file, const std::vector<std::string>& shards, const std::string& header) {
  if (file.is_complete()) return;
  std::int64_t next = 0;
  for (const auto& shard : shards) {
    std::ifstream lines(shard, std::ios::binary);
    std::string line, buffer;
    if (!std::getline(lines, line) || line + "\n" != header) throw InputError("shard", shard, "its header differs");
    for (; std::getline(lines, line); ++next) {
      if (lines.eof() || !line.starts_with(fmt::format("{},", next)))
        throw InputError("shard", shard, fmt::format("run {} is incomplete", next));
      if (next < file.n_done()) continue;
      buffer += line + "\n";
      if (buffer.size() < kMostBuffered) continue;
      file.append(next + 1, buffer);
      buffer.clear();
    }
    if (!buffer.empty()) file.append(next, buffer);
  }
  if (next != file.end())
    throw InputError("shard", shards.back(),
                     fmt::format("together the shards contain {} of {} runs", next, file.end()));
  file.finish();
}

std::int64_t run_ensemble(EnsembleFile& file, std::vector<std::unique_ptr<EnsembleWorker>>& workers,
                          const std::function<void(std::int64_t)>& progress) {
  if (file.is_complete()) return 0;
  const std::int64_t first = file.n_done(), last = file.end();
  in_order(
      static_cast<int>(workers.size()), first, last,
      [&](int thread, std::int64_t begin, std::int64_t end) {
        EnsembleWorker& worker = *workers[static_cast<std::size_t>(thread)];
        return worker.csv_lines(begin, end);
      },
      [&](std::int64_t end, const std::string& lines) {
        file.append(end, lines);
        progress(end);
      });
  file.finish();
  return last - first;
}

}  // namespace ricochet
