#include "bench/rows/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace ricochet {
namespace {

constexpr std::chrono::milliseconds kPauseInFile(30000);

}  // namespace

Progress::Progress(std::string title)
    : title_(std::move(title)), is_terminal_(isatty(STDERR_FILENO) != 0), begin_(Clock::now()), last_(begin_) {}

void Progress::update(double share, const std::string& what) {
  const auto now = Clock::now();
  const auto pause = is_terminal_ ? std::chrono::milliseconds(100) : kPauseInFile;
  if (is_terminal_ ? share < 1 && is_shown_ && now - last_ < pause : now - last_ < pause) return;
  last_ = now;
  is_shown_ = is_terminal_;
  const double spent = std::chrono::duration<double>(now - begin_).count();
  const std::string left = share > 0.02 ? fmt::format("{:.0f} s left", spent * (1 - share) / share) : "";
  if (is_terminal_)
    fmt::print(stderr, "\r\033[K{} {:3.0f} %  {:<12} {}", title_, 100 * share, left, what);
  else
    fmt::print(stderr, "{} {:3.0f} %  {:<12} {}\n", title_, 100 * share, left, what);
  std::fflush(stderr);
}

void Progress::finish() {
  if (is_shown_) fmt::print(stderr, "\r\033[K");
  std::fflush(stderr);
  is_shown_ = false;
}

}  // namespace ricochet
