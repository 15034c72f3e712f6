#include "methods/external/client_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <ctime>

namespace ricochet {
namespace {

constexpr std::size_t kLastWords = 500;          // characters of standard error that a message shows
constexpr std::size_t kLongest = 1'000'000'000;  // of an answer
constexpr double kFarewell = 0.5;                // [s] for a client to end by itself

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// To write to a client that is gone is an error of write(), not a signal that ends this program.
class PipeSignalBlocked {
 public:
  PipeSignalBlocked() {
    sigemptyset(&pipe_);
    sigaddset(&pipe_, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~PipeSignalBlocked() {
    const timespec at_once{0, 0};
    while (sigtimedwait(&pipe_, nullptr, &at_once) > 0) {
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  PipeSignalBlocked(const PipeSignalBlocked&) = delete;

 private:
  sigset_t pipe_, before_;
};

struct Pipe {
  int ends[2]{-1, -1};
  Pipe() {
    if (pipe2(ends, O_CLOEXEC) != 0)
      throw ClientFailure(Status::inner_solver_failed, fmt::format("no pipe: {}", std::strerror(errno)));
  }
};

void close_file(int& file) {
  if (file >= 0) close(file);
  file = -1;
}

}  // namespace

ClientProcess::~ClientProcess() {
  if (child_ == 0 || owner_ != getpid()) return;
  close_file(in_);  // the end of its input asks it to end
  for (const double deadline = now() + kFarewell; now() < deadline;) {
    if (waitpid(child_, nullptr, WNOHANG) != 0) {
      child_ = 0;
      break;
    }
    usleep(1000);
  }
  if (child_ != 0) kill();
  close_file(out_);
  close_file(errors_);
}

void ClientProcess::kill() {
  if (child_ != 0 && owner_ == getpid()) {
    ::kill(-child_, SIGKILL);  // the shell's children, too
    while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  child_ = 0;
  for (int* file : {&in_, &out_, &errors_}) close_file(*file);
}

void ClientProcess::start() {
  if (child_ != 0) kill();  // of another process: only its pipes are closed here
  Pipe in, out, errors;
  std::fflush(nullptr);
  const char* const command = command_.c_str();
  const pid_t child = fork();
  if (child < 0) throw ClientFailure(Status::inner_solver_failed, fmt::format("no process: {}", std::strerror(errno)));
  if (child == 0) {
    setpgid(0, 0);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    dup2(in.ends[0], STDIN_FILENO);
    dup2(out.ends[1], STDOUT_FILENO);
    dup2(errors.ends[1], STDERR_FILENO);
    execl("/bin/sh", "sh", "-c", command, static_cast<char*>(nullptr));
    _exit(127);
  }
  setpgid(child, child);  // whoever comes first
  for (const int file : {in.ends[0], out.ends[1], errors.ends[1]}) close(file);
  owner_ = getpid();
  child_ = child;
  in_ = in.ends[1];
  out_ = out.ends[0];
  errors_ = errors.ends[0];
  for (const int file : {in_, out_, errors_}) fcntl(file, F_SETFL, O_NONBLOCK);
  read_ahead_.clear();
  last_words_.clear();
  ++starts_;
}

/// Reads the available standard error; of a long text it keeps the end.
void ClientProcess::read_errors() {
  std::array<char, 4096> buffer;
  for (ssize_t n; (n = read(errors_, buffer.data(), buffer.size())) > 0;) {
    last_words_.append(buffer.data(), static_cast<std::size_t>(n));
    if (last_words_.size() > 4 * kLastWords) last_words_.erase(0, last_words_.size() - 2 * kLastWords);
  }
}

/// Until the file is ready, or its other end closed. @return false when the deadline came first
bool ClientProcess::wait_for(int file, short events, double deadline) {
  while (true) {
    std::array<pollfd, 2> waiting{pollfd{file, events, 0}, pollfd{errors_, POLLIN, 0}};
    const double left = deadline - now();
    if (left <= 0) return false;
    const int milliseconds = static_cast<int>(std::min(1000.0, std::ceil(1e3 * left)));
    if (poll(waiting.data(), waiting.size(), milliseconds) < 0 && errno != EINTR) return true;
    if (waiting[1].revents & POLLIN) read_errors();
    if (waiting[0].revents != 0) return true;
    if (waiting[1].revents & (POLLHUP | POLLERR)) {  // closed: no reason to be woken again and again
      pollfd alone{file, events, 0};
      if (poll(&alone, 1, milliseconds) > 0) return true;
    }
  }
}

/// How a client that has closed its output ended.
std::string ClientProcess::ending() {
  int status = 0;
  pid_t ended = 0;
  for (const double deadline = now() + kFarewell; ended == 0 && now() < deadline;) {
    ended = waitpid(child_, &status, WNOHANG);
    if (ended == 0) usleep(1000);
  }
  read_errors();
  std::string text = "it closed its output";
  if (ended > 0) {
    child_ = 0;
    const int code = WEXITSTATUS(status);
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : code > 128 ? code - 128 : 0;  // 128: said by the shell
    text = signal != 0 ? fmt::format("it was ended by a signal, {}", strsignal(signal))
                       : fmt::format("it ended with exit code {}", code);
  }
  while (!last_words_.empty() && std::isspace(static_cast<unsigned char>(last_words_.back()))) last_words_.pop_back();
  if (last_words_.empty()) return text;
  const std::size_t shown = std::min(kLastWords, last_words_.size());
  return text + ": " + last_words_.substr(last_words_.size() - shown);
}

void ClientProcess::write_line(const std::string& line, double deadline) {
  const PipeSignalBlocked blocked;
  const std::string text = line + "\n";
  for (std::size_t done = 0; done < text.size();) {
    if (!wait_for(in_, POLLOUT, deadline)) throw ClientFailure(Status::time_limit, "");
    const ssize_t n = write(in_, text.data() + done, text.size() - done);
    if (n > 0)
      done += static_cast<std::size_t>(n);
    else if (errno != EAGAIN && errno != EINTR)
      throw ClientFailure(Status::inner_solver_failed, "before it was asked, " + ending());
  }
}

std::string ClientProcess::read_line(double deadline) {
  std::array<char, 65536> buffer;
  std::size_t searched = 0;
  while (true) {
    const auto end = read_ahead_.find('\n', searched);
    if (end != std::string::npos) {
      std::string line = read_ahead_.substr(0, end);
      read_ahead_.erase(0, end + 1);
      return line;
    }
    searched = read_ahead_.size();
    if (searched > kLongest) throw ClientFailure(Status::inner_solver_failed, "its answer has no end");
    if (!wait_for(out_, POLLIN, deadline)) throw ClientFailure(Status::time_limit, "");
    const ssize_t n = read(out_, buffer.data(), buffer.size());
    if (n > 0)
      read_ahead_.append(buffer.data(), static_cast<std::size_t>(n));
    else if (n == 0)
      throw ClientFailure(Status::inner_solver_failed, "instead of an answer, " + ending());
  }
}

std::string ClientProcess::ask(const std::string& line, double limit) {
  const double deadline = limit > 0 ? now() + limit : HUGE_VAL;
  try {
    if (child_ == 0 || owner_ != getpid()) start();
    write_line(line, deadline);
    return read_line(deadline);
  } catch (const ClientFailure& failure) {
    kill();
    if (failure.status != Status::time_limit) throw;
    throw ClientFailure(Status::time_limit, fmt::format("no answer within {:.3g} s", limit));
  }
}

}  // namespace ricochet
