#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "methods/contact_laws/wide_box.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Finds the first s on a polynomial path q(s), 0 <= s <= 1, at which the gap of a contact has closed, or proves that
/// there is none. With the Bernstein coefficients b_k of degree d,
///
///   q(s) = sum_k b_k B_k(s),  min_k b_k <= q(s) <= max_k b_k                                       (1)
///   q'(s) = d sum_k (b_k+1 - b_k) B_k(s)                                                           (2)
///
/// hold on [0, 1], and after de Casteljau's algorithm on each half of it. A piece [a, b] of the path is clear when one of
/// these bounds of the gap is at least -allowed:
///
///   affine     the coefficients f_c(b_k) of the gap, which is a polynomial of s, too               (3)
///   curved     f_c(Q),  Q the box (1)                                                              (4)
///              f_c(q(m)) + [-1/2, 1/2] J_n(Q)' Q',  Q' the box of q' (b - a) (2), m the middle     (5)
///   both       the gap at one end, where its rate, J_n(Q)' Q', has one sign up to rounding         (6)
///
/// with bounds over boxes from the problem (problems/interval.h). If a piece is not clear, but its gap falls
/// throughout, by (2) or (6), to below -allowed, it contains the closing. Any other piece is halved, the left half
/// first. Pieces shorter than 2^-40 are decided by the gap at their end. The proof is for the path; the error control
/// of a method bounds its distance from the motion.
///
/// Most contacts are far away most of the time. So (4) is evaluated for a WideBox around the path; as long as later paths
/// stay inside, contacts that are clear there cost nothing.
///
/// If bodies touch and move together, the gap is zero throughout, which no bound proves. If it is zero up to rounding
/// at both ends and in the middle of a path, and after 256 pieces of any path, pieces of 1/64 are no longer halved: the
/// gap in their middle and at their end decides.
///
/// If a path is known up to errors e_k of its coordinates, zero at both ends, it decides only gaps of at least |J_n|'
/// e. This number is gap_error(), a negative allowance.
///
/// If a gap is zero at the beginning of the path, its error near there may be larger than rounding. The next
/// coefficient of each coordinate is estimated by (7), with the coefficients m_k of s^k. It multiplies a polynomial
/// that is zero at the nodes and at most w s^p near the beginning:
///
///   |m_d| + |m_d-1| / 4,   the second term for d > 3 alone                                         (7)
///
/// For a body in free flight, (7) is rounding, so that the next impact is found however small the bounce is.
///
/// For a problem without bounds, (5) and (6) use the range of J_n at the ends and in the middle of a piece, widened by
/// its width on either side. That is no proof, but no path is long compared with the gaps it passes.
class GapSearch {
 public:
  /// @param degree  of the paths
  GapSearch(const Problem& problem, int degree);
  /// Starts a new run: discards earlier proofs.
  void restart();

  int degree() const { return degree_; }
  /// n_q x (degree + 1): b_k of the next path.
  Matrix& path() { return path_; }
  /// n_q: e_k of the next path; zero at first.
  Vector& path_error() { return path_error_; }
  /// To be called after path() has been filled. Contacts that are open in these `modes` can be searched.
  /// @param n_halvings  only the part of the path up to s = end() = 2^-n_halvings is searched
  void begin(std::span<const ContactMode> modes, int n_halvings = 0);
  double end() const { return end_; }

  /// How far below zero the gap may be [m]: `gap`, which (3)-(6) call allowed. Up to s = `until` it may be lower, by
  /// s^2 (square + s cube), but not by more than `most`. A negative number requires a gap above zero.
  struct Allowance {
    double gap = 0;
    double until = 0, square = 0, cube = 0, most = 0;
    double rounding = 0;  ///< of gaps, in (6)
    double on(double to) const {
      return to <= until ? std::max(gap, std::min(most, to * to * (square + to * cube))) : gap;
    }
  };
  /// A piece of a path on which a gap falls from at least -allowed to less.
  struct Closing {
    double from = 0, to = 1;
    bool found = false;
    explicit operator bool() const { return found; }
  };
  /// The first closing of a contact, whose gap is not below what is allowed where the path begins.
  Closing first_closing(int contact, const Allowance& allowed);
  /// |J_n|' e of a contact, with J_n where the path begins [m].
  double gap_error(int contact);
  /// Like gap_error(), for the error (7) [m], to be multiplied by w s^p.
  double begin_error(int contact);
  /// Position at which the gap of a closing vanishes, to 1e-9 of the piece; the left end of the piece if the gap is not
  /// positive there.
  double zero(int contact, const Closing& closing);

  /// Gap at the left end of the path.
  double left_gap(int contact) const { return left_gap_[contact]; }
  /// Gap at s.
  double gap(int contact, double s);

 private:
  static constexpr int kMaxDepth = 40, kMaxPieces = 256, kSampledDepth = 6;

  enum class Verdict : std::uint8_t { clear, closes, halve };
  /// One piece of a path, and whether it may be halved: rows of degree + 1 coefficients, of the coordinates of a contact or of its gap.
  struct Piece {
    double from, to;
    int depth;
    bool may_be_halved = true;
  };

  template <class Judge>
  Closing first_piece(int rows, int n_before, const Judge& judge);
  Verdict judge_affine(const Allowance& allowance, const Piece& piece, const double* g) const;
  Verdict judge_curved(int contact, const Allowance& allowance, const Piece& piece, const double* b);
  double* coefficients(std::size_t piece) { return data_.data() + piece * static_cast<std::size_t>(piece_size_); }
  void set_gap_coefficients(int contact, const Matrix& path, double* g) const;
  void bound_normal(int contact, const Piece& piece);
  void estimate_normal(int contact, double s, bool is_first);
  double error_of(int contact, const auto& of_coordinate);
  void move_to(const ContactInfo& contact, double s);
  void prove_wide_box();
  void cut_path(int n_halvings);

  const Problem& problem_;
  const ProblemInfo& info_;
  const int degree_;
  const bool has_bounds_;
  std::vector<int> curved_;   // unilateral contacts
  std::vector<int> watched_;  // coordinates on which their gaps depend
  int piece_size_ = 0;        // coefficients of a piece

  Matrix path_, part_;  // part_: what is searched
  double end_ = 1;
  std::vector<double> data_;              // coefficients of the pieces that wait
  std::vector<Piece> pieces_;             // the next one last
  std::vector<Interval> box_, path_box_;  // n_q
  std::vector<Interval> gaps_, J_n_;      // n_c, packed
  std::vector<int> near_;                 // curved contacts that the wide box does not clear
  std::vector<char> is_far_, is_clear_;   // per contact: clear in the wide box, or along this path
  WideBox wide_box_;
  Vector path_error_, q_, gap_, left_gap_;
  Vector affine_J_n_, packed_;  // packed: of affine contacts; at a place
};

}  // namespace ricochet
