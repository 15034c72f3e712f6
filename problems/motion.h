#pragma once

#include <cstddef>
#include <vector>

#include "problems/problem.h"

/// @file
/// Motion, the coordinates and velocities between the steps of a run.

namespace ricochet {

/// The motion of a run at any time. It consists of pieces from one step or event to the next, on which q and v are
/// polynomials of the time. At the end of a piece, v has two limits, which differ at an impact.
///
/// A piece keeps the values of its polynomials of degree d at the Chebyshev points of the second kind,
///
///     s_k = (1 - cos(k pi / d)) / 2,   k = 0 .. d,   t = t_0 + h s                                          (1)
///
/// which determine them. Between the points it uses the barycentric formula with weights
///
///     (-1)^k, the first and the last halved                                                                 (2)
///
/// (Berrut, Trefethen, Barycentric Lagrange interpolation, SIAM Review 46 (2004), (4.2), (5.4)). With these weights
/// w_k, derivatives at the points follow from (9.4) there, and between the points they are interpolated like values:
///
///     x'(s_i) = sum over k != i of (w_k / w_i) (x_k - x_i) / (s_i - s_k)                                    (3)
class Motion {
 public:
  /// The limit to be used at an instant at which two pieces meet.
  enum class Side {
    before,  ///< of the piece that ends
    after    ///< of the piece that begins
  };

  /// Appends the piece from `begin` to `end`, unless its length is zero.
  /// @param begin, end  [s]
  /// @param degree      degree of the polynomials, >= 1
  /// @param state       state(s, q, v) sets q and v, n_q each, for s in [0, 1]
  template <class State>
  void add(double begin, double end, int degree, const State& state);

  /// Appends all pieces of another motion `other`, `shift` later [s].
  void append(const Motion& other, double shift);

  /// Removes the pieces after `t`, the end of one of them [s].
  void cut(double t);

  bool empty() const { return pieces_.empty(); }                             ///< Whether nothing was recorded.
  std::size_t n_pieces() const { return pieces_.size(); }                    ///< At least one for each step.
  double begin() const { return pieces_.front().begin; }                     ///< Start of the motion [s], if not empty.
  double end() const { return pieces_.back().end; }                          ///< End of the motion [s], if not empty.
  double begin_of(std::size_t piece) const { return pieces_[piece].begin; }  ///< Start of `piece` [s].
  double end_of(std::size_t piece) const { return pieces_[piece].end; }      ///< End of `piece` [s].

  int degree_of(std::size_t piece) const { return static_cast<int>(pieces_[piece].x.cols()) - 1; }  ///< Of polynomials.

  /// Sets `q` and `v`, n_q each, to their values at the time `t` [s], with the limit `side` if two pieces meet there.
  /// @throws InputError for a time outside begin() to end()
  void at(double t, Vector& q, Vector& v, Side side = Side::after) const;
  /// Sets `q` and `v` within one `piece`, from `s` = 0 at its start to 1 at its end.
  void within(std::size_t piece, double s, Vector& q, Vector& v) const;
  /// Sets `a`, n_q, to the time derivative of v there. Contact forces follow from it, and impulses from the jumps of v
  /// between pieces.
  void acceleration_within(std::size_t piece, double s, Vector& a) const;

 private:
  struct Piece {
    double begin, end;
    Matrix x;  // 2 n_q x (degree + 1)
  };

  static double point(int k, int degree);   // (1)
  static double weight(int k, int degree);  // (2)
  /// @param x  values at the points, one column per point
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
