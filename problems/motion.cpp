#include "problems/motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "problems/input_error.h"

namespace ricochet {

double Motion::point(int k, int degree) {
  return 0.5 - 0.5 * std::cos(k * std::numbers::pi / degree);
}

double Motion::weight(int k, int degree) {
  return (k % 2 ? -1 : 1) * (k == 0 || k == degree ? 0.5 : 1);
}

Vector Motion::interpolated(const Matrix& x, double s) {
  const auto degree = static_cast<int>(x.cols()) - 1;
  Vector sum = Vector::Zero(x.rows());
  double weights = 0;
  for (int k = 0; k <= degree; ++k) {
    const double distance = s - point(k, degree);
    if (distance == 0) return x.col(k);
    sum += weight(k, degree) / distance * x.col(k);
    weights += weight(k, degree) / distance;
  }
  return sum / weights;
}

void Motion::within(std::size_t piece, double s, Vector& q, Vector& v) const {
  const Vector x = interpolated(pieces_[piece].x, s);
  const Eigen::Index n = x.size() / 2;
  q = x.head(n);
  v = x.tail(n);
}

void Motion::acceleration_within(std::size_t piece, double s, Vector& a) const {
  const Piece& of = pieces_[piece];
  const auto v = of.x.bottomRows(of.x.rows() / 2);
  const auto degree = static_cast<int>(of.x.cols()) - 1;
  Matrix slopes = Matrix::Zero(v.rows(), v.cols());
  for (int i = 0; i <= degree; ++i) {
    for (int k = 0; k <= degree; ++k) {
      if (k == i) continue;
      const double factor = weight(k, degree) / weight(i, degree) / (point(i, degree) - point(k, degree));
      slopes.col(i) += factor * (v.col(k) - v.col(i));  // (3)
    }
  }
  a = interpolated(slopes, s) / (of.end - of.begin);
}

void Motion::cut(double t) {
  std::erase_if(pieces_, [&](const Piece& piece) { return 0.5 * (piece.begin + piece.end) > t; });
}

void Motion::append(const Motion& other, double shift) {
  for (Piece piece : other.pieces_) {
    piece.begin += shift;
    piece.end += shift;
    pieces_.push_back(std::move(piece));
  }
}

void Motion::at(double t, Vector& q, Vector& v, Side side) const {
  if (empty() || !(t >= begin() && t <= end()))
    throw InputError("time", t,
                     empty() ? "no motion was recorded" : fmt::format("{:g} s to {:g} s is known", begin(), end()));
  // The last piece that begins before t, or at t if the limit after t is required.
  const auto after = std::partition_point(pieces_.begin(), pieces_.end(), [&](const Piece& piece) {
    return side == Side::after ? piece.begin <= t : piece.begin < t;
  });
  const auto piece = after == pieces_.begin() ? after : after - 1;
  within(static_cast<std::size_t>(piece - pieces_.begin()),
         std::clamp((t - piece->begin) / (piece->end - piece->begin), 0.0, 1.0), q, v);
}

}  // namespace ricochet
