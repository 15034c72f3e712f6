#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>

#include "methods/external/client_process.h"
#include "methods/method.h"

namespace ricochet {

/// Properties that a client reports of itself.
struct ClientGreeting {
  std::string title, source;
  double order_smooth = 0, order_impacts = 0;
  bool is_adaptive = false;
  std::set<std::string> features;  ///< what scenes may have: "friction_2d", "friction_3d", "bilateral", "time", ...
};

/// The line protocol of README.md with one client. For many threads, whose requests are served in turn.
class ExternalClient {
 public:
  /// The living client of a command; methods with the same command share it.
  static std::shared_ptr<ExternalClient> of(const std::string& command);

  explicit ExternalClient(const std::string& command) : process_(command) {}

  /// Requested once. @throws InputError without an answer, or for one that violates the protocol
  const ClientGreeting& greeting();

  /// Every failure is returned as a status with its reason. @param seed  for clients that draw random numbers
  Solution solve(const Problem& problem, const Settings& settings, int seed);

 private:
  nlohmann::json ask(nlohmann::json question, double limit);
  void send_scene(const Problem& problem, double limit);

  std::mutex mutex_;
  ClientProcess process_;
  std::unique_ptr<ClientGreeting> greeting_;
  std::string scene_;     // that the client has
  int scene_start_ = -1;  // of the process that has it
  std::int64_t last_id_ = 0;
};

}  // namespace ricochet
