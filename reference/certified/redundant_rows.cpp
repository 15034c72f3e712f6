#include "reference/certified/redundant_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ricochet::reference::certified {
namespace {

/// The entry with a sign in the row with the fewest entries, so that exact zeros remain, and there the largest one.
std::pair<int, int> next_pivot(const BallMatrix& rows, const std::vector<char>& is_used) {
  std::pair<int, int> best{-1, -1};
  std::ptrdiff_t fewest = std::numeric_limits<std::ptrdiff_t>::max();
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (is_used[r]) continue;
    const auto entries = std::ranges::count_if(rows[r], [](const Ball& x) { return !x.is_zero(); });
    if (entries >= fewest) continue;
    double largest = 0;
    for (std::size_t c = 0; c < rows[r].size(); ++c) {
      const double size = std::abs(rows[r][c].nearest());
      if (rows[r][c].sign() == Sign::unknown || size <= largest) continue;
      largest = size;
      fewest = entries;
      best = {static_cast<int>(r), static_cast<int>(c)};
    }
  }
  return best;
}

}  // namespace

std::vector<int> locked_coordinates(BallMatrix rows, const Precision& a) {
  std::vector<char> is_used(rows.size(), 0);
  std::vector<std::pair<int, int>> pivots;
  for (auto [r, c] = next_pivot(rows, is_used); r >= 0; std::tie(r, c) = next_pivot(rows, is_used)) {
    is_used[r] = 1;
    pivots.emplace_back(r, c);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (static_cast<int>(i) == r || rows[i][c].is_zero()) continue;
      const Ball factor = a.div(rows[i][c], rows[r][c]);
      for (std::size_t k = 0; k < rows[i].size(); ++k) rows[i][k] = a.sub(rows[i][k], a.mul(factor, rows[r][k]));
      rows[i][c] = Ball();
    }
  }
  std::vector<int> locked;
  for (const auto& [r, c] : pivots) {
    if (!leaves(rows[r], {c})) locked.push_back(c);
  }
  std::ranges::sort(locked);
  return locked;
}

bool leaves(const std::vector<Ball>& row, const std::vector<int>& columns) {
  for (std::size_t k = 0; k < row.size(); ++k) {
    if (!row[k].is_zero() && std::ranges::count(columns, static_cast<int>(k)) == 0) return true;
  }
  return false;
}

LinearForm opposite(LinearForm form) {
  for (Ball& x : form.along) x = -x;
  form.constant = -form.constant;
  return form;
}

std::optional<RedundantRow> RedundantRow::without(const BallMatrix& A, const std::vector<Ball>& b, std::size_t j,
                                                  const Precision& precision) {
  BallMatrix rest, right;
  for (std::size_t r = 0; r < A.size(); ++r) {
    if (r == j) continue;
    rest.emplace_back();
    for (std::size_t c = 0; c < A.size(); ++c) {
      if (c != j) rest.back().push_back(A[r][c]);
    }
    right.push_back({b[r], -A[r][j]});
  }
  const auto solution = solve(rest, right, precision.bits);
  if (!solution) return std::nullopt;
  RedundantRow system(precision);
  for (const auto& row : *solution) {
    system.y0_.push_back(row[0]);
    system.y1_.push_back(row[1]);
  }
  const auto at = static_cast<std::ptrdiff_t>(j);
  system.y0_.insert(system.y0_.begin() + at, Ball());
  system.y1_.insert(system.y1_.begin() + at, Ball(1.0));
  system.left_out_ = {A[j], -b[j]};
  return system;
}

RedundantRow::Line RedundantRow::line_of(const LinearForm& form) const {
  Line line{form.constant, {}};
  for (std::size_t k = 0; k < form.along.size(); ++k) {
    line.a = a_.add(line.a, a_.mul(form.along[k], y0_[k]));
    line.b = a_.add(line.b, a_.mul(form.along[k], y1_[k]));
  }
  return line;
}

RedundantRow::Range RedundantRow::range(const std::vector<LinearForm>& forms) const {
  Range range;
  for (const LinearForm& form : forms) {
    const auto [a, b] = line_of(form);
    if (b.sign() == Sign::unknown) continue;
    const Ball bound = -a_.div(a, b);
    auto& side = b.sign() == Sign::positive ? range.least : range.most;
    const bool is_tighter =
        !side || (b.sign() == Sign::positive ? bound.nearest() > side->nearest() : bound.nearest() < side->nearest());
    if (is_tighter) side = bound;
  }
  return range;
}

bool RedundantRow::is_refuted(const std::vector<LinearForm>& forms) const {
  const auto [least, most] = range(forms);
  if (least && most && arb_gt(least->get(), most->get())) return true;
  std::vector<LinearForm> all = forms;
  all.push_back(left_out_);
  all.push_back(opposite(left_out_));
  for (const LinearForm& form : all) {
    const auto [a, b] = line_of(form);
    const bool is_bounded = least && most;
    if (!is_bounded && !b.is_zero()) continue;
    const Ball change = is_bounded ? a_.mul(b, a_.hull(*least, *most)) : Ball();
    if (a_.add(a, change).sign() == Sign::negative) return true;
  }
  return false;
}

Ball RedundantRow::middle(const std::vector<LinearForm>& forms) const {
  const auto [least, most] = range(forms);
  if (least && most) return a_.mul(Ball(0.5), a_.add(*least, *most)).midpoint();
  if (least || most) return a_.add(least ? *least : *most, Ball(least ? 1.0 : -1.0)).midpoint();
  return {};
}

std::optional<std::vector<Ball>> RedundantRow::feasible(const std::vector<LinearForm>& forms) const {
  const Ball z = middle(forms);
  for (const LinearForm& form : forms) {
    const auto [a, b] = line_of(form);
    const Ball value = a_.add(a, a_.mul(b, z));
    if (value.sign() != Sign::positive && !value.is_zero()) return std::nullopt;
  }
  std::vector<Ball> y;
  for (std::size_t k = 0; k < y0_.size(); ++k) y.push_back(a_.add(y0_[k], a_.mul(y1_[k], z)));
  return y;
}

std::vector<Ball> RedundantRow::hull(const std::vector<LinearForm>& forms) const {
  const auto [least, most] = range(forms);
  Ball z;
  if (least && most) {
    z = a_.hull(*least, *most);
  } else {
    arb_zero_pm_inf(z.get());
  }
  std::vector<Ball> y;
  for (std::size_t k = 0; k < y0_.size(); ++k)
    y.push_back(y1_[k].is_zero() ? y0_[k] : a_.add(y0_[k], a_.mul(y1_[k], z)));
  return y;
}

}  // namespace ricochet::reference::certified
