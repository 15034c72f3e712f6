#pragma once

#include <functional>
#include <string>

namespace ricochet {

/// How work in a process of its own ended.
struct IsolatedResult {
  enum class Ending { returned, killed, crashed };
  Ending ending = Ending::returned;
  std::string text;  ///< what the work returned; of a crash, the signal or the exception
};

/// Practically no limit [s]: thirty years.
inline constexpr double kNoLimit = 1e9;

/// Runs `work` in a child process, so that neither a crash nor an endless loop in it can reach this one. May be called
/// from several threads.
/// @param seconds  wall time after which the child is killed
/// @throws std::runtime_error when the system gives no process
IsolatedResult run_isolated(const std::function<std::string()>& work, double seconds);

}  // namespace ricochet
