#include "methods/contact_laws/conflicting_contacts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

constexpr int kMostContacts = 300;    // of an eigenvalue problem of a second
constexpr double kNullSpace = 1e-13;  // above the rounding of n eigenvalues, n eps, of a few hundred
// Least |d| over |b|: below, walls close no faster than the tolerance of a contact solver can tell.
constexpr double kLeastClosing = 1e-9;
constexpr double kLeastWeight = 1e-6;  // d_i of the largest that counts
constexpr std::size_t kMostNames = 5;

/// The least |A s - c| of s >= 0, by the method of Lawson and Hanson (Solving Least Squares Problems, chapter 23).
Vector nonnegative_least_squares(const Matrix& A, const Vector& c) {
  const auto n = A.cols();
  Vector s = Vector::Zero(n);
  std::vector<int> active;
  std::vector<char> is_active(n, 0);
  const double rounding = kNullSpace * c.norm();
  for (Eigen::Index iteration = 0; iteration < 3 * n; ++iteration) {
    const Vector rise = A.transpose() * (c - A * s);
    int best = -1;
    for (int i = 0; i < n; ++i) {
      if (!is_active[i] && rise[i] > rounding && (best < 0 || rise[i] > rise[best])) best = i;
    }
    if (best < 0) break;
    active.push_back(best);
    is_active[best] = 1;
    while (!active.empty()) {
      const Vector z = least_squares(A(Eigen::all, active), c);
      double way = 1;
      for (std::size_t k = 0; k < active.size(); ++k) {
        if (z[k] <= 0) way = std::min(way, s[active[k]] / (s[active[k]] - z[k]));
      }
      if (!std::isfinite(way)) way = 0;
      for (std::size_t k = 0; k < active.size(); ++k) s[active[k]] += way * (z[k] - s[active[k]]);
      if (way == 1) break;
      std::erase_if(active, [&](int i) {
        if (s[i] > rounding) return false;
        s[i] = 0;
        is_active[i] = 0;
        return true;
      });
    }
  }
  return s;
}

}  // namespace

std::vector<int> conflicting_contacts(const ContactProblem& problem) {
  const auto& G = problem.G;
  const int n = G.n_contacts();
  if (n < 2 || n > kMostContacts) return {};
  Matrix all(G.n_rows(), G.n_rows());
  G.to_dense(all);
  std::vector<int> normals;
  for (int i = 0; i < n; ++i) normals.push_back(G.row(i));
  const Vector scale = all.diagonal()(normals).cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return {};
  const Matrix A = scale.asDiagonal() * all(normals, normals) * scale.asDiagonal();
  const Vector b = scale.cwiseProduct(problem.b(normals));
  const SymmetricEigen eigen(0.5 * (A + A.transpose()));
  int n_null = 0;
  while (n_null < n && eigen.values[n_null] <= kNullSpace * eigen.values[n - 1]) ++n_null;
  if (n_null == 0) return {};
  // The nearest point is P (s - b) with P = N N' and the s >= 0 that makes it shortest.
  const Matrix N = eigen.vectors.leftCols(n_null);
  const Vector c = N.transpose() * b, s = nonnegative_least_squares(N.transpose(), c), d = N * (N.transpose() * s - c);
  if (!(d.norm() > kLeastClosing * b.norm()) || !(b.dot(d) < 0)) return {};
  const double least = kLeastWeight * d.maxCoeff();
  if (d.minCoeff() < -least) return {};
  std::vector<int> contacts;
  for (int i = 0; i < n; ++i) {
    if (d[i] > least) contacts.push_back(i);
  }
  // All rows of (1): tangential ones, and a G that is not symmetric.
  const Vector left = all(normals, Eigen::all).transpose() * scale.cwiseProduct(d);
  for (int k = 0; k < G.n_rows(); ++k) {
    if (std::abs(left[k]) > std::sqrt(kNullSpace * all(k, k)) * d.norm()) return {};
  }
  return contacts;
}

std::string quoted_contacts(const ProblemInfo& info, const std::vector<int>& contacts) {
  std::string names = contacts.size() > 1 ? "contacts" : "contact";
  const std::size_t shown = std::min(contacts.size(), kMostNames);
  for (std::size_t k = 0; k < shown; ++k) {
    const bool is_last = k > 0 && k + 1 == contacts.size();
    names += fmt::format("{}'{}'", k == 0 ? " " : is_last ? " and " : ", ", info.contacts[contacts[k]].name);
  }
  if (shown < contacts.size()) names += fmt::format(" and {} more", contacts.size() - shown);
  return names;
}

}  // namespace ricochet
