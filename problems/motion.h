#pragma once

#include <cstddef>
#include <vector>

#include "problems/problem.h"

/// @file
/// Where everything is between the steps.

namespace ricochet {

/// The motion of a run at any time: pieces from one step, or event, to the next, in which a method says by polynomials of
/// the time what q and v are. Where pieces meet, v has a limit on either side: they differ behind an impact.
///
/// A piece keeps the values of its polynomials of degree d at the Chebyshev points of the second kind,
///
///     s_k = (1 - cos(k pi / d)) / 2,   k = 0 .. d,   t = t_0 + h s                                          (1)
///
/// which determine them; between the points they are evaluated by the barycentric formula with weights
///
///     (-1)^k, the first and the last halved                                                                 (2)
///
/// (Berrut, Trefethen, Barycentric Lagrange interpolation, SIAM Review 46 (2004), (4.2), (5.4)). With these weights w_k
/// derivatives at the points are those of (9.4) there, and between the points they are evaluated like values:
///
///     x'(s_i) = sum over k != i of (w_k / w_i) (x_k - x_i) / (s_i - s_k)                                    (3)
class Motion {
 public:
  /// Which limit, where two pieces meet.
  enum class Side {
    before,  ///< of the piece that ends
    behind   ///< of the piece that begins
  };

  /// Adds the piece from `begin` to `end` [s] behind those so far; none where it has no length.
  /// @param begin, end  [s]
  /// @param degree      >= 1, of the polynomials
  /// @param state       state(s, q, v) sets q and v, n_q each, for s in [0, 1]
  template <class State>
  void add(double begin, double end, int degree, const State& state);

  bool empty() const { return pieces_.empty(); }                             ///< Nothing was recorded.
  std::size_t n_pieces() const { return pieces_.size(); }                    ///< One at least for each step.
  double begin() const { return pieces_.front().begin; }                     ///< Of the motion [s]; it is not empty.
  double end() const { return pieces_.back().end; }                          ///< Of the motion [s]; it is not empty.
  double begin_of(std::size_t piece) const { return pieces_[piece].begin; }  ///< Of `piece`, from 0 [s].
  double end_of(std::size_t piece) const { return pieces_[piece].end; }      ///< Of `piece`, from 0 [s].

  /// Sets `q` and `v`, n_q each, to those at the time `t` [s], with the limit of `side` where two pieces meet.
  /// @throws InputError for a time that is not from begin() to end()
  void at(double t, Vector& q, Vector& v, Side side = Side::behind) const;
  /// The same within one `piece`, at `s` from 0, where it begins, to 1.
  void within(std::size_t piece, double s, Vector& q, Vector& v) const;
  /// Sets `a`, n_q, to the derivative of v with respect to the time there: what moves bodies is in the pieces, and in the
  /// jumps of v between them.
  void acceleration_within(std::size_t piece, double s, Vector& a) const;

 private:
  struct Piece {
    double begin, end;
    Matrix x;  // 2 n_q x (degree + 1)
  };

  static double point(int k, int degree);   // (1)
  static double weight(int k, int degree);  // (2)
  /// @param x  values at the points, a column each
  static Vector interpolated(const Matrix& x, double s);

  std::vector<Piece> pieces_;
};

template <class State>
void Motion::add(double begin, double end, int degree, const State& state) {
  if (!(end > begin)) return;
  Piece piece{begin, end, {}};
  Vector q, v;
  for (int k = 0; k <= degree; ++k) {
    state(point(k, degree), q, v);
    if (k == 0) piece.x.resize(2 * q.size(), degree + 1);
    piece.x.col(k) << q, v;
  }
  pieces_.push_back(std::move(piece));
}

}  // namespace ricochet
