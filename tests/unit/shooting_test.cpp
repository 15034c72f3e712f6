// Optimal control over rollouts: derivatives of an interval, the iteration, and its certificate.
#include "methods/control/shooting/shooting.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <functional>
#include <random>
#include <thread>

#include "bench/control/replay.h"
#include "bench/studies/control/gradient.h"
#include "methods/control/exploration.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "problems/control/control_scene.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

/// A mass falls on a floor or lies on it, and a control lifts it.
template <class T>
struct LiftedMass {
  static constexpr SceneText text{"lifted_mass", "a mass over a floor", "ours", "one impact"};
  T e{0.5}, height{1.0}, u_guess{0.0}, target{0.5}, by_height{10.0}, by_speed{0.1}, by_control{0.1}, linear{0.0};

  void parameters(auto&& visit) {
    visit("e", e, "1");
    visit("height", height, "m");
    visit("u_guess", u_guess, "N");
    visit("target", target, "m");
    visit("by_height", by_height, "1");
    visit("by_speed", by_speed, "1");
    visit("by_control", by_control, "1");
    visit("linear", linear, "1");
  }
  Vec<T, 1> q0() const { return {height}; }
  Vec<T, 1> v0() const { return {0}; }
  T end_time() const { return 1; }
  Vec<T, 1> mass() const { return {1}; }
  Vec<T, 1> force(const Vec<T, 1>&, const Vec<T, 1>&) const { return {-10}; }
  Mat<T, 1, 1> input(const Vec<T, 1>&) const { return {{{1}}}; }
  Vec<T, 1> control() const { return {u_guess}; }
  std::array<Contact<T>, 1> contacts() const { return {{{"floor", e}}}; }
  Vec<T, 1> gap(const Vec<T, 1>& q) const { return {q[0]}; }

  ControlGrid grid() const { return {2, 2, "radau-iia:2"}; }
  ControlBounds<1, 1> bounds() const { return {every<1>(-5), every<1>(5), every<1>(-50), every<1>(50), {-5}, {20}}; }
  T running_cost(const Vec<T, 1>&, const Vec<T, 1>&, const Vec<T, 1>& u) const {
    return by_control * u[0] * u[0] - linear * u[0];
  }
  T terminal_cost(const Vec<T, 1>& q, const Vec<T, 1>& v) const {
    return by_height * (q[0] - target) * (q[0] - target) + by_speed * v[0] * v[0];
  }
};

std::unique_ptr<OptimalControlProblem> lifted_mass(const ParameterChanges& changes, int N) {
  auto problem = scene_detail::make_control<LiftedMass>(scene_with<LiftedMass>(changes));
  problem->n_intervals = N;
  validate(*problem);
  return problem;
}

/// Derivatives of all stages, element lengths and ends by all controls and H, as one long column per variable.
Matrix all_derivatives(PlantRunner& runner, const PlantMotion& motion) {
  MotionLineariser lineariser(runner);
  EXPECT_EQ(lineariser.linearise(motion), "");
  const Eigen::Index n_q = runner.plant().n_q(), n_u = motion.u.rows(), N = motion.u.cols(), n = n_u * N + 1;
  std::vector<Matrix> blocks;
  Matrix x = Matrix::Zero(2 * n_q, n);
  for (Eigen::Index k = 0; k < N; ++k) {
    const LinearisedInterval& interval = lineariser.intervals()[static_cast<std::size_t>(k)];
    Matrix theta = Matrix::Zero(2 * n_q + n_u + 1, n);
    theta.topRows(2 * n_q) = x;
    theta.block(2 * n_q, n_u * k, n_u, n_u).setIdentity();
    theta(2 * n_q + n_u, n - 1) = 1;
    for (const auto& element : interval.elements) {
      blocks.push_back(element.q.leftCols(theta.rows()) * theta);
      blocks.push_back(element.v.leftCols(theta.rows()) * theta);
      blocks.push_back(element.h.transpose() * theta);
    }
    x = interval.x * theta;
    blocks.push_back(x);
  }
  Eigen::Index rows = 0;
  for (const auto& block : blocks) rows += block.rows();
  Matrix all(rows, n);
  rows = 0;
  for (const auto& block : blocks) {
    all.middleRows(rows, block.rows()) = block;
    rows += block.rows();
  }
  return all;
}

Vector all_values(const PlantMotion& motion) {
  std::vector<double> values;
  for (std::size_t k = 0; k < motion.steps.size(); ++k) {
    for (int n = 0; n < motion.steps[k].n_elements; ++n) {
      const Element& e = motion.steps[k].elements[n];
      values.insert(values.end(), e.q.data(), e.q.data() + e.q.size());
      values.insert(values.end(), e.v.data(), e.v.data() + e.v.size());
      values.push_back(e.h);
    }
    const Vector x = motion.x.col(static_cast<Eigen::Index>(k) + 1);
    values.insert(values.end(), x.begin(), x.end());
  }
  return Eigen::Map<const Vector>(values.data(), static_cast<Eigen::Index>(values.size()));
}

struct Sequence {
  int impacts = 0, breaks = 0, stops = 0, slips = 0;
};
Sequence sequence_of(const PlantMotion& motion) {
  Sequence s;
  for (const FesdStep& step : motion.steps) {
    for (int n = 0; n < step.n_elements; ++n) {
      s.impacts += step.touches && !step.Lambda_n.col(n).isZero(0);
      if (step.ends[n].contact < 0) continue;
      s.breaks += step.ends[n].kind == SwitchKind::force_vanishes;
      s.stops += step.ends[n].kind == SwitchKind::slip_stops;
      s.slips += step.ends[n].kind == SwitchKind::cone_reached;
    }
  }
  return s;
}

/// Whether both motions exist and have one sequence, for all changes of a control or of H that a difference takes.
bool is_away_from_borders(PlantRunner& runner, const PlantMotion& motion, double delta) {
  const ProblemInfo& info = runner.plant().info();
  PlantMotion varied;
  for (Eigen::Index variable = 0; variable <= motion.u.size(); ++variable) {
    for (const int place : {-2, 2}) {
      Matrix u = motion.u;
      const bool is_H = variable == u.size();
      if (!is_H) u.reshaped()[variable] += place * delta;
      runner.run(info.q0, info.v0, u, motion.H * (is_H ? 1 + place * delta : 1), varied);
      if (!varied.succeeded() || !has_same_sequence(motion, varied)) return false;
    }
  }
  return true;
}

/// Compares all derivatives with central differences of fourth order of the motion.
void expect_right_derivatives(PlantRunner& runner, const PlantMotion& motion, double change, double tolerance) {
  const ProblemInfo& info = runner.plant().info();
  const Matrix derivatives = all_derivatives(runner, motion);
  PlantMotion varied;
  for (Eigen::Index variable = 0; variable <= motion.u.size(); ++variable) {
    const bool is_H = variable == motion.u.size();
    const double delta = change * (is_H ? motion.H : 1);
    Vector difference = Vector::Zero(derivatives.rows());
    for (const auto& [place, weight] : {std::pair{1, 8}, {-1, -8}, {2, -1}, {-2, 1}}) {
      Matrix u = motion.u;
      if (!is_H) u.reshaped()[variable] += place * delta;
      runner.run(info.q0, info.v0, u, motion.H + (is_H ? place * delta : 0), varied);
      difference += weight / (12 * delta) * all_values(varied);
    }
    const double error = (difference - derivatives.col(variable)).lpNorm<Eigen::Infinity>();
    EXPECT_LE(error, tolerance * (1 + difference.lpNorm<Eigen::Infinity>())) << info.id << ", variable " << variable;
  }
}

/// The motion of the first random controls, up to `size` each around those of the problem, that is wanted and keeps its
/// sequence under changes up to delta. @return no steps, and a failed test, if there is none
PlantMotion first_wanted_motion(PlantRunner& runner, unsigned seed, double size, double delta,
                                const std::function<bool(const Sequence&)>& is_wanted) {
  const OptimalControlProblem& problem = runner.problem();
  const ProblemInfo& info = problem.plant->info();
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-size, size);
  PlantMotion motion;
  for (int attempt = 0; attempt < 2000; ++attempt) {
    Matrix u = Matrix::NullaryExpr(info.n_u, problem.n_intervals, [&] { return uniform(random); });
    u.colwise() += info.u;
    runner.run(info.q0, info.v0, u, info.end_time / problem.n_intervals, motion);
    if (motion.succeeded() && is_wanted(sequence_of(motion)) && is_away_from_borders(runner, motion, delta))
      return motion;
  }
  ADD_FAILURE() << problem.id << ": no such motion was found";
  return {};
}

/// The same for the first random controls whose motion is wanted.
/// @param change  of a control; a smaller one shows the tolerance of the motion, a larger one its higher derivatives
void expect_right_derivatives(const OptimalControlProblem& problem, double size, double tolerance,
                              const std::function<bool(const Sequence&)>& is_wanted, double change = 1e-3) {
  PlantRunner runner(problem, tableau_argument(problem.tableau));
  const PlantMotion motion = first_wanted_motion(runner, 1, size, 5 * change, is_wanted);
  if (!motion.steps.empty()) expect_right_derivatives(runner, motion, change, tolerance);
}

/// Compares the derivatives of the state at T with differences of CVODE with events, for the first random controls whose
/// motion is wanted. @param n  intervals, whose elements are so short that their own error does not matter
void expect_derivatives_of_plant(OptimalControlProblem& problem, int n, double size,
                                 const std::function<bool(const Sequence&)>& is_wanted, double change = 1e-3) {
  problem.tableau = "radau-iia:5";
  problem.n_intervals = n;
  problem.n_fe = 8;
  PlantRunner runner(problem, tableau_argument(problem.tableau));
  const PlantMotion motion = first_wanted_motion(runner, 2, size, 4 * change, is_wanted);
  if (motion.steps.empty()) return;
  const Matrix all = all_derivatives(runner, motion);
  const Matrix ours = all.bottomRows(2 * runner.plant().n_q()).leftCols(motion.u.size());
  const Matrix truth = gradient_by_differences(problem, runner.trajectory(motion), reference_solver(1e-12), change);
  // The reference is good to its tolerance over the change.
  EXPECT_LE((ours - truth).cwiseAbs().maxCoeff(), 1e-6 * (1 + truth.cwiseAbs().maxCoeff())) << problem.id;
}

TEST(LinearisedInterval, AgreesWithDifferencesOfThePlant) {
  expect_derivatives_of_plant(*make_control_problem("two_carts"), 6, 4,
                              [](const Sequence& s) { return s.impacts >= 1; });
  const auto pole = make_control_problem("cart_pole_friction");
  expect_derivatives_of_plant(*pole, 6, 4, [](const Sequence& s) { return s.stops >= 1; });
  expect_derivatives_of_plant(*pole, 6, 4, [](const Sequence& s) { return s.slips >= 1; });
  expect_derivatives_of_plant(*make_control_problem("hopper"), 6, 10, [](const Sequence& s) { return s.breaks >= 1; });
  expect_derivatives_of_plant(
      *make_control_problem("discs"), 25, 20, [](const Sequence& s) { return s.impacts >= 1; }, 1e-4);
}

TEST(LinearisedInterval, GoesThroughImpacts) {
  expect_right_derivatives(*lifted_mass({}, 3), 3, 1e-9, [](const Sequence& s) { return s.impacts == 1; });
  expect_right_derivatives(*make_control_problem("two_carts"), 4, 1e-6,
                           [](const Sequence& s) { return s.impacts >= 1; });
}

// Differences of motions that Newton's method solves to 1e-13 of a pole that swings, over 1e-3.
TEST(LinearisedInterval, GoesThroughSticksAndSlips) {
  const auto problem = make_control_problem("cart_pole_friction");
  expect_right_derivatives(*problem, 4, 1e-6, [](const Sequence& s) { return s.stops >= 1; });
  expect_right_derivatives(*problem, 4, 1e-6, [](const Sequence& s) { return s.slips >= 1; });
}

TEST(LinearisedInterval, GoesThroughBreaks) {
  expect_right_derivatives(*make_control_problem("hopper"), 10, 1e-6, [](const Sequence& s) { return s.breaks >= 1; });
}

// The closed contacts of the boxes are redundant, and impacts happen between boxes that slide.
TEST(LinearisedInterval, GoesThroughImpactsOfSlidingBoxes) {
  expect_right_derivatives(*make_control_problem("three_boxes"), 10, 1e-6,
                           [](const Sequence& s) { return s.impacts >= 2 && s.stops >= 1; });
}

// The contacts of the discs are curved, and their drag turns from viscous to dry within a tenth of an element.
TEST(LinearisedInterval, GoesAlongCurvedContacts) {
  expect_right_derivatives(
      *make_control_problem("discs"), 20, 1e-6, [](const Sequence& s) { return s.impacts >= 1; }, 1e-4);
}

// A fall from a height that ends with the first interval; the control is the same after it.
TEST(LinearisedInterval, GoesThroughAnImpactOnABoundary) {
  const auto problem = lifted_mass({{"height", 1.25}}, 2);  // 10 t^2 / 2 at 0.5 s
  PlantRunner runner(*problem, tableau_argument(problem->tableau));
  PlantMotion motion;
  runner.run(problem->plant->info().q0, problem->plant->info().v0, Matrix::Zero(1, 2), 0.5, motion);
  ASSERT_TRUE(motion.succeeded());
  ASSERT_GT(motion.steps[1].Lambda_n(0, 0), 0) << "the impact is at the start of the second interval";
  MotionLineariser lineariser(runner);
  ASSERT_EQ(lineariser.linearise(motion), "");
  const Matrix &first = lineariser.intervals()[0].x, &second = lineariser.intervals()[1].x;
  const Vector by_u = second.leftCols(2) * first.col(2);
  // Before the floor: v- = -a t, a = 10 - u, t = sqrt(2.5 / a), v+ = sqrt(2.5 a) / 2; then for 1 - t under 10.
  // dv+/du = -sqrt(2.5 / 10) / 4, dt/du = sqrt(2.5) / 2 / 10^1.5; v = v+ - 10 (1 - t), q = v+ (1 - t) - 5 (1 - t)^2.
  const double dv = -0.125, dt = 0.025, v = 2.5;
  EXPECT_NEAR(by_u[1], dv + 10 * dt, 1e-10);
  EXPECT_NEAR(by_u[0], dv * 0.5 - v * dt + 10 * 0.5 * dt, 1e-10);
}

// As many elements before an impact as after it, wherever it is: the cost, which is not linear along the motion, does not
// jump where the impact moves from one element or interval to the next.
TEST(PlantMotion, ItsCostChangesContinuouslyWhereAnImpactMoves) {
  const auto problem = make_control_problem("two_carts");
  const ProblemInfo& info = problem->plant->info();
  PlantRunner runner(*problem, tableau_argument(problem->tableau));
  PlantMotion motion;
  const int N = problem->n_intervals;
  double before = 0, change_before = 0;
  int n_places = 0, last = -1;
  for (int k = 0; k <= 400; ++k) {
    Matrix u = Matrix::Constant(1, N, 3 + 0.005 * k);
    runner.run(info.q0, info.v0, u, info.end_time / N, motion);
    ASSERT_TRUE(motion.succeeded()) << motion.message;
    int place = -1;
    for (std::size_t i = 0; i < motion.steps.size() && place < 0; ++i) {
      for (int n = 0; n < motion.steps[i].n_elements; ++n) {
        if (motion.steps[i].ends[n].contact >= 0) place = static_cast<int>(i);
      }
    }
    n_places += place != last;
    last = place;
    const double change = motion.cost - before;
    // The cost is smooth away from jumps: its changes by equal steps differ by little.
    if (k > 1) {
      EXPECT_LE(std::abs(change - change_before), 0.05 * std::abs(change_before) + 1e-3) << k;
    }
    before = motion.cost;
    change_before = change;
  }
  EXPECT_GE(n_places, 2) << "the impact moves through several intervals";
}

/// J of the mass under two controls, in closed form, for an impact in the second half.
long double closed_form(long double u_1, long double u_2, long double height, long double e) {
  const long double a = 10 - u_1, b = 10 - u_2, q = height - a / 8, v = -a / 2;  // at 0.5 s
  const long double s = (v + std::sqrt(v * v + 2 * b * q)) / b, after = e * (b * s - v), rest = 0.5L - s;
  const long double end = after * rest - b * rest * rest / 2, speed = after - b * rest;
  return 10 * (end - 0.5L) * (end - 0.5L) + 0.1L * speed * speed + 0.1L * (u_1 * u_1 + u_2 * u_2) / 2;
}

// Where an impact is on the boundary of two intervals with different controls, J has a kink. Its slopes there are those of
// an impact a little after the boundary, with the running cost of the time up to it, and the guard keeps the impact there.
TEST(ShootingProgram, HasTheSlopesOfAnImpactAfterABoundary) {
  const auto problem = lifted_mass({{"height", 1.0}}, 2);
  PlantRunner runner(*problem, tableau_argument(problem->tableau));
  PlantMotion motion;
  runner.run(problem->plant->info().q0, problem->plant->info().v0, Matrix{{2, 5}}, 0.5, motion);
  ASSERT_TRUE(motion.succeeded());
  ASSERT_GT(motion.steps[1].Lambda_n(0, 0), 0) << "the impact is at the start of the second interval";
  MotionLineariser lineariser(runner);
  ASSERT_EQ(lineariser.linearise(motion), "");
  ShootingProgram program(runner);
  program.set(motion, lineariser);
  const Matrix slopes = program.gradient().u;
  const auto J = [](long double a, long double b) { return closed_form(a, b, 1, 0.5L); };
  const long double h = 1e-5L;  // the closed form is smooth on both sides of the boundary
  EXPECT_NEAR(slopes(0, 0), static_cast<double>((J(2 + h, 5) - J(2 - h, 5)) / (2 * h)), 1e-8);
  EXPECT_NEAR(slopes(0, 1), static_cast<double>((J(2, 5 + h) - J(2, 5 - h)) / (2 * h)), 1e-8);
  program.add_guards(motion, lineariser);
  int n_at_boundary = 0;
  for (const Guard& guard : program.guards()) {
    if (guard.kind != Guard::Kind::gap || guard.interval != 0 || std::abs(guard.value) > 1e-9) continue;
    ++n_at_boundary;
    EXPECT_NEAR(program.gradient(guard.interval, guard.slope).u(0, 0), 0.125, 1e-10) << "less load, later impact";
  }
  EXPECT_EQ(n_at_boundary, 1);
}

TEST(Shooting, FindsAnOptimumInClosedForm) {
  const auto problem = lifted_mass({{"height", 1.5}}, 2);
  Shooting shooting(*problem, tableau_argument(problem->tableau), {});
  const ControlSolution solution = shooting.solve(Matrix::Zero(1, 2), 1);
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  const Matrix& u = solution.trajectory.u;
  EXPECT_NEAR(solution.trajectory.objective, static_cast<double>(closed_form(u(0, 0), u(0, 1), 1.5L, 0.5L)), 1e-12);
  // Newton's method on differences of the closed form, of fourth order in long double.
  long double x = u(0, 0), y = u(0, 1);
  const long double h = 1e-3L;
  const auto J = [](long double a, long double b) { return closed_form(a, b, 1.5L, 0.5L); };
  const auto slope = [&](const auto& f) { return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h); };
  for (int k = 0; k < 4; ++k) {
    const long double gx = slope([&](long double d) { return J(x + d, y); }),
                      gy = slope([&](long double d) { return J(x, y + d); }),
                      xx = (J(x + h, y) - 2 * J(x, y) + J(x - h, y)) / (h * h),
                      yy = (J(x, y + h) - 2 * J(x, y) + J(x, y - h)) / (h * h),
                      xy = (J(x + h, y + h) - J(x + h, y - h) - J(x - h, y + h) + J(x - h, y - h)) / (4 * h * h),
                      det = xx * yy - xy * xy;
    x -= (yy * gx - xy * gy) / det;
    y -= (xx * gy - xy * gx) / det;
  }
  EXPECT_NEAR(u(0, 0), static_cast<double>(x), 1e-9);
  EXPECT_NEAR(u(0, 1), static_cast<double>(y), 1e-9);
  EXPECT_EQ(solution.stationarity.substr(0, 2), "B,");
}

// A mass of weight 10 lies on the floor. J falls with the control by 1 per newton until it lifts the mass; from then on
// it changes by -1 + by_height (u - 10) / 4 + ..., with target = 0 at once by nothing: the slope of the height is given
// by its linear part, -2 by_height target / 2.
TEST(Shooting, CertifiesAKink) {
  // E = by_height (q - target)^2, q = (u - 10) / 2: right slope -1 - by_height target, left slope -1.
  const auto solve = [](double target) {
    const auto problem = lifted_mass({{"height", 0.0},
                                      {"target", target},
                                      {"by_height", 10.0},
                                      {"by_speed", 0.0},
                                      {"by_control", 0.0},
                                      {"linear", 1.0}},
                                     1);
    Shooting shooting(*problem, tableau_argument(problem->tableau), {});
    return shooting.solve(Matrix::Constant(1, 1, 2), 1);
  };
  const ControlSolution held = solve(-1);  // right slope 9
  ASSERT_TRUE(held.succeeded()) << held.message;
  EXPECT_NEAR(held.trajectory.u(0, 0), 10, 1e-6);
  EXPECT_EQ(held.stationarity.substr(0, 17), "B, 1 active guard");
  const ControlSolution lifted = solve(0);  // right slope -1 + 5 (u - 10)
  ASSERT_TRUE(lifted.succeeded()) << lifted.message;
  EXPECT_NEAR(lifted.trajectory.u(0, 0), 10.2, 1e-8);
  EXPECT_EQ(lifted.stationarity.substr(0, 2), "B,");
}

/// The certificate of the lifted mass of CertifiesAKink under a control of 10, where it just lies on the floor.
Certificate certificate_of_kink(double target) {
  const auto problem = lifted_mass({{"height", 0.0},
                                    {"target", target},
                                    {"by_height", 10.0},
                                    {"by_speed", 0.0},
                                    {"by_control", 0.0},
                                    {"linear", 1.0}},
                                   1);
  PlantRunner runner(*problem, tableau_argument(problem->tableau));
  PlantMotion motion;
  runner.run(Vector::Zero(1), Vector::Zero(1), Matrix::Constant(1, 1, 10), 1, motion);
  EXPECT_TRUE(motion.succeeded());
  MotionLineariser lineariser(runner);
  EXPECT_EQ(lineariser.linearise(motion), "");
  ShootingProgram program(runner);
  program.set(motion, lineariser);
  return certify(runner, lineariser, program, motion, 1, {});
}

// Left slope -1; right slope -1 - 10 target, by CertifiesAKink.
TEST(Certificate, TellsWhetherANeighbourDescends) {
  const Certificate held = certificate_of_kink(-1);
  EXPECT_TRUE(held.is_b_stationary()) << held.describe();
  EXPECT_EQ(held.n_pieces, 2);
  const Certificate lifted = certificate_of_kink(0);
  EXPECT_FALSE(lifted.is_stationary) << lifted.describe();
  ASSERT_EQ(lifted.descents.size(), 1U);
  EXPECT_GT(lifted.descents[0].d.u(0, 0), 0) << "lifts";
  // The slope by u / s, with s = 12.5, relative to 1 + the slope of the own piece, which is as large.
  EXPECT_NEAR(lifted.descents[0].value, -12.5 / 13.5, 1e-3);
}

/// A ball that is thrown at the floor, braked before it gets there, and has to be at a place with a speed at the end.
template <class T>
struct BrakedBall {
  static constexpr SceneText text{"braked_ball", "a ball that may just touch the floor", "ours", "a grazing impact"};
  T height{1.5}, place{1.25}, speed{8.0};

  void parameters(auto&& visit) {
    visit("height", height, "m");
    visit("place", place, "m");
    visit("speed", speed, "m/s");
  }
  Vec<T, 1> q0() const { return {height}; }
  Vec<T, 1> v0() const { return {0}; }
  T end_time() const { return 1; }
  Vec<T, 1> mass() const { return {1}; }
  Vec<T, 1> force(const Vec<T, 1>&, const Vec<T, 1>&) const { return {0}; }
  Mat<T, 1, 1> input(const Vec<T, 1>&) const { return {{{1}}}; }
  Vec<T, 1> control() const { return {0}; }
  std::array<Contact<T>, 1> contacts() const { return {{{"floor", 0.5}}}; }
  Vec<T, 1> gap(const Vec<T, 1>& q) const { return {q[0]}; }

  ControlGrid grid() const { return {2, 8, "radau-iia:2"}; }
  ControlBounds<1, 1> bounds() const { return {every<1>(-5), every<1>(5), every<1>(-50), every<1>(50), {-40}, {40}}; }
  T running_cost(const Vec<T, 1>&, const Vec<T, 1>&, const Vec<T, 1>&) const { return 0; }
  T terminal_cost(const Vec<T, 1>& q, const Vec<T, 1>& v) const {
    return (q[0] - place) * (q[0] - place) + (v[0] - speed) * (v[0] - speed);
  }
};

// Controls -9 and 25 would fulfil both, but the ball would dip 3 cm into the floor. Where it touches, it bounces, and is
// too high and too fast at the end: J jumps up. The best motion without an impact just does not touch.
TEST(Certificate, CallsAGrazingImpactAnEdge) {
  const auto problem = scene_detail::make_control<BrakedBall>(scene_with<BrakedBall>({}));
  validate(*problem);
  Shooting shooting(*problem, tableau_argument(problem->tableau), {});
  const ControlSolution solution = shooting.solve(Matrix{{-8, 25}}, 1);
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  EXPECT_EQ(solution.stationarity.substr(0, 20), "edge, 1 active guard") << solution.stationarity;
  EXPECT_GT(solution.trajectory.objective, 1e-3);
  PlantRunner runner(*problem, tableau_argument(problem->tableau));
  PlantMotion motion;
  const Matrix &u = solution.trajectory.u, ideal{{-9, 25}};
  for (const double part : {-1e-3, 1e-3}) {
    runner.run(problem->plant->info().q0, problem->plant->info().v0, u + part * (ideal - u), 0.5, motion);
    EXPECT_GT(motion.cost, solution.trajectory.objective) << part;
  }
}

TEST(Shooting, TakesTheEndTimeAsAnUnknown) {
  const auto problem = lifted_mass({{"height", 1.0}, {"target", 1.5}, {"by_control", 0.01}, {"by_speed", 1.0}}, 2);
  problem->is_time_free = true;
  problem->T_lower = 0.1;
  problem->T_upper = 2;
  Shooting shooting(*problem, tableau_argument(problem->tableau), {});
  const ControlSolution solution = shooting.solve(Matrix::Constant(1, 2, 12), 1);
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  EXPECT_GT(solution.trajectory.T, 0.11);
  EXPECT_LT(solution.trajectory.T, 1.99);
  PlantRunner runner(*problem, tableau_argument(problem->tableau));
  PlantMotion motion;
  for (const double factor : {1 - 1e-4, 1 + 1e-4}) {
    runner.run(problem->plant->info().q0, problem->plant->info().v0, solution.trajectory.u,
               factor * solution.trajectory.T / 2, motion);
    EXPECT_GE(motion.cost, solution.trajectory.objective) << factor;
  }
}

TEST(Shooting, FindsTheImpactOfTwoCarts) {
  const auto problem = make_control_problem("two_carts");
  const ButcherTableau tableau = tableau_argument(problem->tableau);
  const auto found = explore(*problem, tableau, problem->n_fe, {.rounds = 12});
  Shooting shooting(*problem, tableau, {});
  const ControlSolution solution = shooting.solve(found.u, 2);
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  // Found by two other programs, too, with other elements around the impact.
  EXPECT_NEAR(solution.trajectory.objective, 10.511947, 1e-6);
  EXPECT_LE(solution.violation, 1e-9);
}

TEST(Shooting, StatesWhyAGuessCannotBeRun) {
  auto problem = make_control_problem("two_carts");
  Shooting shooting(*problem, tableau_argument(problem->tableau), {});
  EXPECT_THROW(shooting.solve(Matrix::Zero(2, 10), 2), InputError);
  EXPECT_THROW(Shooting(*problem, tableau_argument(problem->tableau), {.max_iterations = 0}), InputError);
  const auto car = make_control_problem("turbo_car");
  EXPECT_THROW(Shooting(*car, tableau_argument(car->tableau), {}), InputError);
  const auto limited = lifted_mass({}, 2);
  Shooting short_one(*limited, tableau_argument(limited->tableau), {.max_iterations = 1});
  const ControlSolution stopped = short_one.solve(Matrix::Zero(1, 2), 1);
  EXPECT_EQ(stopped.status, Status::step_limit);
  EXPECT_EQ(stopped.trajectory.u.cols(), 2) << "the last iterate is a motion all the same";
}

// A clock that advances by 1 s whenever it is read: after the limit has passed, the rollout at hand is the last one, wherever
// the iteration is, in a search for a step, in derivatives, in a quadratic program or in the certificate.
TEST(Shooting, KeepsItsTimeLimitWithinOneRollout) {
  const auto problem = make_control_problem("two_carts");
  const ButcherTableau tableau = tableau_argument(problem->tableau);
  const Matrix guess = explore(*problem, tableau, problem->n_fe, {.rounds = 4}).u;
  int time_limits = 0, limits_within_derivatives = 0;
  for (double limit = 1; limit < 1e5; limit = std::ceil(1.3 * limit)) {
    double time = 0;
    long rollouts = -1, reads_after = 0;
    const Shooting* running = nullptr;
    ShootingOptions options{.time_limit = limit};
    options.clock = [&] {
      time += 1;
      if (time > limit + 1 && rollouts < 0 && running)
        rollouts = running->rollouts();  // the first reading is the start
      reads_after += rollouts >= 0;
      return time;
    };
    Shooting shooting(*problem, tableau, options);
    running = &shooting;
    const ControlSolution solution = shooting.solve(guess, 2);
    ASSERT_TRUE(solution.has_plan()) << limit;
    if (solution.status != Status::time_limit) {
      EXPECT_TRUE(solution.succeeded()) << solution.message;
      break;
    }
    ++time_limits;
    EXPECT_NE(solution.message.find("time limit"), std::string::npos) << solution.message;
    EXPECT_GE(rollouts, 0);
    EXPECT_LE(solution.rollouts, rollouts + 1) << limit;
    EXPECT_LE(reads_after, 20) << "nothing goes on after the limit, where every loop reads the clock";
    limits_within_derivatives += solution.rollouts == rollouts;
  }
  EXPECT_GE(time_limits, 10) << "limits end the iteration at many places";
  EXPECT_GE(limits_within_derivatives, 3);
}

// Other threads solve other problems at the same time: not a bit changes.
TEST(Shooting, DoesNotDependOnWhatRunsBesideIt) {
  const auto problem = make_control_problem("two_carts");
  const ButcherTableau tableau = tableau_argument(problem->tableau);
  const auto solve = [&] {
    const ExplorationResult found = explore(*problem, tableau, problem->n_fe, {.rounds = 6, .seed = 7, .starts = 2});
    return Shooting(*problem, tableau, {.time_limit = 0}).solve(found.starts, 2);
  };
  const ControlSolution alone = solve();
  ASSERT_TRUE(alone.succeeded()) << alone.message;

  std::atomic<bool> is_done = false;
  std::atomic<int> others = 0;
  std::vector<std::unique_ptr<OptimalControlProblem>> problems;
  std::vector<std::unique_ptr<Shooting>> shootings;  // made here: formulas belong to one thread at a time
  std::vector<std::thread> threads;
  for (const char* id : {"push_box_goal", "hopper"}) {
    problems.push_back(make_control_problem(id));
    const OptimalControlProblem& other = *problems.back();
    shootings.push_back(
        std::make_unique<Shooting>(other, tableau_argument(other.tableau), ShootingOptions{.max_iterations = 20}));
  }
  for (std::size_t k = 0; k < shootings.size(); ++k) {
    threads.emplace_back([&, k] {
      const OptimalControlProblem& other = *problems[k];
      while (!is_done) {
        shootings[k]->solve(other.guess(other.n_intervals), other.plant->info().end_time);
        ++others;
      }
    });
  }
  while (others == 0) std::this_thread::yield();
  const ControlSolution beside = solve();
  is_done = true;
  for (std::thread& thread : threads) thread.join();

  EXPECT_EQ(beside.trajectory.u, alone.trajectory.u);
  EXPECT_EQ(beside.trajectory.objective, alone.trajectory.objective);
  EXPECT_EQ(beside.iterations, alone.iterations);
  EXPECT_EQ(beside.rollouts, alone.rollouts);
  EXPECT_EQ(beside.stationarity, alone.stationarity);
  ASSERT_EQ(beside.trajectory.points.size(), alone.trajectory.points.size());
  for (std::size_t k = 0; k < alone.trajectory.points.size(); ++k) {
    EXPECT_EQ(beside.trajectory.points[k].q, alone.trajectory.points[k].q);
    EXPECT_EQ(beside.trajectory.points[k].v, alone.trajectory.points[k].v);
  }
}

TEST(Exploration, InterpolatesItsKnots) {
  const Matrix knots{{0, 2, 6}};
  EXPECT_EQ(interpolate_knots(knots, 3), knots);
  EXPECT_LE((interpolate_knots(knots, 5) - Matrix{{0, 1, 2, 4, 6}}).cwiseAbs().maxCoeff(), 1e-15);
  const auto problem = make_control_problem("two_carts");
  const ButcherTableau tableau = tableau_argument(problem->tableau);
  for (const int wrong : {-1, 1, 11}) EXPECT_THROW(explore(*problem, tableau, 2, {.knots = wrong}), InputError);
  EXPECT_THROW(explore(*problem, tableau, 2, {.starts = 0}), InputError);
  const ExplorationResult found = explore(*problem, tableau, 2, {.rounds = 2, .samples = 20, .knots = 4, .starts = 3});
  ASSERT_EQ(found.starts.size(), 3U);
  EXPECT_EQ(found.starts[0], found.u);
  EXPECT_EQ(found.failed, 0) << "motions take as many elements as they need";
}

}  // namespace
}  // namespace ricochet
