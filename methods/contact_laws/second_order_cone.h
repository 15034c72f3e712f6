#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace ricochet {

// The second-order cone L = {z_0 >= ||z_t||} in three dimensions, with the product a o b = (a'b, a_0 b_t + b_0 a_t). In
// two dimensions the third entries are zero, and stay so.

inline double tangent_norm(const Eigen::Vector3d& z) {
  return std::hypot(z[1], z[2]);
}

/// z_0^2 - ||z_t||^2
inline double determinant(const Eigen::Vector3d& z) {
  return (z[0] - tangent_norm(z)) * (z[0] + tangent_norm(z));
}

/// The matrix of z -> a o z.
inline Eigen::Matrix3d arrow(const Eigen::Vector3d& a) {
  Eigen::Matrix3d A = a[0] * Eigen::Matrix3d::Identity();
  A.row(0) = a.transpose();
  A.col(0) = a;
  return A;
}

/// The largest s with z + s dz in L, z inside it; infinite when there is none.
inline double step_to_boundary(const Eigen::Vector3d& z, const Eigen::Vector3d& dz) {
  const double a = dz[0] * dz[0] - dz.tail<2>().squaredNorm(), b = z[0] * dz[0] - z.tail<2>().dot(dz.tail<2>()),
               c = determinant(z), root = b * b - a * c;  // zero of c + 2 b s + a s^2
  if (a >= 0 && (b >= 0 || root < 0)) return std::numeric_limits<double>::infinity();
  return c / (std::sqrt(root) - b);
}

/// Two points inside of L that become complementary, and the linearisation of x o y = t e there, e = (1, 0), in the
/// coordinates V x and W y, V = W^-1 symmetric:
///
///   P dx + Q dy = t e - V x o W y - V dx o W dy,   P z = W y o V z,   Q z = V x o W z             (1)
///
/// W = I is the direction of Alizadeh, Haeberly and Overton, V x = W y that of Nesterov and Todd.
/// Source: Alizadeh, Goldfarb, Math. Program. 95 (2003).
struct ConePair {
  Eigen::Vector3d x, y, dx, dy, target;
  Eigen::Matrix3d W, V, P, Q;

  void linearize_unscaled() {
    W = V = Eigen::Matrix3d::Identity();
    P = arrow(y);
    Q = arrow(x);
  }

  /// W = beta (u_0 u_t'; u_t I + u_t u_t' / (1 + u_0)), det u = 1: a hyperbolic rotation that takes y / beta to beta x.
  void linearize_scaled() {
    const double size_x = std::sqrt(determinant(x)), size_y = std::sqrt(determinant(y)),
                 beta = std::sqrt(size_x / size_y);
    Eigen::Vector3d u = y / size_y;
    u.tail<2>() *= -1;
    u += x / size_x;
    u /= std::sqrt(determinant(u));
    Eigen::Matrix3d rotation = arrow(u);
    rotation.bottomRightCorner<2, 2>() =
        Eigen::Matrix2d::Identity() + u.tail<2>() * u.tail<2>().transpose() / (1 + u[0]);
    W = beta * rotation;
    V = rotation / beta;
    V.block<1, 2>(0, 1) *= -1;
    V.block<2, 1>(1, 0) *= -1;
    const Eigen::Matrix3d A = arrow(W * y);
    P = A * V;
    Q = A * W;
  }

  /// The right side of (1), with or without its last term.
  void aim(double t, bool second_order) {
    target = -arrow(V * x) * (W * y);
    if (second_order) target -= arrow(V * dx) * (W * dy);
    target[0] += t;
  }
};

}  // namespace ricochet
