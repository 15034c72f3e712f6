#include "methods/control/shooting/certificate.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

/// How far into a piece its gradient is taken, in multiples of the distance at which a guard is active, and of that to the
/// farthest border. J curves so much where a switch is steep that the gradient is extrapolated from twice this.
constexpr double kProbe = 0.1, kBeyond = 30;
/// Guards whose gradients are parallel up to this are one border.
constexpr double kParallel = 1e-6;
/// Part of the first-order change that a difference of costs may miss before it counts as a jump.
constexpr double kJump = 0.3;
/// Rounding of a cost, relative.
constexpr double kCostRounding = 1e-13;
/// An inequality of a stage is active if a change of the controls of this part of their scales reaches it. No slope is
/// looked at where it would have to exceed the second number.
constexpr double kActiveConstraint = 1e-6, kSteepest = 1e5;

/// Tolerances of a linear program, one after the other.
constexpr double kLinearTolerances[] = {1e-9, 1e-7};

using Gradient = ShootingProgram::Gradient;

/// All controls, then H if it is free, relative to their scales.
class ScaledControls {
 public:
  ScaledControls(const ShootingProgram& program, Eigen::Index N, bool has_H)
      : scale_(program.scale()), N_(N), H_scale_(program.H_scale()), has_H_(has_H) {}

  Eigen::Index size() const { return scale_.size() * N_ + (has_H_ ? 1 : 0); }
  Vector of(const Gradient& gradient) const {
    Vector g(size());
    g.head(scale_.size() * N_) = (gradient.u.array().colwise() * scale_.array()).matrix().reshaped();
    if (has_H_) g[size() - 1] = gradient.H * H_scale_;
    return g;
  }
  Matrix controls(const Vector& d) const {
    return (d.head(scale_.size() * N_).reshaped(scale_.size(), N_).array().colwise() * scale_.array()).matrix();
  }
  double H(const Vector& d) const { return has_H_ ? d[size() - 1] * H_scale_ : 0; }

 private:
  const Vector& scale_;
  const Eigen::Index N_;
  const double H_scale_;
  const bool has_H_;
};

/// min g' d subject to rows d >= 0, equal d = 0, lower <= d <= upper, by horizon_qp.h. @return d; none if it is not
/// solved
std::optional<Vector> solve_linear_program(const Vector& g, const Matrix& rows, const Matrix& equal,
                                           const Vector& lower, const Vector& upper,
                                           const std::function<bool()>& is_interrupted) {
  const Eigen::Index n = g.size();
  const double largest = g.lpNorm<Eigen::Infinity>();
  if (!(largest > 0)) return Vector::Zero(n);
  HorizonQp qp;
  qp.dx_0 = Vector::Zero(1);
  qp.stages.resize(1);
  HorizonStage& stage = qp.stages[0];
  stage.A = Matrix::Zero(1, 1);
  stage.B = Matrix::Zero(1, n);
  stage.c = Vector::Zero(1);
  stage.H = Matrix::Zero(n + 1, n + 1);
  stage.g.setZero(n + 1);
  stage.g.tail(n) = g / largest;
  stage.C.setZero(rows.rows() + 2 * equal.rows(), n + 1);
  stage.C.rightCols(n) << rows, equal, -equal;
  stage.d = Vector::Zero(stage.C.rows());
  stage.weight = Vector::Constant(stage.C.rows(), 10.0 * static_cast<double>(n));
  stage.lower = lower;
  stage.upper = upper;
  qp.end.H = Matrix::Zero(1, 1);
  qp.end.g = Vector::Zero(1);
  qp.end.C.resize(0, 1);
  qp.end.d.resize(0);
  qp.end.weight.resize(0);
  qp.end.E.resize(0, 1);
  qp.end.r.resize(0);
  qp.end.E_weight.resize(0);
  HorizonQpSolver solver;
  for (const double tolerance : kLinearTolerances) {
    const HorizonQpSolution& solution = solver.solve(qp, {.tolerance = tolerance, .is_interrupted = is_interrupted});
    if (solution.is_solved()) return solution.du[0];
  }
  return std::nullopt;
}

/// Gradients of the inequalities and terminal constraints that are active, by the scaled controls.
struct ActiveConstraints {
  Matrix rows, equal;
};

ActiveConstraints active_constraints(const ShootingProgram& program, const ScaledControls& scaled) {
  std::vector<Vector> rows, equal;
  for (const auto& [gradient, value] : program.constraint_gradients(kActiveConstraint * kSteepest)) {
    const Vector g = scaled.of(gradient);
    if (value <= kActiveConstraint * g.lpNorm<1>()) rows.push_back(g / std::max(g.lpNorm<1>(), 1e-300));
  }
  for (const auto& gradient : program.terminal_gradients()) {
    const Vector g = scaled.of(gradient);
    equal.push_back(g / std::max(g.lpNorm<1>(), 1e-300));
  }
  const auto stacked = [&](const std::vector<Vector>& list) {
    Matrix matrix(static_cast<Eigen::Index>(list.size()), scaled.size());
    for (std::size_t k = 0; k < list.size(); ++k) matrix.row(static_cast<Eigen::Index>(k)) = list[k].transpose();
    return matrix;
  };
  return {stacked(rows), stacked(equal)};
}

/// Sets of b borders that are crossed, as bits: all but the empty one, few borders first, `most` - 1 at most.
std::vector<unsigned> crossed_borders(int b, int most) {
  constexpr int kMostBits = 20;
  std::vector<unsigned> sets;
  const unsigned end = 1U << std::min(b, kMostBits);
  for (int n = 1; n <= b; ++n) {
    for (unsigned set = 1; set < end; ++set) {
      if (static_cast<int>(sets.size()) + 1 >= most) return sets;
      if (std::popcount(set) == n) sets.push_back(set);
    }
  }
  return sets;
}

}  // namespace

std::string Certificate::describe() const {
  std::string text = !is_stationary ? "not B" : n_edges > 0 ? "edge" : "B";
  if (is_stationary && n_unexamined > 0)
    text += fmt::format(" in {} piece{}, {} not examined", n_pieces, n_pieces == 1 ? "" : "s", n_unexamined);
  text += fmt::format(", {} active guard{}, LPEC {:.0e}", n_active, n_active == 1 ? "" : "s", std::abs(lpec));
  if (n_edges > 0) text += fmt::format(", J jumps up to {} of {} neighbours", n_edges, n_pieces - 1);
  return text;
}

Certificate certify(PlantRunner& runner, MotionLineariser& lineariser, ShootingProgram& program,
                    const PlantMotion& motion, double nu, const CertificateOptions& options) {
  const OptimalControlProblem& problem = runner.problem();
  const Eigen::Index N = motion.u.cols(), n_q = runner.plant().n_q();
  const ScaledControls scaled(program, N, problem.is_time_free);
  program.add_guards(motion, lineariser);
  const Vector g_own = scaled.of(program.gradient());
  const double size = 1 + g_own.lpNorm<Eigen::Infinity>();

  Certificate certificate;
  std::vector<Vector> borders;   // gradients of the active guards, of norm 1
  std::vector<double> distance;  // to each of them
  double farthest = 0;           // the largest of them, relative to the scales of the controls
  for (const Guard& guard : program.guards()) {
    const Vector g = scaled.of(program.gradient(guard.interval, guard.slope));
    const double reach = g.lpNorm<1>();
    if (!(reach > 0) || !std::isfinite(reach) || guard.value > options.active * reach) continue;
    const Vector direction = g / g.norm();
    const bool is_known =
        std::ranges::any_of(borders, [&](const Vector& other) { return (other - direction).norm() <= kParallel; });
    if (is_known) continue;
    borders.push_back(direction);
    distance.push_back(std::max(guard.value, 0.0) / g.norm());
    farthest = std::max(farthest, guard.value / reach);
    certificate.active.push_back(guard);
  }
  const auto b = static_cast<Eigen::Index>(borders.size());
  certificate.n_active = static_cast<int>(b);
  Matrix G(b, scaled.size());
  for (Eigen::Index k = 0; k < b; ++k) G.row(k) = borders[static_cast<std::size_t>(k)].transpose();
  const Matrix G_inverse = b > 0 ? pseudo_inverse(G) : Matrix(scaled.size(), 0);

  Vector lower = Vector::Constant(scaled.size(), -1), upper = -lower;
  for (Eigen::Index k = 0; k < N; ++k) {
    for (Eigen::Index c = 0; c < motion.u.rows(); ++c) {
      const double u = motion.u(c, k), s = program.scale()[c];
      if (u - problem.u.lower[c] <= kActiveConstraint * s) lower[k * motion.u.rows() + c] = 0;
      if (problem.u.upper[c] - u <= kActiveConstraint * s) upper[k * motion.u.rows() + c] = 0;
    }
  }
  if (problem.is_time_free) {
    if (motion.H <= program.H_lower() * (1 + kActiveConstraint)) lower[scaled.size() - 1] = 0;
    if (motion.H >= program.H_upper() * (1 - kActiveConstraint)) upper[scaled.size() - 1] = 0;
  }

  const auto unit = [](Vector d) {
    const double length = d.size() > 0 ? d.lpNorm<Eigen::Infinity>() : 0;
    return length > 0 ? Vector(d / length) : d;
  };
  const auto direction = [&](const Vector& d) { return Certificate::Direction{scaled.controls(d), scaled.H(d)}; };
  /// @param rise  of the cost up to the borders of the piece, which may be reached up to rounding only
  const auto examine = [&](const Vector& g, const Vector& signs, const ShootingProgram& piece, double rise) {
    const ActiveConstraints constraints = active_constraints(piece, scaled);
    Matrix rows(b + constraints.rows.rows(), scaled.size());
    rows << signs.asDiagonal() * G, constraints.rows;
    const auto d = solve_linear_program(g, rows, constraints.equal, lower, upper, options.is_interrupted);
    if (!d) {
      ++certificate.n_unexamined;
      return;
    }
    ++certificate.n_pieces;
    const double value = g.dot(*d) / size;
    // What a step along d gains: where the cost is strongly curved, that may be less than its rounding.
    const double slope = std::max(-g.dot(*d), 0.0), curvature = piece.curvature(scaled.controls(*d), scaled.H(*d)),
                 gain = (slope > curvature ? slope - 0.5 * curvature : 0.5 * slope * slope / curvature) - rise;
    const bool descends = value < -options.tolerance;
    if (descends && gain <= kCostRounding * (1 + std::abs(motion.cost))) return;
    certificate.lpec = std::min(certificate.lpec, value);
    if (!descends) return;
    const Vector into = unit(G_inverse * signs);
    certificate.descents.push_back({value, direction(*d), direction(into), g.dot(into) / size});
  };
  const auto merit = [&](const PlantMotion& m) { return m.cost + nu * (m.violation + m.terminal.lpNorm<1>()); };

  examine(g_own, Vector::Ones(b), program, 0);
  const bool is_own_examined = certificate.n_pieces == 1;
  const std::vector<unsigned> sets = crossed_borders(static_cast<int>(b), options.max_pieces);
  certificate.n_unexamined +=
      static_cast<int>(std::min(std::exp2(static_cast<double>(b)) - 1 - static_cast<double>(sets.size()), 1e9));
  PlantMotion neighbour;
  ShootingProgram its_program(runner);
  const Vector x = motion.x.col(0);
  const auto is_interrupted = [&] { return options.is_interrupted && options.is_interrupted(); };
  for (const unsigned set : sets) {
    if (is_interrupted()) return certificate;
    Vector signs = Vector::Ones(b);
    for (Eigen::Index k = 0; k < std::min<Eigen::Index>(b, 31); ++k) {
      if ((set >> k & 1U) != 0) signs[k] = -1;
    }
    const Vector into = G_inverse * signs;
    if (((G * into).array() * signs.array()).minCoeff() < 0.5) continue;  // no direction leads there
    const double epsilon = std::max(kProbe * options.active, kBeyond * farthest) /
                           std::max(into.lpNorm<Eigen::Infinity>(), 1e-12) *
                           std::sqrt(static_cast<double>(scaled.size()));
    const auto run_into = [&](double t) {
      runner.run(x.head(n_q), x.tail(n_q), problem.u.clamp(motion.u + t * scaled.controls(into)),
                 motion.H + t * scaled.H(into), neighbour);
      if (!neighbour.succeeded() || !lineariser.linearise(neighbour).empty()) return false;
      its_program.set(neighbour, lineariser);
      return true;
    };
    const auto is_edge = [&] {
      ++certificate.n_edges;
      ++certificate.n_pieces;
    };
    Vector farther;
    if (run_into(2 * epsilon)) farther = scaled.of(its_program.gradient());
    const PlantMotion far = neighbour;
    if (is_interrupted()) return certificate;
    if (!run_into(epsilon)) {
      if (is_interrupted()) return certificate;
      is_edge();
      continue;
    }
    const Vector beyond = scaled.of(its_program.gradient());
    // At the border, from where the neighbour is: the cost may be curved so that its gradient differs a lot.
    const bool is_curve_known = farther.size() > 0 && has_same_sequence(far, neighbour);
    const Vector g =
        is_curve_known
            ? Vector(2 * beyond - farther)
            : scaled.of(its_program.gradient_after(-epsilon * scaled.controls(into), -epsilon * scaled.H(into)));
    const double change = merit(neighbour) - merit(motion), smooth = 0.5 * epsilon * (g + beyond).dot(into),
                 own = epsilon * g_own.dot(into), jump = change - smooth;
    const bool jumps =
        std::abs(jump) > kJump * (std::abs(smooth) + std::abs(own)) + kCostRounding * (1 + std::abs(merit(motion)));
    if (jumps && jump > 0) {
      is_edge();
      continue;
    }
    if (jumps && change < -options.tolerance * epsilon * size - kCostRounding * (1 + std::abs(merit(motion)))) {
      certificate.lpec = -std::numeric_limits<double>::infinity();
      certificate.jump = Certificate::Direction{epsilon * scaled.controls(into), epsilon * scaled.H(into)};
      ++certificate.n_pieces;
      return certificate;
    }
    double reach = 0;  // of the farthest border
    for (Eigen::Index k = 0; k < b; ++k) {
      if (signs[k] < 0) reach = std::max(reach, distance[static_cast<std::size_t>(k)] / std::abs(G.row(k).dot(into)));
    }
    const double rise =
        reach * g_own.dot(into) + 0.5 * reach * reach * program.curvature(scaled.controls(into), scaled.H(into));
    examine(g, signs, its_program, std::max(rise, 0.0));
  }
  std::ranges::sort(certificate.descents, {}, &Certificate::Descent::value);
  certificate.is_stationary = is_own_examined && certificate.descents.empty();
  return certificate;
}

}  // namespace ricochet
