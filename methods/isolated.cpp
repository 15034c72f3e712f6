#include "methods/isolated.h"

#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <stdexcept>

namespace ricochet {
namespace {

using Clock = std::chrono::steady_clock;
constexpr long kLongestPoll = 60'000;  // [ms]; poll() takes an int
constexpr int kThrew = 70;             // exit code of a child whose work threw; its text is then that of the exception

[[noreturn]] void run_child(const std::function<std::string()>& work, int out) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // nobody waits for it then, and it would keep locks of files
  std::string text;
  int code = 0;
  try {
    text = work();
  } catch (const std::exception& error) {
    text = error.what();
    code = kThrew;
  }
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t n = write(out, text.data() + done, text.size() - done);
    if (n < 0 && errno != EINTR) break;
    if (n > 0) done += static_cast<std::size_t>(n);
  }
  _exit(code);  // the parent's buffers and destructors are not the child's
}

/// Reads until the other end is closed. @return false when `deadline` came first
bool read_all(int in, Clock::time_point deadline, std::string& text) {
  std::array<char, 4096> buffer;
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) return false;
    pollfd waiting{in, POLLIN, 0};
    if (poll(&waiting, 1, static_cast<int>(std::min(left, kLongestPoll))) <= 0) continue;
    const ssize_t n = read(in, buffer.data(), buffer.size());
    if (n == 0) return true;
    if (n > 0) text.append(buffer.data(), static_cast<std::size_t>(n));
  }
}

}  // namespace

IsolatedResult run_isolated(const std::function<std::string()>& work, double seconds) {
  static std::mutex between_pipe_and_close;
  std::unique_lock lock(between_pipe_and_close);  // a child of another thread would keep this pipe open
  std::array<int, 2> ends;
  if (pipe(ends.data()) != 0) throw std::runtime_error(std::string("no pipe: ") + std::strerror(errno));
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error(std::string("no process: ") + std::strerror(errno));
  if (child == 0) {
    lock.unlock();  // it is the child's now, which may have children of its own
    close(ends[0]);
    run_child(work, ends[1]);
  }
  close(ends[1]);
  lock.unlock();
  const auto deadline =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  IsolatedResult result;
  const bool has_ended = read_all(ends[0], deadline, result.text);
  close(ends[0]);
  if (!has_ended) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!has_ended) return {IsolatedResult::Ending::killed, ""};
  if (WIFSIGNALED(status)) return {IsolatedResult::Ending::crashed, strsignal(WTERMSIG(status))};
  if (WEXITSTATUS(status) != 0) return {IsolatedResult::Ending::crashed, result.text};
  return result;
}

}  // namespace ricochet
