#pragma once

#include <array>
#include <cstddef>

/// @file
/// Vectors of three numbers, or of three formulas, and the tangents of a normal.

namespace ricochet {

template <class T>
using Vector3 = std::array<T, 3>;  ///< A vector in space.
template <class T>
using Matrix3 = std::array<Vector3<T>, 3>;  ///< Row after row.

template <class T>
T dot(const Vector3<T>& a, const Vector3<T>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <class T>
Vector3<T> cross(const Vector3<T>& a, const Vector3<T>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
template <class T>
Vector3<T> sum(const Vector3<T>& a, const Vector3<T>& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
template <class T>
Vector3<T> difference(const Vector3<T>& a, const Vector3<T>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
template <class T>
Vector3<T> scaled(const T& factor, const Vector3<T>& a) {
  return {factor * a[0], factor * a[1], factor * a[2]};
}
template <class T>
Matrix3<T> identity() {
  return {{{T(1), T(0), T(0)}, {T(0), T(1), T(0)}, {T(0), T(0), T(1)}}};
}
template <class T>
Vector3<T> column_of(const Matrix3<T>& A, std::size_t k) {
  return {A[0][k], A[1][k], A[2][k]};
}
template <class T>
Vector3<T> times(const Matrix3<T>& A, const Vector3<T>& x) {
  return {dot(A[0], x), dot(A[1], x), dot(A[2], x)};
}
template <class T>
Vector3<T> times_transposed(const Matrix3<T>& A, const Vector3<T>& x) {
  return {dot(column_of(A, 0), x), dot(column_of(A, 1), x), dot(column_of(A, 2), x)};
}
template <class T>
Matrix3<T> times(const Matrix3<T>& A, const Matrix3<T>& B) {
  Matrix3<T> C;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) C[i][j] = dot(A[i], column_of(B, j));
  }
  return C;
}

/// Two directions that are orthonormal with the unit normal n in space,
///
///     t_k = a_k - (n' a_k) (n + a_3) / (1 + n' a_3),   a_1, a_2, a_3 an orthonormal frame,                    (1)
///
/// which is smooth except at n = -a_3, a direction that does not occur in a pile.
/// (1): Frisvad, Journal of Graphics Tools 16 (2012), 151-159.
template <class T>
std::array<Vector3<T>, 2> tangents_of(const Vector3<T>& n) {
  const double a[3][3] = {{2.0 / 3, -2.0 / 3, 1.0 / 3}, {1.0 / 3, 2.0 / 3, 2.0 / 3}, {-2.0 / 3, -1.0 / 3, 2.0 / 3}};
  const auto along = [&](int k) { return n[0] * a[k][0] + n[1] * a[k][1] + n[2] * a[k][2]; };
  std::array<Vector3<T>, 2> t;
  for (std::size_t k = 0; k < 2; ++k) {
    const int row = static_cast<int>(k);
    for (std::size_t c = 0; c < 3; ++c) t[k][c] = a[k][c] - along(row) * (n[c] + a[2][c]) / (1 + along(2));
  }
  return t;
}

/// The direction in the plane that becomes the unit normal `n` after a quarter turn counterclockwise.
template <class T>
Vector3<T> plane_tangent_of(const Vector3<T>& n) {
  return {n[1], -n[0], T(0)};
}

}  // namespace ricochet
