#pragma once

#include <chrono>
#include <string>

namespace ricochet {

/// A line on the terminal with the progress and the remaining time of long work. If stderr is a file, a new line every
/// half minute.
class Progress {
 public:
  explicit Progress(std::string title);
  ~Progress() { finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(double share, const std::string& what);
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  std::string title_;
  bool is_terminal_, is_shown_ = false;
  Clock::time_point begin_, last_;
};

}  // namespace ricochet
