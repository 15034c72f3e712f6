#include "methods/contact_laws/load_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "methods/contact_laws/bernstein.h"
#include "methods/contact_laws/force_spans.h"

namespace ricochet {
namespace {

constexpr double kShortest = 1e-9;    // of a path
constexpr double kLeastWidth = 1e-9;  // of a coordinate or velocity in a wide box, as a part of its size
// Up to this part of a path a function that begins at zero may be wrong by this part of its value there.
constexpr double kBegin = 0.125, kOfBegin = 0.01;

}  // namespace

LoadSearch::LoadSearch(const Problem& problem, int degree)
    : problem_(problem),
      info_(problem.info()),
      degree_(degree),
      forces_(problem),
      wide_box_(static_cast<std::size_t>(2 * problem.n_q())),
      coordinates_(static_cast<std::size_t>(2 * problem.n_q())) {
  std::iota(coordinates_.begin(), coordinates_.end(), 0);
  const auto n = static_cast<std::size_t>(2 * info_.n_q), n_c = info_.contacts.size();
  path_.setZero(2 * info_.n_q, degree + 1);
  piece_size_ = n * static_cast<std::size_t>(degree + 1);
  data_.resize(piece_size_ * (kDeepest + 2));
  pieces_.reserve(kDeepest + 2);
  for (auto* box : {&box_, &path_box_}) box->assign(n, Interval(0.0));
  middle_.setZero(2 * info_.n_q);
  turning_.reserve(n_c);
  J_t_.assign(static_cast<std::size_t>(info_.n_tangent_entries), Interval(0.0));
  affine_J_t_.setZero(info_.n_tangent_entries);
  if (info_.has_friction()) problem.tangent_jacobian(info_.q0.data(), affine_J_t_.data());
  force_uses_time_ = ForceSpans::uses_time(problem);
  functions_.reserve(2 * n_c);
  for (auto* flags : {&has_fallen_, &is_far_, &is_skipped_}) flags->reserve(2 * n_c);
  for (auto* numbers : {&clear_until_, &lower_, &slack_, &begin_slack_}) numbers->reserve(2 * n_c);
}

void LoadSearch::set_modes(std::span<const ContactMode> modes) {
  forces_.set_modes(modes);
  functions_.clear();
  is_far_.clear();
  turning_.clear();
  for (std::size_t i = 0; i < modes.size(); ++i) {
    if (is_slipping(modes[i]) && !info_.contacts[i].is_affine) turning_.push_back(static_cast<int>(i));
  }
  wide_box_.restart();
}

void LoadSearch::hold_direction(int contact, const double* d) {
  forces_.hold_direction(contact, d);
  wide_box_.forget();
}

bool LoadSearch::depends_on_time() const {
  const auto moves = [&](int i) { return info_.contacts[i].is_moving && !info_.contacts[i].is_affine; };
  return force_uses_time_ || std::ranges::any_of(forces_.closed(), moves);
}

bool LoadSearch::is_known_at(const double* q, const double* v) {
  for (int k = 0; k < info_.n_q; ++k) {
    box_[k] = q[k];
    box_[info_.n_q + k] = v[k];
  }
  return forces_.evaluate(box_.data(), box_.data() + info_.n_q, q, v);
}

bool LoadSearch::is_polynomial(const Function& f) const {
  return f.kind == SwitchKind::slip_stops && info_.contacts[f.contact].is_affine;
}

bool LoadSearch::needs_boxes() const {
  return std::ranges::any_of(functions_, [&](const Function& f) { return !is_polynomial(f); });
}

/// (3) of an affine contact, over a piece.
Interval LoadSearch::slip_polynomial(const Function& f, const double* b, Layout layout) const {
  const auto& contact = info_.contacts[f.contact];
  const double* b_v = b + info_.n_q * layout.of_coordinate;
  double g[bernstein::kMaxDegree + 1];
  std::fill(g, g + degree_ + 1, -f.v_stop);
  const double* J = affine_J_t_.data() + contact.tangent_begin;
  for (int d = 0; d < contact.n_t; ++d) {
    for (const int k : contact.support) {
      const double entry = f.direction[d] * *J++;
      const double* of_k = b_v + k * layout.of_coordinate;
      for (int j = 0; j <= degree_; ++j) g[j] += entry * of_k[j * layout.of_degree];
    }
  }
  return bernstein::range(g, degree_);
}

/// Bounds of a function over the box that set_boxes() or set_point() has made.
Interval LoadSearch::bounds(const Function& f) {
  const Interval* q = box_.data();
  const Interval* v = q + info_.n_q;
  if (f.kind != SwitchKind::slip_stops) {
    if (!has_forces_) {
      for (Eigen::Index k = 0; k < middle_.size(); ++k) middle_[k] = box_[k].middle();
      knows_forces_ = forces_.evaluate(q, v, middle_.data(), middle_.data() + info_.n_q);
    }
    has_forces_ = true;
    if (!knows_forces_) return Interval::whole();
    return f.kind == SwitchKind::force_vanishes ? forces_.normal_force(f.contact) : forces_.cone_margin(f.contact);
  }
  const auto& contact = info_.contacts[f.contact];
  if (!contact.is_affine && !has_tangents_) problem_.tangent_bounds(turning_, q, J_t_.data());
  has_tangents_ = has_tangents_ || !contact.is_affine;
  Interval speed = -f.v_stop;
  int entry = contact.tangent_begin;
  for (int d = 0; d < contact.n_t; ++d) {
    Interval sum = 0.0;
    for (const int k : contact.support) {
      sum += (contact.is_affine ? Interval(affine_J_t_[entry]) : J_t_[entry]) * v[k];
      ++entry;
    }
    speed += Interval(f.direction[d]) * sum;
  }
  return speed;
}

void LoadSearch::set_boxes(const double* b) {
  for (std::size_t k = 0; k < box_.size(); ++k) box_[k] = bernstein::range(b + k * (degree_ + 1), degree_);
  has_forces_ = has_tangents_ = false;
}

void LoadSearch::set_point(const double* b, double s) {
  for (std::size_t k = 0; k < box_.size(); ++k) box_[k] = bernstein::value(b + k * (degree_ + 1), 1, degree_, s);
  has_forces_ = has_tangents_ = false;
}

/// Whether no function needs a closer look in a piece that ends at `to`.
bool LoadSearch::is_clear(const double* b, double to) {
  bool has_boxes = false, all_are = true;
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    const Function& f = functions_[k];
    if (is_skipped_[k] || clear_until_[k] >= to) continue;
    bool is_clear = is_polynomial(f) && slip_polynomial(f, b, {degree_ + 1, 1}).lower >= -allowed(k, to);
    if (!is_clear && !is_polynomial(f)) {
      if (!has_boxes) set_boxes(b);
      has_boxes = true;
      is_clear = bounds(f).lower >= -allowed(k, to);
    }
    if (is_clear) clear_until_[k] = to;
    all_are = all_are && is_clear;
  }
  return all_are;
}

/// Whether a function is below zero at s of a piece, which is `at` of the path.
bool LoadSearch::falls_at(const double* b, double s, double at) {
  set_point(b, s);
  bool one_does = false;
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    const Function& f = functions_[k];
    has_fallen_[k] = !is_skipped_[k] && clear_until_[k] < at && bounds(f).upper < -allowed(k, at);
    one_does = one_does || has_fallen_[k];
  }
  return one_does;
}

/// The functions that are positive in a new wide box.
void LoadSearch::prove_wide_box() {
  box_ = wide_box_.box();
  has_forces_ = has_tangents_ = false;
  bool one_is = false, all_are = true;
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    const Function& f = functions_[k];
    const bool turns = f.kind == SwitchKind::slip_stops && info_.contacts[f.contact].n_t == 2;  // its direction does
    is_far_[k] = !is_polynomial(f) && !turns && bounds(f).lower >= 0;
    one_is = one_is || is_far_[k];
    all_are = all_are && (is_far_[k] || is_polynomial(f));
  }
  wide_box_.learn(one_is, all_are);
}

void LoadSearch::begin_path() {
  is_far_.resize(functions_.size(), 0);
  has_fallen_.assign(functions_.size(), 0);
  clear_until_.assign(functions_.size(), -1);
  for (auto* numbers : {&lower_, &slack_}) numbers->resize(functions_.size());
  begin_slack_.assign(functions_.size(), 0);
  for (std::size_t k = 0; k < functions_.size(); ++k) slack_[k] = functions_[k].slack;
  if (!needs_boxes()) return;
  for (std::size_t k = 0; k < path_box_.size(); ++k)
    path_box_[k] = bernstein::range(path_.data() + k, degree_, path_.rows());
  const auto extend = [&](int k, const Interval& range, double more) {
    more += kLeastWidth * range.magnitude();
    return Interval(k == info_.clock ? range.lower : range.lower - more, range.upper + more);
  };
  const bool is_new = wide_box_.follow(path_box_, coordinates_, extend);
  if (!wide_box_.exists()) std::ranges::fill(is_far_, 0);
  if (is_new) prove_wide_box();
}

double LoadSearch::allowed(std::size_t function, double to) const {
  return to <= kBegin ? std::max(slack_[function], begin_slack_[function]) : slack_[function];
}

/// The slacks of functions that are zero at the left end. @param b  the path up to s = `end`
void LoadSearch::allow_begin(const double* b, double end) {
  bool one_is_zero = false;
  set_point(b, 0);
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    if (clear_until_[k] > 0 || is_skipped_[k]) continue;
    const double left = bounds(functions_[k]).middle();
    begin_slack_[k] = left <= slack_[k] ? 1 : 0;
    one_is_zero = one_is_zero || begin_slack_[k] > 0;
    slack_[k] = std::max(slack_[k], -2 * left);
  }
  if (!one_is_zero) return;
  set_point(b, std::min(1.0, kBegin / end));
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    if (begin_slack_[k] > 0) begin_slack_[k] = kOfBegin * bounds(functions_[k]).magnitude();
  }
}

double LoadSearch::value(std::size_t function, double s) {
  for (std::size_t k = 0; k < box_.size(); ++k) box_[k] = bernstein::value(path_.data() + k, path_.rows(), degree_, s);
  has_forces_ = has_tangents_ = false;
  return bounds(functions_[function]).middle();
}

/// The cheap test, along the whole path. Functions that are far are clear; so are polynomials with a sufficient lower
/// bound.
bool LoadSearch::is_clear_at_once() {
  bool all_are = true;
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    if (is_far_[k]) continue;
    const Function& f = functions_[k];
    if (is_polynomial(f)) lower_[k] = slip_polynomial(f, path_.data(), {1, path_.rows()}).lower;
    const bool is_clear = is_polynomial(f) && lower_[k] >= -f.slack;
    if (is_clear) clear_until_[k] = 1;
    all_are = all_are && is_clear;
  }
  return all_are;
}

LoadSearch::Fall LoadSearch::first_fall(double end) {
  begin_path();
  is_skipped_ = is_far_;
  if (is_clear_at_once()) return {};
  return search(end);
}

bool LoadSearch::is_near_zero() {
  bool one_may_be = false;
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    const Function& f = functions_[k];
    const bool is_asked = is_polynomial(f) && f.error > f.slack && lower_[k] < f.error;
    is_skipped_[k] = !is_asked;
    slack_[k] = -f.error;
    begin_slack_[k] = 0;
    clear_until_[k] = -1;
    one_may_be = one_may_be || is_asked;
  }
  if (!one_may_be) return false;
  const Fall nearest = search(1);
  return nearest && nearest.to < 1;
}

/// Time for which all functions that are negative at `from` stay below zero, to a factor of two.
double LoadSearch::duration(double from) {
  double length = 1 - from;
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    if (!has_fallen_[k]) continue;
    while (length > kShortest && value(k, from + length) > 0) length *= 0.5;
  }
  return length;
}

LoadSearch::Fall LoadSearch::search(double end) {
  const int rows = 2 * info_.n_q;
  double* whole = coefficients(0);
  for (int k = 0; k < rows; ++k) {
    for (int j = 0; j <= degree_; ++j) *whole++ = path_(k, j);
  }
  if (end < 1) bernstein::keep_left(rows, degree_, end, coefficients(0));
  pieces_.assign(1, {0, end, 0, false});
  int shown_depth = -1;  // of the first piece that showed a change of sign
  for (int n = 0; !pieces_.empty(); ++n) {
    const Piece piece = pieces_.back();
    double* b = coefficients(pieces_.size() - 1);
    if (is_clear(b, piece.to)) {
      pieces_.pop_back();
      continue;
    }
    if (n == 0) allow_begin(b, end);
    const bool ends_at_zero = end < 1 && piece.to == end;
    const bool may_be_deep = n < kMaxPieces && (!has_forces_ || knows_forces_);
    const int deepest = piece.falls    ? std::min(shown_depth + kRootDepth, kDeepest)
                        : ends_at_zero ? kRootDepth
                        : may_be_deep  ? kDeepest
                                       : kSampledDepth;
    if (piece.depth >= deepest) {
      if (!ends_at_zero && falls_at(b, 1, piece.to)) return {piece.from, piece.to, duration(piece.to), true};
      pieces_.pop_back();
      continue;
    }
    const double middle = 0.5 * (piece.from + piece.to);
    const bool falls = falls_at(b, 0.5, middle);
    double* left = coefficients(pieces_.size());
    bernstein::halve(rows, degree_, b, left);
    if (falls) {
      if (shown_depth < 0) shown_depth = piece.depth + 1;
      std::copy(left, left + piece_size_, coefficients(0));
      pieces_.assign(1, {piece.from, middle, piece.depth + 1, true});
    } else {
      pieces_.back() = {middle, piece.to, piece.depth + 1, piece.falls};
      pieces_.push_back({piece.from, middle, piece.depth + 1, false});
    }
  }
  return {};
}

}  // namespace ricochet
