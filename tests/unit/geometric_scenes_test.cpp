// Scene files that state a geometry, and what is exactly known of their motions.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "methods/registry.h"
#include "problems/geometry_kinematics.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Solution solved(const Problem& problem, const std::string& method = "fesd:radau-iia:3,elements=as_needed") {
  Settings settings;
  const auto made = make_method(method);
  if (made->info().is_adaptive)
    settings.tolerance = 1e-9;
  else
    settings.steps = 200;
  return made->solve(problem, settings);
}

std::unique_ptr<Problem> scene_of(const std::string& name, const ParameterChanges& changes = {}) {
  return read_scene_file(test_data(name + ".json"), changes);
}

constexpr const char* kPendulum = R"json({
  "params": {"l": "0.4", "m": "0.5", "M": "1", "g": "9.81", "w": "0.1", "r": "0.02", "e": "0.6"},
  "q0": ["-0.6"], "v0": ["0"], "T": "1.2", "M": [["2/3*m*l**2+M*l**2"]], "f": ["-(m+M)*g*l*cos(q[0])"],
  "contacts": [{"name": "stop", "gap": "l*cos(q[0])-r+w", "e": "e"}]
})json";

// Equal cranks stay parallel and the coupler does not turn: one angle, J = 2/3 m l^2 + M l^2.
TEST(GeometricScenes, FourBarsAreAPendulum) {
  const Solution bars = solved(*scene_of("four_bar"));
  const auto pendulum = read_scene_text(kPendulum, "pendulum");
  const Solution angle = solved(*pendulum);
  ASSERT_TRUE(bars.succeeded() && angle.succeeded()) << bars.message << angle.message;
  ASSERT_EQ(bars.events.size(), 2u);
  ASSERT_EQ(angle.events.size(), 2u);
  // Both have errors of order 5, on each its own: 8e-12 was measured, in the velocity.
  for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(bars.events[i].t, angle.events[i].t, 1e-10);
  for (const int crank : {2, 8}) {
    EXPECT_NEAR(bars.q[crank], angle.q[0], 1e-10);
    EXPECT_NEAR(bars.v[crank], angle.v[0], 1e-10);
  }
  EXPECT_NEAR(bars.q[5], 0, 1e-12) << "rounding of the constraints";
}

TEST(GeometricScenes, AFreeBoxKeepsItsMomenta) {
  const auto box = scene_of("../../bench/experiments/scenes/free_box");
  const Body& body = box->info().geometry->bodies[0];
  const auto angular_momentum = [&](const Vector& q, const Vector& v) {
    const auto motion = motion_of<double>(*box->info().geometry, 0, {q.begin(), q.end()});
    Vector3<double> omega{};
    for (std::size_t k = 0; k < 6; ++k) omega = sum(omega, scaled(v[static_cast<int>(k)], motion.J_omega[k]));
    Vector3<double> along = times_transposed(motion.R, omega);
    for (std::size_t axis = 0; axis < 3; ++axis) along[axis] *= body.inertia[axis];
    const Vector3<double> L = times(motion.R, along);
    return Eigen::Vector3d(L[0], L[1], L[2]);
  };
  const ProblemInfo& info = box->info();
  const Solution s = solved(*box);
  ASSERT_TRUE(s.succeeded()) << s.message;
  const double T = info.end_time;
  const Eigen::Vector3d centre(-0.9 * T, 0.4 * T, 0.1 * T - 9.8 * T * T / 2);
  EXPECT_LE((s.q.head(3) - centre).norm(), 1e-12) << "a parabola is exact, up to rounding";
  const Eigen::Vector3d start = angular_momentum(info.q0, info.v0);
  // Order 5 with 200 steps: 2e-12 was measured of the momentum, 9e-13 of the energy.
  EXPECT_LE((angular_momentum(s.q, s.v) - start).norm(), 1e-10 * start.norm());
  EXPECT_NEAR(*box->energy(s.q, s.v), *box->energy(info.q0, info.v0), 1e-10 * box->kinetic_energy(info.q0, info.v0));
  // About its middle axis it turns over: the axis that stood along the angular momentum has left it.
  const auto R = motion_of<double>(*info.geometry, 0, {s.q.begin(), s.q.end()}).R;
  EXPECT_LT(R[2][2], 0.95);
}

// Moments about the feet, forces at the tips along the line of both: the friction that each foot needs.
TEST(GeometricScenes, CardsStandUpToTheirFriction) {
  const double l = 0.1, r = 0.002, alpha = 0.3;
  const double least = l * std::sin(alpha) / (2 * (l * std::cos(alpha) + r));
  const auto stands = scene_of("card_house", {{"mu", 1.001 * least}}),
             falls = scene_of("card_house", {{"mu", 0.999 * least}});
  for (const char* method : {"fesd:radau-iia:3,elements=as_needed", "moreau_jean", "event_driven"}) {
    const Solution up = solved(*stands, method), down = solved(*falls, method);
    ASSERT_TRUE(up.succeeded() && down.succeeded()) << method << ": " << up.message << down.message;
    // An unstable equilibrium: rounding, and the tolerance of event_driven, grow by exp(5).
    EXPECT_LE((up.q - stands->info().q0).norm(), 1e-8) << method;
    // Feet that slip with a thousandth of the friction too little accelerate with about g mu / 1000.
    EXPECT_LT(down.q[0], falls->info().q0[0] - 1e-6) << method;
  }
}

// Up to the hit the first domino turns about its right foot, which takes the energy's integral; in the hit its foot is
// free, and the second domino turns about its own.
TEST(GeometricScenes, ADominoHitsTheNext) {
  const double b = 0.0125, h = 0.025, d = 0.02, m = 0.01, g = 9.81, omega0 = 15;
  const double J = m * (b * b + h * h) / 3, J_foot = 4 * J, psi = std::asin(d / (2 * h));
  const auto omega = [&](double angle) {
    const double height = h * std::cos(angle) + b * std::sin(angle);
    return std::sqrt(omega0 * omega0 - 2 * m * g * (height - h) / J_foot);
  };
  double t_hit = 0;
  const int n = 200;  // Simpson's rule, whose error is below 1e-13 s
  for (int k = 0; k <= n; ++k) {
    const double weight = k == 0 || k == n ? 1 : k % 2 == 1 ? 4 : 2;
    t_hit += weight * psi / (3 * n) / omega(psi * k / n);
  }
  const double lever = 2 * h * std::cos(psi), arm = h * std::cos(psi) - b * std::sin(psi);
  const double impulse = omega(psi) * lever / (1 / m + arm * arm / J + lever * lever / J_foot);

  const auto row = scene_of("domino_row", {{"duration", 0.1}});  // before the second hit
  const Solution s = solved(*row, "event_driven");
  ASSERT_TRUE(s.succeeded()) << s.message;
  const auto hit = std::ranges::find(s.events, EventKind::impact, &Event::kind);
  ASSERT_NE(hit, s.events.end());
  EXPECT_EQ(row->info().contacts[static_cast<std::size_t>(hit->contact)].name, "dominoes 1 and 2");
  EXPECT_NEAR(hit->t, t_hit, 1e-9);  // the tolerance of the method
  EXPECT_NEAR(hit->Lambda_n[hit->contact], impulse, 1e-8 * impulse);
  EXPECT_NEAR(hit->v_plus[5], -impulse * lever / J_foot, 1e-7);
}

TEST(GeometricScenes, FarFromTheOriginItIsTheSameMotion) {
  const auto far = scene_of("far_away"), near = scene_of("far_away", {{"shift", 0}});
  for (const char* method : {"fesd:radau-iia:3,elements=as_needed", "moreau_jean", "event_driven"}) {
    const Solution a = solved(*far, method), b = solved(*near, method);
    ASSERT_TRUE(a.succeeded() && b.succeeded()) << method << ": " << a.message << b.message;
    ASSERT_EQ(a.events.size(), b.events.size()) << method;
    // Some hundred elements, each of which rounds the place to 2e-12 m: 8e-11 was measured.
    for (const int k : {0, 1}) EXPECT_NEAR(a.q[k] - 1e4, b.q[k], 1e-9) << method;
    EXPECT_LE((a.v - b.v).cwiseAbs().maxCoeff(), 1e-9) << method;
  }
}

// The friction at which the springers part, and how they go: with a = x'' of the right one and N on each face,
// M (g - a tan(beta)) = 2 N cos(beta) and m a = N sin(beta) - mu (m g + N cos(beta)).
TEST(GeometricScenes, AnArchStandsUpToItsFriction) {
  const double M = 3, m = 5, g = 9.81, tangent = std::tan(0.5), T = 0.5;
  const double least = M * tangent / (2 * m + M);
  const auto stands = scene_of("three_stone_arch", {{"mu", 1.001 * least}});
  const double mu = 0.7 * least, a = g * (M * (tangent - mu) / 2 - mu * m) / (m + M * tangent * (tangent - mu) / 2);
  const auto falls = scene_of("three_stone_arch", {{"mu", mu}});
  for (const char* method : {"fesd:radau-iia:3,elements=as_needed", "moreau_jean", "event_driven"}) {
    const Solution up = solved(*stands, method), down = solved(*falls, method);
    ASSERT_TRUE(up.succeeded() && down.succeeded()) << method << ": " << up.message << down.message;
    EXPECT_LE(up.q.norm(), 1e-10) << method << ": rounding";
    // Constant forces: exact but for a half step of the place by time stepping.
    const double half_step = method == std::string("moreau_jean") ? a * T * T / 400 : 1e-9;
    EXPECT_NEAR(down.v[4], a * T, 1e-9) << method;
    EXPECT_NEAR(down.q[4], a * T * T / 2, 1.01 * half_step) << method;
    EXPECT_NEAR(down.q[3], -tangent * down.q[4], 1e-9) << method << ": the key sinks between them";
    EXPECT_NEAR(down.q[0], -down.q[4], 1e-9) << method;
  }
}

// With the balls shrunk to points each velocity goes on through the others: where it is then, sorted, the balls are.
TEST(GeometricScenes, ElasticBallsExchangeTheirVelocities) {
  const auto row = scene_of("elastic_row");
  const ProblemInfo& info = row->info();
  const int n = info.n_q;
  const double r = 0.02, L = 1;
  std::vector<std::pair<double, double>> points;  // place and velocity
  for (int k = 0; k < n; ++k) {
    const double unfolded = info.q0[k] - r * (2 * k + 1) + info.v0[k] * info.end_time;
    const double turns = std::floor(unfolded / L), rest = unfolded - turns * L;
    const bool is_back = std::fmod(std::abs(turns), 2) == 1;
    points.emplace_back(is_back ? L - rest : rest, is_back ? -info.v0[k] : info.v0[k]);
  }
  std::ranges::sort(points);
  for (const char* method : {"fesd:radau-iia:3,elements=as_needed", "event_driven"}) {
    const Solution s = solved(*row, method);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_GT(s.counters.events, 100) << method;
    for (int k = 0; k < n; ++k) {
      // A straight flight is exact; each of a hundred impacts rounds.
      EXPECT_NEAR(s.q[k] - r * (2 * k + 1), points[static_cast<std::size_t>(k)].first, 1e-10) << method;
      EXPECT_NEAR(s.v[k], points[static_cast<std::size_t>(k)].second, 1e-10) << method;
    }
  }
}

TEST(GeometricScenes, ASpringInARingKeepsAngularMomentumAndEnergy) {
  const auto ring = scene_of("spring_in_ring");
  const ProblemInfo& info = ring->info();
  const auto angular = [](const Vector& q, const Vector& v) { return q[0] * v[1] - q[1] * v[0]; };
  const double L = angular(info.q0, info.v0), E = *ring->energy(info.q0, info.v0);
  // Their own errors: 200 steps of order 5, and the tolerance of event_driven over the motion.
  for (const auto& [method, tolerance] : {std::pair{"fesd:radau-iia:3,elements=as_needed", 1e-6},
                                          {"fesd:gauss:3,elements=as_needed", 1e-6},
                                          {"event_driven", 1e-7}}) {
    const Solution s = solved(*ring, method);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_GT(s.counters.events, 3) << method;
    EXPECT_NEAR(angular(s.q, s.v), L, tolerance * L) << method;
    EXPECT_NEAR(*ring->energy(s.q, s.v), E, tolerance * E) << method;
  }
}

// m x'' = F cos(..) - m omega^2 x, with one impact of speed v in each period: ten of them later it is where it was.
TEST(GeometricScenes, AnImpactOscillatorHitsItsStopOnceInAPeriod) {
  const auto oscillator = scene_of("impact_oscillator");
  const ProblemInfo& info = oscillator->info();
  const double m = 1, e = 0.8, v = 1, period = 2 * std::numbers::pi / 4.2;
  for (const auto& [method, tolerance] :
       {std::pair{"fesd:radau-iia:3,elements=as_needed", 1e-6},  // 200 steps of order 5
        {"fesd:gauss:3,elements=as_needed", 1e-6},
        {"event_driven", 1e-7},   // its tolerance, over ten periods
        {"moreau_jean", 0.2}}) {  // order 1: three steps of 75 ms at the speed of an impact
    const Solution s = solved(*oscillator, method);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_NEAR(s.q[0], info.q0[0], tolerance) << method;
    EXPECT_NEAR(s.v[0], info.v0[0], 4.2 * tolerance) << method;
    if (method == std::string("moreau_jean")) continue;
    ASSERT_EQ(s.events.size(), 10u) << method;
    for (std::size_t k = 0; k < s.events.size(); ++k) {
      const Event& impact = s.events[k];
      EXPECT_NEAR(impact.t, (static_cast<double>(k) + 0.5) * period, tolerance) << method;
      EXPECT_NEAR(impact.Lambda_n[0], (1 + e) * m * v, 4.2 * tolerance) << method;
    }
  }
}

/// Motion of equal masses m on a line, x'' = -K x / m, by its modes.
struct Modes {
  Modes(const Matrix& K, double m) : solver(K / m) {}
  /// Place and velocity at t after x, v.
  std::pair<Vector, Vector> at(double t, const Vector& x, const Vector& v) const {
    const Matrix& V = solver.eigenvectors();
    Vector a = V.transpose() * x, b = V.transpose() * v;
    for (Eigen::Index k = 0; k < a.size(); ++k) {
      const double omega = std::sqrt(std::max(0.0, solver.eigenvalues()[k]));
      const bool is_rigid = omega < 1e-6 * std::sqrt(solver.eigenvalues().maxCoeff());  // zero, up to its rounding
      const double C = std::cos(omega * t), S = std::sin(omega * t), x_k = a[k];
      a[k] = is_rigid ? x_k + b[k] * t : x_k * C + b[k] * S / omega;
      b[k] = is_rigid ? b[k] : -omega * x_k * S + b[k] * C;
    }
    return {V * a, V * b};
  }
  Eigen::SelfAdjointEigenSolver<Matrix> solver;
};

// It flies, loses the energy of the first mass, swings with that held until the wall would have to pull, and flies.
TEST(GeometricScenes, ABarAtAWallIsSolvedByItsModes) {
  const auto bar = scene_of("bar_on_wall");
  const ProblemInfo& info = bar->info();
  const int n = info.n_q;
  const double m = 0.125, k = 6.125, speed = 1, reaches = 0.1 / speed;
  Matrix K = Matrix::Zero(n, n);
  for (int i = 0; i + 1 < n; ++i) K.block(i, i, 2, 2) += k * (Matrix(2, 2) << 1, -1, -1, 1).finished();
  const Modes held(K.bottomRightCorner(n - 1, n - 1), m), flying(K, m);
  const Vector at_impact = Vector::Zero(n - 1), v_impact = Vector::Constant(n - 1, -speed);
  const auto push = [&](double t) { return -k * held.at(t, at_impact, v_impact).first[0]; };  // of the wall [N]
  double pushes = 2, pulls = 2.5;  // a wave goes through it and back in 2 s
  ASSERT_TRUE(push(pushes) > 0 && push(pulls) < 0);
  while (pulls - pushes > 1e-14) (push((pushes + pulls) / 2) > 0 ? pushes : pulls) = (pushes + pulls) / 2;
  const auto [x, v] = held.at(pushes, at_impact, v_impact);
  const auto with_first = [](const Vector& rest) {
    Vector all = Vector::Zero(rest.size() + 1);
    all.tail(rest.size()) = rest;
    return all;
  };
  const auto [x_end, v_end] = flying.at(info.end_time - reaches - pushes, with_first(x), with_first(v));
  const double energy = *bar->energy(info.q0, info.v0);
  // After the impact the push of the wall grows from zero: its sign there is rounding, and must not decide.
  for (const auto& [method, tolerance] : {std::pair{"fesd:radau-iia:3,elements=as_needed", 1e-7},  // order 5
                                          {"fesd:gauss:3,elements=as_needed", 1e-7},
                                          {"fesd_adaptive:radau-iia:4", 1e-7},  // a hundred of its tolerances
                                          {"event_driven", 1e-7},
                                          {"moreau_jean", 0.03}}) {  // order 1: two steps of 15 ms at the speed
    const Solution s = solved(*bar, method);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    for (int i = 0; i < n; ++i) {
      EXPECT_NEAR(s.q[i] - i / 7.0, x_end[i], tolerance) << method;
      EXPECT_NEAR(s.v[i], v_end[i], 10 * tolerance) << method << ": the waves turn by up to 14 rad/s";
    }
    if (method == std::string("moreau_jean")) continue;
    ASSERT_EQ(s.events.size(), 2u) << method << ": it comes and goes";
    EXPECT_NEAR(s.events[0].t, reaches, 1e-9) << method << ": a straight flight";
    EXPECT_NEAR(s.events[0].Lambda_n[0], m * speed, 1e-9) << method;
    EXPECT_NEAR(s.events[1].t, reaches + pushes, tolerance) << method;
    EXPECT_NEAR(*bar->energy(s.q, s.v), 7 * energy / 8, tolerance * energy) << method;
  }
}

}  // namespace
}  // namespace ricochet
