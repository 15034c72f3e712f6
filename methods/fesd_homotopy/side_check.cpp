#include "methods/fesd_homotopy/side_check.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>

#include "methods/regions/time_switch.h"
#include "problems/dense_solve.h"

namespace ricochet {
namespace {

constexpr int kPoints = 16;            // of an element
constexpr double kInside = 1e-6;       // theta nearer to 0 or 1 is a side
constexpr double kNoInfluence = 1e-9;  // of the terms of (2): a formula that does not jump
constexpr double kAtEnd = 1e-6;        // of an element: a zero so near to its end is the switch there

bool is_side(double theta) {
  return theta == 0 || theta == 1;
}

/// Whether all principal minors of A are positive.
bool is_P(const Matrix& A) {
  const auto n = static_cast<unsigned>(A.rows());
  for (unsigned subset = 1; subset < (1u << n); ++subset) {
    std::vector<int> rows;
    for (unsigned k = 0; k < n; ++k) {
      if (subset >> k & 1u) rows.push_back(static_cast<int>(k));
    }
    if (!(Matrix(A(rows, rows)).determinant() > 0)) return false;
  }
  return true;
}

}  // namespace

SideCheck::SideCheck(const Problem& problem, const StepFunctions& steps, const ButcherTableau& tableau)
    : problem_(problem), steps_(steps), motion_(tableau) {}

Vector SideCheck::sides_of(const Matrix& theta) const {
  Vector sides(theta.rows());
  for (Eigen::Index k = 0; k < theta.rows(); ++k) {
    const double mean = theta.row(k).mean();
    sides[k] = theta.row(k).maxCoeff() <= kInside ? 0 : theta.row(k).minCoeff() >= 1 - kInside ? 1 : mean;
  }
  return sides;
}

/// (a)
std::string SideCheck::leaves(const Element& element, const Vector& sides, double accuracy) {
  const ProblemInfo& info = problem_.info();
  for (int k = 0; k < steps_.size(); ++k) {
    if (!info.switches[k].is_of_time) continue;
    const double begin = element.q0[info.clock], end = element.q1[info.clock], margin = kAtEnd * (end - begin);
    const Interval inside{begin + margin, end - margin};
    if (first_time_switch(problem_, k, inside, element.q0, element.v0) < inside.upper)
      return fmt::format("{} changes its sign inside of an element: more elements, or more steps, are required",
                         info.switches[k].formula);
  }
  Motion motion;
  motion_.add(0, element.h, element, motion);
  Vector q, v;
  for (int m = 0; m <= kPoints && !motion.empty(); ++m) {
    motion.within(0, static_cast<double>(m) / kPoints, q, v);
    const Vector psi = steps_.switching.at(q, v, sides), size = steps_.sizes(q, v, sides);
    for (Eigen::Index k = 0; k < psi.size(); ++k) {
      if (is_side(sides[k]) && (2 * sides[k] - 1) * psi[k] < -accuracy * size[k])
        return fmt::format("{} = {:.3g} is on the other side between the stages of an element: more steps are required",
                           info.switches[static_cast<std::size_t>(k)].formula, psi[k]);
    }
  }
  return {};
}

/// (b), at the last stage
std::string SideCheck::is_not_unique(const Element& element, const Vector& sides) const {
  std::vector<int> on;
  for (int k = 0; k < sides.size(); ++k) {
    if (!is_side(sides[k])) on.push_back(k);
  }
  if (on.empty()) return {};
  const Vector q = element.q.rightCols<1>(), v = element.v.rightCols<1>();
  const Problem& plant = *steps_.problem;
  const Eigen::Index n_q = q.size(), n_u = problem_.info().n_u;
  Vector x(2 * n_q + sides.size()), u(n_u + sides.size());
  x << q, v, sides;
  u << problem_.info().u, sides;
  Matrix J = Matrix::Zero(steps_.size(), x.size());
  steps_.switching.jacobian(x.data(), J.data());
  const CholeskyFactors M(plant.mass_matrix(q));
  const auto count = static_cast<Eigen::Index>(on.size());
  Matrix by_velocity(count, count), by_position(count, count), size(count, count);
  for (Eigen::Index column = 0; column < count; ++column) {
    Vector F[2] = {Vector(n_q), Vector(n_q)};
    for (const int side : {0, 1}) {
      Vector on_side = u;
      on_side[n_u + on[column]] = side;
      plant.force(q.data(), v.data(), on_side.data(), F[side].data());
    }
    const Vector jump = M.solve(Vector(F[1] - F[0])), terms = M.solve(F[0]).cwiseAbs() + M.solve(F[1]).cwiseAbs();
    for (Eigen::Index row = 0; row < count; ++row) {
      by_velocity(row, column) = J.row(on[row]).segment(n_q, n_q).dot(jump);
      by_position(row, column) = J.row(on[row]).head(n_q).dot(jump);
      size(row, column) =
          J.row(on[row]).head(n_q).cwiseAbs().dot(terms) + J.row(on[row]).segment(n_q, n_q).cwiseAbs().dot(terms);
    }
  }
  const double none = kNoInfluence * size.maxCoeff();
  const Matrix& D = by_velocity.cwiseAbs().maxCoeff() > none ? by_velocity : by_position;
  if (D.cwiseAbs().maxCoeff() <= none) return {};  // a corner
  if (is_P(-D)) return {};
  std::string formulas;
  for (const int k : on)
    formulas += (formulas.empty() ? "" : ", ") + problem_.info().switches[static_cast<std::size_t>(k)].formula;
  return fmt::format("the motion stays where {} = 0, and both sides lead away, or may: it is not unique", formulas);
}

std::string SideCheck::operator()(const FesdStep& step, const std::vector<Matrix>& theta, double accuracy) {
  for (int n = 0; n < step.n_elements; ++n) {
    const Element& element = step.elements[static_cast<std::size_t>(n)];
    const Vector sides = sides_of(theta[static_cast<std::size_t>(n)]);
    if (std::string why = leaves(element, sides, accuracy); !why.empty()) return why;
    if (std::string why = is_not_unique(element, sides); !why.empty()) return why;
  }
  return {};
}

}  // namespace ricochet
