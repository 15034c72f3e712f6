#pragma once

namespace ricochet {

/// Predictions that the search for one step may still try.
class SearchBudget {
 public:
  explicit SearchBudget(int allowed) : allowed_(allowed) {}

  /// Takes one prediction; false when there is none left.
  bool spend() { return ++spent_ <= allowed_; }
  int spent() const { return spent_; }
  void renew() { spent_ = 0; }
  void exhaust() { spent_ = allowed_; }

 private:
  int allowed_;
  int spent_ = 0;
};

}  // namespace ricochet
