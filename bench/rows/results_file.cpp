#include "bench/rows/results_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <sstream>
#include <stdexcept>

#include "bench/rows/in_order.h"
#include "methods/isolated.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Whether rows with this header can serve as the requested ones: exclusive times require exclusive runs.
bool is_as_good(const json& header, const json& asked) {
  const bool has_times = times_mark(asked) != TimesMark::exclusive || times_mark(header) == TimesMark::exclusive;
  return header.value("key", "") == asked.at("key") && has_times;
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

/// The complete lines of an interrupted run after its header.
std::vector<std::pair<std::string, json>> taken_lines(const std::string& partial) {
  std::vector<std::pair<std::string, json>> lines;
  std::ifstream file(partial);
  std::string text;
  std::getline(file, text);  // the header
  while (std::getline(file, text)) {
    try {
      json line = parse_line(text);
      if (!line.is_object() || !line.contains("kind")) break;
      lines.emplace_back(text, std::move(line));
    } catch (const InputError&) {  // cut off while it was written
      break;
    }
  }
  return lines;
}

}  // namespace

ResultsFile::ResultsFile(const std::string& folder, const std::string& name, json header, bool force)
    : path_((fs::path(folder) / (name + ".jsonl")).string()), partial_(path_ + ".partial"), header_(std::move(header)) {
  if (fs::exists(partial_)) lock();
  const bool is_there = fs::exists(path_), is_same = is_there && is_as_good(read_header(path_), header_);
  is_complete_ = is_same && !force;
  if (is_complete_) {
    message_ = fmt::format("{}: up-to-date results exist; use --force to recompute them", path_);
  } else if (const json begun = read_header(partial_); !force && is_as_good(begun, header_)) {
    taken_ = taken_lines(partial_);
    set_times_mark(header_, std::min(times_mark(header_), times_mark(begun)));
    message_ = fmt::format("{}: {} rows of an interrupted run are reused", path_, taken_.size());
  } else if (is_there && !is_same) {
    message_ = fmt::format(
        "{}: existing results are of another experiment, other files or another program, or lack exclusive times; they are "
        "kept with a date in their name",
        path_);
  }
}

ResultsFile::~ResultsFile() {
  if (lock_ >= 0) ::close(lock_);
}

/// @throws InputError when another process has it
void ResultsFile::lock() {
  if (lock_ < 0) lock_ = locked(partial_);
}

int ResultsFile::locked(const std::string& file) const {
  const int lock = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock < 0) throw InputError("results file", file, "cannot be written");
  struct stat opened {
  }, there{};
  const bool is_ours = ::flock(lock, LOCK_EX | LOCK_NB) == 0 && ::fstat(lock, &opened) == 0 &&
                       ::stat(file.c_str(), &there) == 0 && opened.st_ino == there.st_ino;
  if (is_ours) return lock;
  ::close(lock);
  throw InputError("results file", path_, "another process is writing it; another folder is required (-o)");
}

bool ResultsFile::can_take(const std::string& kind, std::size_t n) {
  bool is_there = next_ + n <= taken_.size();
  for (std::size_t k = next_; is_there && k < next_ + n; ++k) is_there = taken_[k].second["kind"] == kind;
  if (!is_there) taken_.resize(next_);
  return is_there;
}

void ResultsFile::open() {
  std::error_code error;
  const fs::path folder = fs::path(path_).parent_path();
  fs::create_directories(folder, error);
  if (error) throw InputError("results folder", folder.string(), error.message());
  lock();
  if (fs::exists(path_)) keep_aside(path_);
  // Rows are copied to a file of their own before the old file is removed: an interruption loses no row. Rows of another
  // program are discarded.
  const std::string fresh = partial_ + ".new";
  const int fresh_lock = locked(fresh);
  file_.open(fresh, std::ios::trunc);
  file_ << header_.dump() << "\n";
  for (const auto& [text, line] : taken_) file_ << text << "\n";
  if (!file_.flush()) {
    ::close(fresh_lock);
    throw InputError("results file", fresh, "cannot be written");
  }
  fs::rename(fresh, partial_);
  ::close(lock_);
  lock_ = fresh_lock;
}

void ResultsFile::append(const json& line) {
  if (!file_.is_open()) open();
  if (observer_) observer_(line);
  file_ << line.dump() << "\n";
  if (!file_.flush()) throw InputError("results file", partial_, "cannot be written");
}

std::vector<json> ResultsFile::lines_in_shards(std::size_t piece) const {
  const auto lines = shards_->find(first_piece_ + piece);
  return lines == shards_->end() ? std::vector<json>() : lines->second;  // a piece may have no rows
}

void ResultsFile::make_elsewhere(const std::vector<std::size_t>& todo,
                                 const std::function<std::string(std::size_t piece)>& lines_of_piece,
                                 const std::function<void(const json& line)>& take,
                                 const std::function<void(std::size_t piece)>& done) {
  if (todo.empty()) return;
  // Processes and not threads: GiNaC and Ipopt's linear solver have state that threads would share.
  const auto make = [&](int, std::int64_t first, std::int64_t last) {
    const auto work = [&] {
      std::string lines;
      for (auto k = first; k < last; ++k) lines += lines_of_piece(todo[static_cast<std::size_t>(k)]);
      return lines;
    };
    IsolatedResult result = run_isolated(work, kNoLimit);
    if (result.ending != IsolatedResult::Ending::returned)
      throw std::runtime_error(fmt::format("{}: a process that computed rows ended: {}", path_, result.text));
    return std::move(result.text);
  };
  std::size_t next = 0;
  in_order(processes_, 0, static_cast<std::int64_t>(todo.size()), make,
           [&](std::int64_t last, const std::string& lines) {
             std::istringstream stream(lines);
             for (std::string text; std::getline(stream, text);) {
               const json line = parse_line(text);
               append(line);
               take(line);
             }
             for (; next < static_cast<std::size_t>(last); ++next) done(todo[next]);
           });
}

void ResultsFile::finish() {
  taken_.resize(next_);
  if (!file_.is_open()) open();
  file_ << R"({"kind":"end"})"
        << "\n";
  if (!file_.flush()) throw InputError("results file", partial_, "cannot be written");
  file_.close();
  fs::rename(partial_, path_);
  is_complete_ = true;
}

}  // namespace ricochet
