#include "bench/results_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <filesystem>

#include "problems/input_error.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string key_of(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  const json header = json::parse(line, nullptr, false);
  return header.is_object() ? header.value("key", "") : "";
}

/// Moves a file aside under a name that tells its date and is not taken yet.
void keep_aside(const fs::path& path) {
  const auto changed = std::chrono::file_clock::to_sys(fs::last_write_time(path));
  const std::time_t time =
      std::chrono::system_clock::to_time_t(std::chrono::time_point_cast<std::chrono::system_clock::duration>(changed));
  char date[32];
  std::strftime(date, sizeof date, "%Y%m%d-%H%M%S", std::gmtime(&time));
  fs::path aside = path.parent_path() / fmt::format("{}.{}{}", path.stem().string(), date, path.extension().string());
  for (int k = 2; fs::exists(aside); ++k) {
    aside = path.parent_path() / fmt::format("{}.{}-{}{}", path.stem().string(), date, k, path.extension().string());
  }
  fs::rename(path, aside);
}

// Rows that stand for themselves. Lines of timings that are compared with each other belong to a session that has
// ended: they are measured again.
constexpr std::array kKept = {"header", "row", "seed_run", "scale_run", "hard_cell", "fuzz_scene"};

/// Reads the rows of an interrupted run and cuts the file behind the last complete one.
Results take_over(const std::string& partial) {
  std::vector<std::string> lines;
  {
    std::ifstream file(partial);
    for (std::string line; std::getline(file, line);) {
      const json parsed = json::parse(line, nullptr, false);
      const std::string kind = parsed.is_object() ? parsed.value("kind", "") : "";
      if (std::ranges::find(kKept, kind) == kKept.end()) break;
      lines.push_back(line);
    }
  }
  {
    std::ofstream file(partial, std::ios::trunc);
    for (const auto& line : lines) file << line << "\n";
  }
  return read_results(partial);
}

}  // namespace

ResultsFile::ResultsFile(const std::string& folder, const std::string& name, const json& header)
    : path_((fs::path(folder) / (name + ".jsonl")).string()), partial_(path_ + ".partial") {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw InputError("results folder", folder, error.message());
  const std::string key = header.at("key");
  if (fs::exists(path_)) {
    is_complete_ = key_of(path_) == key;
    if (is_complete_) return;
    keep_aside(path_);
  }
  if (fs::exists(partial_)) {
    if (key_of(partial_) == key)
      taken_over_ = take_over(partial_);
    else
      fs::remove(partial_);  // an unfinished run of a program that is no more
  }
  const bool is_new = !fs::exists(partial_);
  file_.open(partial_, std::ios::app);
  if (!file_) throw InputError("results file", partial_, "cannot be written");
  if (is_new) append(header);
}

void ResultsFile::append(const json& line) {
  file_ << line.dump() << "\n";
  if (!file_.flush()) throw InputError("results file", partial_, "cannot be written");
}

void ResultsFile::finish() {
  append({{"kind", "end"}});
  file_.close();
  fs::rename(partial_, path_);
  is_complete_ = true;
}

}  // namespace ricochet
