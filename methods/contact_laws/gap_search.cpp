#include "methods/contact_laws/gap_search.h"

#include <algorithm>
#include <cmath>

#include "methods/contact_laws/bernstein.h"
#include "methods/contact_laws/falling_zero.h"
#include "problems/packed_column.h"

namespace ricochet {
GapSearch::GapSearch(const Problem& problem, int degree)
    : problem_(problem),
      info_(problem.info()),
      degree_(degree),
      has_bounds_(problem.info().structure.has_bounds),
      wide_box_(static_cast<std::size_t>(problem.n_q())) {
  const auto n_q = static_cast<std::size_t>(info_.n_q), n_c = info_.contacts.size();
  std::vector<char> is_watched(n_q, 0);
  std::size_t rows = 1;
  for (const int i : info_.unilateral) {
    const auto& contact = info_.contacts[i];
    if (contact.is_affine) continue;
    curved_.push_back(i);
    rows = std::max(rows, contact.support.size());
    for (const int k : contact.support) is_watched[static_cast<std::size_t>(k)] = 1;
  }
  for (int k = 0; k < info_.n_q; ++k) {
    if (is_watched[static_cast<std::size_t>(k)]) watched_.push_back(k);
  }
  piece_size_ = static_cast<int>(rows) * (degree + 1);
  data_.resize(static_cast<std::size_t>(piece_size_) * (kMaxDepth + 2));
  pieces_.reserve(kMaxDepth + 2);
  path_.setZero(info_.n_q, degree + 1);
  part_ = path_;
  for (auto* box : {&box_, &path_box_}) box->assign(n_q, Interval(0.0));
  gaps_.assign(n_c, Interval(0.0));
  J_n_.assign(static_cast<std::size_t>(info_.n_normal_entries), Interval(0.0));
  for (auto* flags : {&is_far_, &is_clear_}) flags->assign(n_c, 0);
  near_.reserve(n_c);
  q_.setZero(info_.n_q);
  path_error_ = q_;
  gap_.setZero(info_.n_c());
  left_gap_ = gap_;
  packed_.setZero(info_.n_normal_entries);
  affine_J_n_ = packed_;
  restart();
}

void GapSearch::restart() {
  wide_box_.restart();
  problem_.normal_jacobian(info_.q0.data(), affine_J_n_.data());
}

/// The contacts that are clear in a new wide box.
void GapSearch::prove_wide_box() {
  problem_.gap_bounds(curved_, wide_box_.box().data(), gaps_.data());
  bool one_is = false, all_are = true;
  for (const int i : curved_) {
    is_far_[i] = gaps_[i].lower > 0;
    one_is = one_is || is_far_[i];
    all_are = all_are && is_far_[i];
  }
  wide_box_.learn(one_is, all_are);
}

/// The part of the path up to end().
void GapSearch::cut_path(int n_halvings) {
  end_ = 1;
  part_ = path_;
  for (; n_halvings > 0; --n_halvings) {
    end_ *= 0.5;
    for (int level = 1; level <= degree_; ++level) {
      for (int k = degree_; k >= level; --k) part_.col(k) = 0.5 * (part_.col(k - 1) + part_.col(k));
    }
  }
}

void GapSearch::begin(std::span<const ContactMode> modes, int n_halvings) {
  cut_path(n_halvings);
  problem_.gap(path_.data(), left_gap_.data());
  const auto is_open = [&](int i) { return !is_closed(modes[static_cast<std::size_t>(i)]); };
  if (std::ranges::none_of(curved_, is_open)) return;
  for (const int i : curved_) is_clear_[i] = 0;
  for (const int k : watched_) {
    const Interval polynomial = bernstein::range(part_.data() + k, degree_, info_.n_q);
    path_box_[k] = {polynomial.lower - path_error_[k], polynomial.upper + path_error_[k]};
  }
  if (!has_bounds_) return;
  if (wide_box_.follow(path_box_, watched_)) prove_wide_box();
  near_.clear();
  for (const int i : curved_) {
    is_clear_[i] = wide_box_.exists() && is_far_[i];
    if (!is_clear_[i] && is_open(i)) near_.push_back(i);
  }
  if (near_.empty()) return;
  problem_.gap_bounds(near_, path_box_.data(), gaps_.data());  // (4)
  for (const int i : near_) is_clear_[i] = gaps_[i].lower >= 0;
}

/// (3)
void GapSearch::set_gap_coefficients(int contact, const Matrix& path, double* g) const {
  const auto& info = info_.contacts[contact];
  const double* J_n = affine_J_n_.data() + info.normal_begin;
  for (int j = 0; j <= degree_; ++j) {
    g[j] = left_gap_[contact];
    for (std::size_t k = 0; k < info.support.size(); ++k)
      g[j] += J_n[k] * (path(info.support[k], j) - path(info.support[k], 0));
  }
}

/// The coordinates on which a contact depends.
void GapSearch::move_to(const ContactInfo& contact, double s) {
  for (const int k : contact.support) q_[k] = bernstein::value(path_.data() + k, info_.n_q, degree_, s);
}

double GapSearch::gap(int contact, double s) {
  if (info_.contacts[contact].is_affine) {
    double g[bernstein::kMaxDegree + 1];
    set_gap_coefficients(contact, path_, g);
    return bernstein::value(g, 1, degree_, s);
  }
  move_to(info_.contacts[contact], s);
  problem_.gap_of({&contact, 1}, q_.data(), gap_.data());
  return gap_[contact];
}

/// Pieces in the order of s, from the whole part in the first place on. @param n_before  pieces that count as done
template <class Judge>
GapSearch::Closing GapSearch::first_piece(int rows, int n_before, const Judge& judge) {
  pieces_.assign(1, {0, end_, 0});
  for (int n = n_before; !pieces_.empty(); ++n) {
    Piece piece = pieces_.back();
    piece.may_be_halved = piece.depth < (n < kMaxPieces ? kMaxDepth : kSampledDepth);
    double* b = coefficients(pieces_.size() - 1);
    switch (judge(piece, static_cast<const double*>(b))) {
      case Verdict::clear:
        pieces_.pop_back();
        break;
      case Verdict::closes:
        return {piece.from, piece.to, true};
      case Verdict::halve: {
        const double middle = 0.5 * (piece.from + piece.to);
        bernstein::halve(rows, degree_, b, coefficients(pieces_.size()));
        pieces_.back() = {middle, piece.to, piece.depth + 1};
        pieces_.push_back({piece.from, middle, piece.depth + 1});
      }
    }
  }
  return {};
}

GapSearch::Verdict GapSearch::judge_affine(const Allowance& allowance, const Piece& piece, const double* g) const {
  const double allowed = allowance.on(piece.to);
  bool is_positive = g[0] >= -allowed, rises = true, falls = true;
  for (int k = 1; k <= degree_; ++k) {
    is_positive = is_positive && g[k] >= -allowed;
    rises = rises && g[k] - g[k - 1] >= -allowance.rounding / degree_;
    falls = falls && g[k] <= g[k - 1];
  }
  if (is_positive || rises) return Verdict::clear;  // (3), (6)
  if (!falls && piece.may_be_halved) return Verdict::halve;
  return g[degree_] >= -allowed ? Verdict::clear : Verdict::closes;
}

/// J_n at s joins the estimate of its bounds.
void GapSearch::estimate_normal(int i, double s, bool is_first) {
  const auto& contact = info_.contacts[static_cast<std::size_t>(i)];
  move_to(contact, s);
  problem_.normal_jacobian_of({&i, 1}, q_.data(), packed_.data());
  for (std::size_t k = 0; k < contact.support.size(); ++k) {
    const auto at = static_cast<std::size_t>(contact.normal_begin) + k;
    const double entry = packed_[static_cast<Eigen::Index>(at)];
    J_n_[at] = is_first ? Interval(entry) : hull(J_n_[at], entry);
  }
}

/// J_n(Q)
void GapSearch::bound_normal(int i, const Piece& piece) {
  if (has_bounds_) return problem_.normal_bounds({&i, 1}, box_.data(), J_n_.data());
  estimate_normal(i, piece.from, true);
  estimate_normal(i, 0.5 * (piece.from + piece.to), false);
  estimate_normal(i, piece.to, false);
  const auto& contact = info_.contacts[static_cast<std::size_t>(i)];
  for (std::size_t k = 0; k < contact.support.size(); ++k) {
    Interval& entry = J_n_[static_cast<std::size_t>(contact.normal_begin) + k];
    entry = {entry.lower - entry.width(), entry.upper + entry.width()};
  }
}

GapSearch::Verdict GapSearch::judge_curved(int i, const Allowance& allowance, const Piece& piece, const double* b) {
  const double allowed = allowance.on(piece.to);
  const auto& contact = info_.contacts[static_cast<std::size_t>(i)];
  if (has_bounds_ && piece.depth > 0) {  // begin() has looked at the whole path
    for (std::size_t k = 0; k < contact.support.size(); ++k)
      box_[static_cast<std::size_t>(contact.support[k])] =
          bernstein::range(b + k * static_cast<std::size_t>(degree_ + 1), degree_);
    problem_.gap_bounds({&i, 1}, box_.data(), gaps_.data());
    if (gaps_[static_cast<std::size_t>(i)].lower >= -allowed) return Verdict::clear;  // (4)
  }
  bound_normal(i, piece);
  Interval rate = 0.0;
  for (std::size_t k = 0; k < contact.support.size(); ++k)
    rate += J_n_[static_cast<std::size_t>(contact.normal_begin) + k] *
            bernstein::slope_range(b + k * static_cast<std::size_t>(degree_ + 1), degree_);
  if (rate.lower >= -allowance.rounding)
    return Verdict::clear;  // (6): the piece before ended with a gap that is allowed
  const bool falls = rate.upper <= 0;
  if (!falls) {
    const double middle = gap(i, 0.5 * (piece.from + piece.to));
    if (middle - 0.5 * rate.magnitude() >= -allowed) return Verdict::clear;  // (5)
    if (piece.may_be_halved || (middle < -allowed && piece.depth < kMaxDepth)) return Verdict::halve;
  }
  return gap(i, piece.to) >= -allowed ? Verdict::clear : Verdict::closes;
}

GapSearch::Closing GapSearch::first_closing(int contact, const Allowance& allowed) {
  const auto& info = info_.contacts[contact];
  if (info.is_affine) {
    set_gap_coefficients(contact, part_, coefficients(0));
    return first_piece(1, 0, [&](const Piece& piece, const double* g) { return judge_affine(allowed, piece, g); });
  }
  if (is_clear_[contact]) return {};
  const bool moves_along = std::abs(left_gap_[contact]) <= allowed.rounding &&
                           std::abs(gap(contact, 0.5 * end_)) <= allowed.rounding &&
                           std::abs(gap(contact, end_)) <= allowed.rounding;
  double* b = coefficients(0);
  for (const int k : info.support) {
    for (int j = 0; j <= degree_; ++j) *b++ = part_(k, j);
    box_[static_cast<std::size_t>(k)] = path_box_[static_cast<std::size_t>(k)];
  }
  return first_piece(static_cast<int>(info.support.size()), moves_along ? kMaxPieces : 0,
                     [&](const Piece& piece, const double* at) { return judge_curved(contact, allowed, piece, at); });
}

double GapSearch::error_of(int contact, const auto& of_coordinate) {
  const auto& info = info_.contacts[contact];
  if (!info.is_affine) {
    if (is_clear_[contact]) return 0;
    problem_.normal_jacobian_of({&contact, 1}, path_.data(), packed_.data());
  }
  const double* J_n = (info.is_affine ? affine_J_n_ : packed_).data() + info.normal_begin;
  double error = 0;
  for (const int k : info.support) error += std::abs(*J_n++) * of_coordinate(k);
  return error;
}

double GapSearch::gap_error(int contact) {
  return error_of(contact, [&](int k) { return path_error_[k]; });
}

/// (7): m_d and m_d-1 / d are the last differences of the Bernstein coefficients.
double GapSearch::begin_error(int contact) {
  return error_of(contact, [&](int k) {
    double b[bernstein::kMaxDegree + 1];
    for (int j = 0; j <= degree_; ++j) b[j] = path_(k, j);
    double last = 0;  // of order d - 1
    for (int order = 1; order <= degree_; ++order) {
      last = b[0];
      for (int j = 0; j <= degree_ - order; ++j) b[j] = b[j + 1] - b[j];
    }
    return std::abs(b[0]) + (degree_ > 3 ? 0.25 * degree_ * std::abs(last) : 0);
  });
}

double GapSearch::zero(int contact, const Closing& closing) {
  return falling_zero(closing.from, closing.to, [&](double s) { return gap(contact, s); });
}

}  // namespace ricochet
