#include "reference/force_division.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include "problems/dense_solve.h"
#include "reference/scales.h"

namespace ricochet::reference {
namespace {

constexpr double kLargest = 1e3;      // bound of y, in max |least|, so that there are vertices
constexpr double kMaxVertices = 2e3;  // tried within a right-hand side
constexpr double kSteady = 1e-2;      // slack of the least division, in max |least|, with which it is good enough
constexpr int kMaxCuts = 30, kFirstCuts = 8;

/// Linear program: maximise the last component of z with A z >= b.
class LinearProgram {
 public:
  LinearProgram(int n) : A_(0, n), b_(0) {}

  void add(const Vector& a, double b) {
    A_.conservativeResize(A_.rows() + 1, Eigen::NoChange);
    A_.bottomRows(1) = a.transpose();
    b_.conservativeResize(b_.size() + 1);
    b_[b_.size() - 1] = b;
  }

  /// The best of all vertices; nothing if there are too many, or none is feasible.
  std::optional<Vector> solve() const {
    const Eigen::Index n = A_.cols(), m = A_.rows();
    double vertices = 1;
    for (Eigen::Index k = 0; k < n; ++k) vertices *= static_cast<double>(m - k) / static_cast<double>(k + 1);
    if (vertices > kMaxVertices) return std::nullopt;
    std::optional<Vector> best;
    std::vector<Eigen::Index> active(static_cast<std::size_t>(n));
    std::iota(active.begin(), active.end(), 0);
    while (true) {
      const FullPivotingFactors lu(A_(active, Eigen::all));
      if (lu.is_invertible()) {
        const Vector z = lu.solve(b_(active));
        const Vector size = A_.cwiseAbs() * z.cwiseAbs() + b_.cwiseAbs();
        if ((A_ * z - b_ + kLawRounding * size).minCoeff() >= 0 && (!best || z[n - 1] > (*best)[n - 1])) best = z;
      }
      Eigen::Index k = n - 1;  // the next of the combinations, in lexicographic order
      while (k >= 0 && active[k] == m - n + k) --k;
      if (k < 0) return best;
      ++active[k];
      for (Eigen::Index l = k + 1; l < n; ++l) active[l] = active[l - 1] + 1;
    }
  }

 private:
  Matrix A_;
  Vector b_;
};

double slack(const Vector& x, const ForceCone& cone) {
  return cone.n_t == 0 ? x[cone.normal] : cone.mu * x[cone.normal] - x.segment(cone.normal + 1, cone.n_t).norm();
}

}  // namespace

double slack(const Vector& x, const std::vector<ForceCone>& cones) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& cone : cones) least = std::min(least, slack(x, cone));
  return least;
}

Vector steadiest_division(const Vector& least, const Matrix& N, const std::vector<ForceCone>& cones) {
  const auto d = static_cast<int>(N.cols());
  const double size = least.cwiseAbs().maxCoeff();
  if (!(size > 0) || slack(least, cones) > kSteady * size) return least;
  Matrix basis = N;
  for (auto column : basis.colwise()) column /= column.cwiseAbs().maxCoeff();

  LinearProgram program(d + 1);  // of (y, m)
  const auto add_cut = [&](const ForceCone& cone, const Vector& direction) {
    Vector a = Vector::Zero(least.size());
    a[cone.normal] = cone.n_t == 0 ? 1 : cone.mu;
    a.segment(cone.normal + 1, cone.n_t) = -direction;
    Vector row(d + 1);
    row << basis.transpose() * a, -1;
    program.add(row, -a.dot(least));
  };
  for (const auto& cone : cones) {
    if (cone.n_t == 0) add_cut(cone, Vector());
    for (int sign = -1; cone.n_t == 1 && sign <= 1; sign += 2) add_cut(cone, Vector::Constant(1, sign));
    for (int k = 0; cone.n_t == 2 && k < kFirstCuts; ++k) {
      const double angle = 2 * std::numbers::pi / kFirstCuts * k;
      add_cut(cone, Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
  }
  program.add(-Vector::Unit(d + 1, d), -size);
  for (int k = 0; k < d; ++k) {
    program.add(Vector::Unit(d + 1, k), -kLargest * size);
    program.add(-Vector::Unit(d + 1, k), -kLargest * size);
  }
  for (int cut = 0; cut < kMaxCuts; ++cut) {
    const auto z = program.solve();
    if (!z) return least;
    const Vector x = least + basis * z->head(d);
    bool is_inside = true;
    for (const auto& cone : cones) {
      if (cone.n_t < 2 || slack(x, cone) >= (*z)[d] - kSame * size) continue;
      add_cut(cone, x.segment(cone.normal + 1, cone.n_t).normalized());
      is_inside = false;
    }
    if (is_inside) return x;
  }
  return least;
}

}  // namespace ricochet::reference
