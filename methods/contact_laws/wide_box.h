#pragma once

#include <algorithm>
#include <vector>

#include "problems/interval.h"

namespace ricochet {

/// A box around that of a path, several times wider. What is proven in it costs nothing as long as later paths stay
/// inside. It becomes wider if everything was proven in the last box, and narrower if nothing was; then the next few
/// paths have no box.
class WideBox {
 public:
  explicit WideBox(std::size_t size) : box_(size, Interval(0.0)) {}

  void restart() {
    exists_ = false;
    growth_ = kFirstGrowth;
    pause_ = last_pause_ = 0;
  }
  void forget() { exists_ = false; }
  bool exists() const { return exists_; }
  const std::vector<Interval>& box() const { return box_; }

  /// For the next path. @param path  its box @param watched  coordinates that count
  /// @param extend  (k, range, more) -> the wide range of coordinate k, `more` wider on either side
  /// @return whether there is a new box, in which nothing is proven yet
  bool follow(const std::vector<Interval>& path, const std::vector<int>& watched, const auto& extend) {
    if (exists_ && std::ranges::all_of(watched, [&](int k) { return box_[k].contains(path[k]); })) return false;
    exists_ = pause_ == 0;
    if (!exists_) {
      --pause_;
      return false;
    }
    for (const int k : watched) box_[k] = extend(k, path[k], growth_ * path[k].width());
    return true;
  }
  bool follow(const std::vector<Interval>& path, const std::vector<int>& watched) {
    return follow(path, watched, [](int, const Interval& range, double more) {
      return Interval(range.lower - more, range.upper + more);
    });
  }
  /// After the proofs in a new box: whether any, and whether all of them, succeeded.
  void learn(bool any, bool all) {
    if (all) growth_ = std::min(2 * growth_, kMostGrowth);
    if (!any) growth_ = std::max(0.5 * growth_, kLeastGrowth);
    pause_ = last_pause_ = any ? 0 : std::min(2 * last_pause_ + 1, kMostPause);
  }

 private:
  static constexpr double kFirstGrowth = 4, kLeastGrowth = 0.25, kMostGrowth = 64;  // in widths of the path's box
  static constexpr int kMostPause = 15;

  std::vector<Interval> box_;
  bool exists_ = false;
  double growth_ = kFirstGrowth;
  int pause_ = 0, last_pause_ = 0;  // paths without a box
};

}  // namespace ricochet
