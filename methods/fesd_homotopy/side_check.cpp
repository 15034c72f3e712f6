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
constexpr double kNoInfluence = 1e-9;  // of the terms of (2), (3): zero
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

/// n_s x (2 n_q + n_s), of psi.
Matrix SideCheck::derivative(const Vector& q, const Vector& v, const Vector& sides) const {
  Vector x(q.size() + v.size() + sides.size());
  x << q, v, sides;
  Matrix J = Matrix::Zero(steps_.size(), x.size());
  steps_.switching.jacobian(x.data(), J.data());
  return J;
}

Vector SideCheck::acceleration(const Vector& q, const Vector& v, Vector sides, int k, int side) const {
  sides[k] = side;
  Vector u(problem_.info().n_u + sides.size()), F(q.size());
  u << problem_.info().u, sides;
  steps_.problem->force(q.data(), v.data(), u.data(), F.data());
  return CholeskyFactors(problem_.mass_matrix(q)).solve(F);
}

/// (b), at the last stage
std::string SideCheck::is_not_unique(const Element& element, const Vector& sides) const {
  std::vector<int> on;
  for (int k = 0; k < sides.size(); ++k) {
    if (!is_side(sides[k])) on.push_back(k);
  }
  if (on.empty()) return {};
  const Vector q = element.q.rightCols<1>(), v = element.v.rightCols<1>();
  const Eigen::Index n_q = q.size();
  const Matrix J = derivative(q, v, sides);
  const auto count = static_cast<Eigen::Index>(on.size());
  Matrix by_velocity(count, count), by_position(count, count), size(count, count);
  for (Eigen::Index column = 0; column < count; ++column) {
    const Vector above = acceleration(q, v, sides, on[column], 1), below = acceleration(q, v, sides, on[column], 0);
    const Vector jump = above - below, terms = above.cwiseAbs() + below.cwiseAbs();
    for (Eigen::Index row = 0; row < count; ++row) {
      const auto of_q = J.row(on[row]).head(n_q), of_v = J.row(on[row]).segment(n_q, n_q);
      by_velocity(row, column) = of_v.dot(jump);
      by_position(row, column) = of_q.dot(jump);
      size(row, column) = (of_q.cwiseAbs() + of_v.cwiseAbs()).dot(terms);
    }
  }
  const double none = kNoInfluence * size.maxCoeff();
  std::vector<int> jumping;  // the others are corners
  std::string formulas;
  for (int c = 0; c < count; ++c) {
    if (std::max(by_velocity.col(c).cwiseAbs().maxCoeff(), by_position.col(c).cwiseAbs().maxCoeff()) <= none) continue;
    jumping.push_back(c);
    formulas += (formulas.empty() ? "" : ", ") + problem_.info().switches[static_cast<std::size_t>(on[c])].formula;
  }
  if (jumping.empty()) return {};
  const Matrix D = -(by_velocity.cwiseAbs().maxCoeff() > none ? by_velocity : by_position)(jumping, jumping);
  if (is_P(D)) return {};
  return fmt::format("the motion stays where {} = 0, and both sides lead away, or may: it is not unique", formulas);
}

/// (c), at the left end
std::string SideCheck::branches(const Element& element, const Vector& sides, double accuracy) const {
  const Vector &q = element.q0, &v = element.v0;
  const Eigen::Index n_q = q.size();
  const Vector psi = steps_.switching.at(q, v, sides), size = steps_.sizes(q, v, sides);
  const Matrix J = derivative(q, v, sides);
  const Vector of_contacts =
      CholeskyFactors(problem_.mass_matrix(q))
          .solve(Vector(problem_.force_directions(problem_.normal_jacobian(q)) * element.lambda_n.col(0) +
                        problem_.force_directions(problem_.tangent_jacobian(q)) * element.lambda_t.col(0)));
  for (int k = 0; k < psi.size(); ++k) {
    if (std::abs(psi[k]) > accuracy * size[k]) continue;
    const auto of_q = J.row(k).head(n_q), of_v = J.row(k).segment(n_q, n_q);
    double rate[2], second[2], terms = of_q.cwiseAbs().dot((1 + v.array().abs()).matrix()), second_terms = 0;
    for (const int side : {0, 1}) {
      const Vector a = acceleration(q, v, sides, k, side) + of_contacts;
      rate[side] = of_q.dot(v) + of_v.dot(a);
      second[side] = of_q.dot(a);
      terms += of_v.cwiseAbs().dot(a.cwiseAbs());
      second_terms += of_q.cwiseAbs().dot(a.cwiseAbs());
    }
    const double none = kNoInfluence * terms, no_second = kNoInfluence * second_terms;
    const bool is_zero = std::abs(rate[0]) <= none && std::abs(rate[1]) <= none;
    const bool leads_away =
        is_zero ? second[1] > no_second && second[0] < -no_second : rate[1] > none && rate[0] < -none;
    if (leads_away)
      return fmt::format("both sides of {} = 0 lead away from it: the motion is not unique",
                         problem_.info().switches[static_cast<std::size_t>(k)].formula);
  }
  return {};
}

std::string SideCheck::operator()(const FesdStep& step, const std::vector<Matrix>& theta, double accuracy,
                                  bool is_start) {
  for (int n = 0; n < step.n_elements; ++n) {
    const Element& element = step.elements[static_cast<std::size_t>(n)];
    const Vector sides = sides_of(theta[static_cast<std::size_t>(n)]);
    if (std::string why = leaves(element, sides, accuracy); !why.empty()) return why;
    if (std::string why = is_not_unique(element, sides); !why.empty()) return why;
    const bool is_new = (is_start && n == 0) || (step.Lambda_n.rows() > 0 && step.Lambda_n.col(n).maxCoeff() > 0);
    if (!is_new) continue;
    if (std::string why = branches(element, sides, accuracy); !why.empty()) return why;
  }
  return {};
}

}  // namespace ricochet
