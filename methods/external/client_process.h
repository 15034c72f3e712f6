#pragma once

#include <sys/types.h>

#include <stdexcept>
#include <string>

#include "problems/solution.h"

namespace ricochet {

/// Reason why an answer of a client is missing.
struct ClientFailure : std::runtime_error {
  ClientFailure(Status which, const std::string& what) : std::runtime_error(what), status(which) {}
  Status status;  ///< time_limit or inner_solver_failed
};

/// A user's program that reads lines and replies to each with a line. The shell starts it at the first request; it
/// stays alive between requests and is restarted after a failure. For one thread at a time; a fork of this process has
/// a client of its own.
class ClientProcess {
 public:
  explicit ClientProcess(std::string command) : command_(std::move(command)) {}
  ~ClientProcess();
  ClientProcess(const ClientProcess&) = delete;

  /// @param line  without its end @param limit  [s] of wall time; 0: none
  /// @throws ClientFailure, and the client is gone: it ended (the message quotes its standard error), timed out, or
  /// could not be started
  std::string ask(const std::string& line, double limit);

  /// Number of starts: a new client has none of the scenes that were sent before.
  int starts() const { return starts_; }
  /// Ends the client, after an answer that violates the protocol.
  void kill();

 private:
  void start();
  void write_line(const std::string& line, double deadline);
  std::string read_line(double deadline);
  bool wait_for(int file, short events, double deadline);
  void read_errors();
  std::string ending();

  const std::string command_;
  pid_t owner_ = 0, child_ = 0;
  int in_ = -1, out_ = -1, errors_ = -1;  // the client's standard input, output, error
  std::string read_ahead_, last_words_;
  int starts_ = 0;
};

}  // namespace ricochet
