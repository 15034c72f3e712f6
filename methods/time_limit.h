#pragma once

#include <fmt/format.h>

#include <chrono>
#include <string>

namespace ricochet {

/// Wall-clock limit of a run. Reading the clock costs as much as a short time step, so it is read every few calls.
class TimeLimit {
 public:
  /// @param seconds  0: no limit
  explicit TimeLimit(double seconds) : seconds_(seconds), begin_(Clock::now()) {}

  bool is_over() const {
    if (seconds_ <= 0 || ++calls_ % 64 != 0) return false;
    return std::chrono::duration<double>(Clock::now() - begin_).count() > seconds_;
  }
  double left() const { return seconds_ - std::chrono::duration<double>(Clock::now() - begin_).count(); }  ///< [s]
  std::string message() const { return fmt::format("the time limit of {:.6g} s is over", seconds_); }

 private:
  using Clock = std::chrono::steady_clock;
  double seconds_;
  Clock::time_point begin_;
  mutable unsigned calls_ = 0;
};

}  // namespace ricochet
