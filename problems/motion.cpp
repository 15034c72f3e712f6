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

void Motion::within(std::size_t piece, double s, Vector& q, Vector& v) const {
  const Matrix& x = pieces_[piece].x;
  const Eigen::Index n = x.rows() / 2;
  const auto degree = static_cast<int>(x.cols()) - 1;
  const auto set = [&](const auto& state) {
    q = state.head(n);
    v = state.tail(n);
  };
  Vector sum = Vector::Zero(x.rows());
  double weights = 0;
  for (int k = 0; k <= degree; ++k) {
    const double distance = s - point(k, degree);
    if (distance == 0) return set(x.col(k));
    const double weight = (k % 2 ? -1 : 1) * (k == 0 || k == degree ? 0.5 : 1) / distance;  // (2)
    sum += weight * x.col(k);
    weights += weight;
  }
  set(sum / weights);
}

void Motion::at(double t, Vector& q, Vector& v, Side side) const {
  if (empty() || !(t >= begin() && t <= end()))
    throw InputError("time", t,
                     empty() ? "no motion was recorded" : fmt::format("{:g} s to {:g} s is known", begin(), end()));
  // The last piece that begins before t, or at t if that side is wanted.
  const auto behind = std::partition_point(pieces_.begin(), pieces_.end(), [&](const Piece& piece) {
    return side == Side::behind ? piece.begin <= t : piece.begin < t;
  });
  const auto piece = behind == pieces_.begin() ? behind : behind - 1;
  within(static_cast<std::size_t>(piece - pieces_.begin()),
         std::clamp((t - piece->begin) / (piece->end - piece->begin), 0.0, 1.0), q, v);
}

}  // namespace ricochet
