#include "bench/rows/in_order.h"

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

namespace ricochet {
namespace {

// So many pieces for every thread, that the last ones end at about the same time, unless they become larger than a
// piece that costs a lock and a write of the file nothing.
constexpr std::int64_t kPiecesPerThread = 64, kLargestPiece = 64;
// Pieces that are finished before one that is not: they are kept in memory.
constexpr std::size_t kMostWaiting = 4096;

/// The pieces, and what the threads share.
class Pieces {
 public:
  using Take = std::function<void(std::int64_t end, const std::string& made)>;

  Pieces(std::int64_t begin, std::int64_t end, std::int64_t size, const Take& take)
      : next_(begin), taken_(begin), end_(end), size_(size), take_(take) {}

  /// @returns false when there is nothing left, or an exception has ended the work
  bool next(std::int64_t& begin, std::int64_t& end) {
    std::unique_lock lock(mutex_);
    has_room_.wait(lock, [&] { return waiting_.size() < kMostWaiting || error_; });
    if (next_ >= end_ || error_) return false;
    begin = next_;
    end = next_ = std::min(next_ + size_, end_);
    return true;
  }

  void finish(std::int64_t begin, std::int64_t end, std::string made) {
    const std::lock_guard lock(mutex_);
    waiting_[begin] = {end, std::move(made)};
    while (!waiting_.empty() && waiting_.begin()->first == taken_ && !error_) {
      const auto& [its_end, text] = waiting_.begin()->second;
      take_(its_end, text);
      taken_ = its_end;
      waiting_.erase(waiting_.begin());
    }
    has_room_.notify_all();
  }

  void fail(std::exception_ptr error) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = std::move(error);
    has_room_.notify_all();
  }

  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  std::mutex mutex_;
  std::condition_variable has_room_;
  std::int64_t next_, taken_, end_, size_;
  std::map<std::int64_t, std::pair<std::int64_t, std::string>> waiting_;  ///< by their begin
  const Take& take_;
  std::exception_ptr error_;
};

}  // namespace

void in_order(int threads, std::int64_t begin, std::int64_t end,
              const std::function<std::string(int thread, std::int64_t begin, std::int64_t end)>& make,
              const std::function<void(std::int64_t end, const std::string& made)>& take) {
  const std::int64_t size = std::clamp<std::int64_t>((end - begin) / (threads * kPiecesPerThread), 1, kLargestPiece);
  Pieces pieces(begin, end, size, take);
  const auto work = [&](int thread) {
    try {
      for (std::int64_t from = 0, to = 0; pieces.next(from, to);) pieces.finish(from, to, make(thread, from, to));
    } catch (...) {
      pieces.fail(std::current_exception());
    }
  };
  std::vector<std::jthread> others;
  for (int k = 1; k < threads; ++k) others.emplace_back(work, k);
  work(0);
  others.clear();  // joins
  pieces.rethrow();
}

}  // namespace ricochet
