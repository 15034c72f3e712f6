// What is known of each scene: its contact kinematics, its energy, and facts of its motion. And every scene as a file.
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>

#include "methods/registry.h"
#include "problems/derivatives/symbolic_problem.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_writer.h"
#include "tests/solve_with_samples.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

/// A state near the initial one.
std::pair<Vector, Vector> state_near_start(const Problem& problem, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> shift(-0.3, 0.3);
  Vector q = problem.info().q0, v = problem.info().v0;
  for (double& x : q) x += shift(random);
  for (double& x : v) x += shift(random);
  return {q, v};
}

/// Files and compiled scenes after 200 steps. Largest measured 7e-14 (woodpecker_toy): rounding, grown by the impacts.
constexpr double kRun = 1e-12;
/// Friction in space is solved to 1e-9; by how much more is rounding's to say.
constexpr double kRunInSpace = 1e-9;

double relative(const Vector& a, const Vector& b) {
  return (a - b).cwiseAbs().maxCoeff() / (1 + b.cwiseAbs().maxCoeff());
}

class EveryScene : public testing::TestWithParam<std::string> {
 protected:
  std::unique_ptr<Problem> problem = make_problem(GetParam());

  /// Methods of these tests have no other.
  void take_newtons_law() { problem->set_impact_law({}); }
};

/// Scenes that compute with their formulas; those of assembled ones have tests of their own.
class EverySymbolicScene : public EveryScene {};

TEST_P(EverySymbolicScene, IsTheSameAsItsFile) {
  const std::string text = scene_text(*problem);
  EXPECT_EQ(text, scene_text(*make_problem(GetParam()))) << "the order of terms depends on memory addresses";
  const auto file = read_scene_text(text, GetParam());
  EXPECT_EQ(nlohmann::json::parse(text), nlohmann::json::parse(scene_text(*file)));

  const ProblemInfo &a = problem->info(), &b = file->info();
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.hard_feature, b.hard_feature);
  ASSERT_EQ(a.parameters.size(), b.parameters.size());
  for (const auto& parameter : a.parameters) {
    const auto same = std::count_if(b.parameters.begin(), b.parameters.end(), [&](const ParameterInfo& other) {
      return other.name == parameter.name && other.value == parameter.value && other.unit == parameter.unit;
    });
    EXPECT_EQ(same, 1) << parameter.name;
  }
  EXPECT_EQ(a.q0, b.q0);
  EXPECT_EQ(a.v0, b.v0);
  EXPECT_EQ(a.u, b.u);
  EXPECT_EQ(a.end_time, b.end_time);
  EXPECT_EQ(a.structure.constant_mass, b.structure.constant_mass);
  EXPECT_EQ(a.structure.constant_force_jacobian, b.structure.constant_force_jacobian);
  EXPECT_EQ(a.structure.has_potential, b.structure.has_potential);
  ASSERT_EQ(a.n_c(), b.n_c());
  for (int i = 0; i < a.n_c(); ++i) {
    EXPECT_EQ(a.contacts[i].name, b.contacts[i].name);
    EXPECT_EQ(a.contacts[i].eps_r, b.contacts[i].eps_r);
    EXPECT_EQ(a.contacts[i].mu, b.contacts[i].mu);
    EXPECT_EQ(a.contacts[i].n_t, b.contacts[i].n_t);
    EXPECT_EQ(a.contacts[i].is_bilateral, b.contacts[i].is_bilateral);
    EXPECT_EQ(a.contacts[i].support, b.contacts[i].support);
  }
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto [q, v] = state_near_start(*problem, seed);
    // Both evaluate the same formulas.
    EXPECT_EQ(problem->mass_matrix(q), file->mass_matrix(q));
    EXPECT_EQ(problem->normal_jacobian(q), file->normal_jacobian(q));
    EXPECT_EQ(problem->tangent_jacobian(q), file->tangent_jacobian(q));
    EXPECT_EQ(problem->potential_energy(q.data()), file->potential_energy(q.data()));
    // Compiled code against formulas in another order: some twenty roundings of 1.1e-16 in the longest one, box_3d.
    EXPECT_LE(relative(problem->force(q, v), file->force(q, v)), 2e-15);
    EXPECT_LE(relative(problem->gap(q), file->gap(q)), 2e-15);
  }

  const Solution s = solve_with_samples(*problem, "moreau_jean", 200),
                 t = solve_with_samples(*file, "moreau_jean", 200);
  ASSERT_TRUE(s.succeeded() && t.succeeded()) << s.message << t.message;
  const bool in_space = std::ranges::any_of(a.contacts, [](const auto& contact) { return contact.n_t == 2; });
  EXPECT_LE(relative(s.q, t.q), in_space ? kRunInSpace : kRun);
  EXPECT_LE(relative(s.v, t.v), in_space ? kRunInSpace : kRun);
}

/// The order of operations follows the formulas, not the memory addresses of their symbols.
TEST_P(EverySymbolicScene, HasTheSameBitsWhereverItsSymbolsLie) {
  const auto [q, v] = state_near_start(*problem, 1);
  const int n_q = problem->n_q();
  const auto values = [&, &q = q, &v = v](const Problem& p) {
    Matrix f_q(n_q, n_q), f_v(n_q, n_q), Ma_q(n_q, n_q), all(n_q, 5 + 4 * n_q + p.n_c() + p.info().n_lambda_t);
    p.force_jacobians(q.data(), v.data(), p.info().u.data(), f_q.data(), f_v.data());
    p.mass_derivative(q.data(), v.data(), Ma_q.data());
    Vector f(n_q);
    p.symbolic()->SymbolicProblem::force(q.data(), v.data(), p.info().u.data(), f.data());
    all.setConstant(p.potential_energy(q.data()));
    all.leftCols(1 + 4 * n_q + p.n_c() + p.info().n_lambda_t) << f, f_q, f_v, Ma_q, p.mass_matrix(q),
        p.normal_jacobian(q), p.tangent_jacobian(q);
    return all;
  };
  const Matrix expected = values(*problem);
  std::vector<std::unique_ptr<GiNaC::symbol>> scattered;
  for (int repetition = 0; repetition < 10; ++repetition) {
    for (int k = 0; k < 7 * repetition; ++k) scattered.push_back(std::make_unique<GiNaC::symbol>());
    for (std::size_t k = static_cast<std::size_t>(repetition); k < scattered.size(); k += 3) scattered[k].reset();
    ASSERT_EQ(values(*make_problem(GetParam())), expected);
  }
}

TEST_P(EveryScene, HasAPositiveDefiniteMassAlongItsMotion) {
  take_newtons_law();
  const Solution s = solve_with_samples(*problem, "moreau_jean", 200);
  ASSERT_FALSE(s.samples.empty()) << s.message;
  for (const auto& sample : s.samples) {
    const Matrix M = problem->mass_matrix(sample.q);
    ASSERT_LE((M - M.transpose()).cwiseAbs().maxCoeff(), 1e-15 * M.cwiseAbs().maxCoeff()) << "t = " << sample.t;
    const Eigen::LDLT<Matrix> ldlt(M);
    ASSERT_TRUE(ldlt.isPositive() && ldlt.vectorD().minCoeff() > 0) << "t = " << sample.t;
  }
}

/// Without contacts every scene with a potential conserves its energy: M, f and the potential belong together.
class EveryConservativeScene : public EveryScene {};

TEST_P(EveryConservativeScene, ConservesEnergyWithoutContacts) {
  take_newtons_law();
  const auto before = problem->energy(problem->info().q0, problem->info().v0);
  // Bilateral constraints need a stage at the right end.
  const char* tableau = problem->info().has_bilateral() ? "radau-iia:5" : "gauss:4";
  const Solution s = solve_with_samples(*problem, std::string("irk:") + tableau + ",contacts=ignored", 1000);
  ASSERT_TRUE(s.succeeded()) << s.message;
  ASSERT_EQ(s.samples.size(), 1000u);
  double kinetic = 0, worst = 0;
  for (const auto& sample : s.samples) {
    kinetic = std::max(kinetic, 0.5 * sample.v_plus.dot(problem->mass_matrix(sample.q) * sample.v_plus));
    worst = std::max(worst, std::abs(*problem->energy(sample.q, sample.v_plus) - *before));
  }
  // Order 8 or 9 with a thousand steps: below the tolerance 1e-13 of the stage equations, times the steps.
  EXPECT_LE(worst, 1e-10 * kinetic);
}

std::vector<std::string> scene_ids(const std::function<bool(const Problem&)>& is_chosen) {
  std::vector<std::string> ids;
  for (const auto& scene : scenes()) {
    if (is_chosen(*scene.make({}))) ids.push_back(scene.id);
  }
  return ids;
}
bool any(const Problem&) {
  return true;
}
bool has_potential(const Problem& problem) {
  return problem.info().structure.has_potential;
}
bool is_symbolic(const Problem& problem) {
  return problem.symbolic() != nullptr;
}
const auto scene_name = [](const auto& test) { return test_name(test.param); };
INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene, testing::ValuesIn(scene_ids(any)), scene_name);
INSTANTIATE_TEST_SUITE_P(Scenes, EverySymbolicScene, testing::ValuesIn(scene_ids(is_symbolic)), scene_name);
INSTANTIATE_TEST_SUITE_P(Scenes, EveryConservativeScene, testing::ValuesIn(scene_ids(has_potential)), scene_name);

TEST(SceneWriter, KeepsParametersOpen) {
  const auto p = make_problem("rocking_block", {{"mu", 0.4}});
  const auto file = read_scene_text(scene_text(*p), "rocking block", {{"phi0", 0.05}});
  EXPECT_EQ(file->info().contacts[0].mu, 0.4);
  EXPECT_EQ(file->info().q0, make_problem("rocking_block", {{"mu", 0.4}, {"phi0", 0.05}})->info().q0);
}

TEST(SceneWriter, WritesANewFile) {
  const auto path = std::filesystem::temp_directory_path() / ("ricochet_export_" + std::to_string(getpid()) + ".json");
  const auto p = make_problem("ball_row");
  write_scene_file(*p, path.string());
  EXPECT_EQ(read_scene_file(path.string())->info().q0, p->info().q0);
  EXPECT_THROW(write_scene_file(*p, path.string()), InputError) << "an existing file is not replaced";
  std::filesystem::remove(path);
  EXPECT_THROW(write_scene_file(*p, "/nonexistent/scene.json"), InputError);
}

TEST(DoublePendulumWall, IsTheSceneFileWrittenByHand) {
  const auto compiled = make_problem("double_pendulum_wall");
  const auto file = read_scene_file(test_data("double_pendulum_wall.json"));
  const Solution s = solve_with_samples(*compiled, "fesd:gauss:3", 150),
                 t = solve_with_samples(*file, "fesd:gauss:3", 150);
  ASSERT_TRUE(s.succeeded() && t.succeeded());
  // Rounding grows with the motion, by less than 1e4 here.
  EXPECT_LE(relative(s.q, t.q), 1e-12);
  EXPECT_LE(relative(s.v, t.v), 1e-12);
}

// Contact kinematics: J_n and J_t are the derivatives of the contact point's position, stated here a second time.

/// Position of the material contact point of contact i in the directions (tangents, normal).
using ContactPoint = std::function<Vector(const Vector& q, int i)>;

/// Central differences with h = 1e-5: h^2 and rounding / h are both 1e-10.
void expect_material_contacts(const Problem& problem, const ContactPoint& point) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Vector q = state_near_start(problem, seed).first;
    const Matrix J_n = problem.normal_jacobian(q), J_t = problem.tangent_jacobian(q);
    for (int i = 0; i < problem.n_c(); ++i) {
      const auto& contact = problem.info().contacts[i];
      for (int k = 0; k < problem.n_q(); ++k) {
        Vector forward = q, backward = q;
        forward[k] += 1e-5;
        backward[k] -= 1e-5;
        const Vector slope = (point(forward, i) - point(backward, i)) / 2e-5;
        for (int d = 0; d < contact.n_t; ++d) EXPECT_NEAR(J_t(k, contact.tangent_index + d), slope[d], 1e-9);
        EXPECT_NEAR(J_n(k, i), slope[contact.n_t], 1e-9) << contact.name << ", coordinate " << k;
      }
    }
  }
}

TEST(ContactKinematics, FallingRod) {
  expect_material_contacts(*make_problem("falling_rod"), [](const Vector& q, int) -> Vector {
    const Eigen::Vector2d along(std::cos(q[2]), -std::sin(q[2]));
    return q.head(2) + 0.5 * along;
  });
}

TEST(ContactKinematics, RockingBlock) {
  expect_material_contacts(*make_problem("rocking_block"), [](const Vector& q, int i) -> Vector {
    return q.head(2) + Eigen::Rotation2Dd(q[2]) * Eigen::Vector2d(i == 0 ? -0.1 : 0.1, -0.4);
  });
}

TEST(ContactKinematics, SliderCrank) {
  expect_material_contacts(*make_problem("slider_crank_clearance"), [](const Vector& q, int i) -> Vector {
    const Eigen::Vector2d corner(i % 2 == 0 ? -0.05 : 0.05, i < 2 ? 0.025 : -0.025);
    Eigen::Vector2d p = Eigen::Rotation2Dd(q[0]) * Eigen::Vector2d(0.153, 0) +
                        Eigen::Rotation2Dd(q[1]) * Eigen::Vector2d(0.306, 0) + Eigen::Rotation2Dd(q[2]) * corner;
    if (i < 2) p.y() = -p.y();  // the gap to the upper guide
    return p;
  });
}

TEST(ContactKinematics, Box3d) {
  using Eigen::Vector3d;
  expect_material_contacts(*make_problem("box_3d"), [](const Vector& q, int i) -> Vector {
    const Vector3d corner(i & 1 ? 0.15 : -0.15, i & 2 ? 0.1 : -0.1, i & 4 ? 0.05 : -0.05);
    const auto turn = [&](int k, const Vector3d& axis) { return Eigen::AngleAxisd(q[k], axis); };
    return q.head(3) + turn(3, Vector3d::UnitX()) * turn(4, Vector3d::UnitY()) * turn(5, Vector3d::UnitZ()) * corner;
  });
}

/// A disc or ball in rolling contact: v_t is the velocity of the material point at -R n, v + omega x (-R n).
TEST(ContactKinematics, RoundBodies) {
  using Eigen::Vector3d;
  const double R = 0.1;
  const auto planar_slip = [&](const Vector& v, double n_x, double n_y) {
    const Vector3d n(n_x, n_y, 0), t(n_y, -n_x, 0);
    return t.dot(Vector3d(v[0], v[1], 0) + Vector3d(0, 0, v[2]).cross(-R * n));
  };
  const auto box = make_problem("ball_in_box"), chute = make_problem("disc_in_chute"), ball = make_problem("ball_3d");
  for (unsigned seed = 1; seed <= 3; ++seed) {
    for (const auto* problem : {&box, &chute}) {
      const auto [q, v] = state_near_start(**problem, seed);
      const Matrix J_n = (*problem)->normal_jacobian(q);
      const Vector v_t = (*problem)->tangent_jacobian(q).transpose() * v;
      for (int i = 0; i < (*problem)->n_c(); ++i) {
        EXPECT_NEAR(J_n.col(i).norm(), 1, 1e-15);
        EXPECT_NEAR(std::abs(v_t[i]), std::abs(planar_slip(v, J_n(0, i), J_n(1, i))), 1e-14);
      }
    }
    const auto [q, v] = state_near_start(*ball, seed);
    const Vector3d velocity = v.head(3), omega = v.tail(3), slip = velocity + omega.cross(Vector3d(0, 0, -R));
    const Vector v_t = ball->tangent_jacobian(q).transpose() * v;
    EXPECT_NEAR(v_t[0], slip.x(), 1e-15);
    EXPECT_NEAR(v_t[1], slip.y(), 1e-15);
  }
}

// Facts of the motions.

/// The kinetic energy of a scene is that of its bodies: m |v|^2 / 2 of their centres and J omega^2 / 2. The balance of
/// energy says nothing about the entries of M that do not vary.
void expect_kinetic_energy(const std::string& id, const std::function<double(const Vector&, const Vector&)>& energy) {
  const auto problem = make_problem(id);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto [q, v] = state_near_start(*problem, seed);
    const double expected = energy(q, v);
    EXPECT_NEAR(problem->kinetic_energy(q, v), expected, 1e-14 * expected) << id << ": rounding of a dozen terms";
  }
}
/// Velocity of the free end of a rod that turns at the rate omega, its angle counted from the x axis.
Eigen::Vector2d end_velocity(double length, double angle, double omega) {
  return length * omega * Eigen::Vector2d(-std::sin(angle), std::cos(angle));
}

TEST(KineticEnergy, IsThatOfTheBodies) {
  expect_kinetic_energy("slider_crank_clearance", [](const Vector& q, const Vector& v) {
    const Eigen::Vector2d pin = end_velocity(0.153, q[0], v[0]), slider = pin + end_velocity(0.306, q[1], v[1]);
    const double of_centres =
        0.038 * (pin / 2).squaredNorm() + 0.038 * ((pin + slider) / 2).squaredNorm() + 0.076 * slider.squaredNorm();
    return (of_centres + 7.4e-5 * v[0] * v[0] + 5.9e-4 * v[1] * v[1] + 2.7e-6 * v[2] * v[2]) / 2;
  });
  expect_kinetic_energy("kane_pendulum", [](const Vector& q, const Vector& v) {
    const Eigen::Vector2d joint = end_velocity(1, q[0], v[0]), tip = joint + end_velocity(1, q[1], v[1]);
    return ((joint / 2).squaredNorm() + ((joint + tip) / 2).squaredNorm() + v.squaredNorm() / 12) / 2;
  });
  expect_kinetic_energy("woodpecker_toy", [](const Vector&, const Vector& v) {
    const double bird = v[0] + 1e-2 * v[1] + 1.5e-2 * v[2];
    return (3e-4 * v[0] * v[0] + 5e-9 * v[1] * v[1] + 4.5e-3 * bird * bird + 7e-7 * v[2] * v[2]) / 2;
  });
  expect_kinetic_energy("rocking_block", [](const Vector&, const Vector& v) {
    return (v.head(2).squaredNorm() + (0.2 * 0.2 + 0.8 * 0.8) / 12 * v[2] * v[2]) / 2;  // sides of 0.2 m and 0.8 m
  });
  expect_kinetic_energy("disc_in_chute", [](const Vector&, const Vector& v) {
    return (v.head(2).squaredNorm() + 0.1 * 0.1 / 2 * v[2] * v[2]) / 2;
  });
}

TEST(FallingRod, PainleveRegion) {
  // p = J_n' M^-1 (J_n - mu J_t) for slip in the direction of J_t.
  const auto p = [](const Problem& rod, double theta) {
    const Vector q = Eigen::Vector3d(0, 0, theta);
    const Vector J_n = rod.normal_jacobian(q), J_t = rod.tangent_jacobian(q);
    return J_n.dot(rod.mass_matrix(q).inverse() * (J_n - rod.info().contacts[0].mu * J_t));
  };
  const auto regular = make_problem("falling_rod"), paradox = make_problem("falling_rod", {{"mu", 2}, {"theta0", 1.1}});
  for (double theta = 0; theta < 1.57; theta += 0.01) EXPECT_GT(p(*regular, theta), 0);
  EXPECT_LT(p(*paradox, paradox->info().q0[2]), 0);
  const auto critical = make_problem("falling_rod", {{"mu", 4.0 / 3}});
  EXPECT_NEAR(p(*critical, std::atan(2)), 0, 1e-14);
  EXPECT_GT(p(*critical, std::atan(2) + 0.1), 0);
  EXPECT_GT(p(*critical, std::atan(2) - 0.1), 0);
}

TEST(KanePendulum, GainsEnergyUnderNewtonsLaw) {
  const auto kept = [](double mu) {
    const auto problem = make_problem("kane_pendulum", {{"mu", mu}, {"g", 0}});
    const Solution s = solve_with_samples(*problem, "fesd:gauss:3", 20);
    return *problem->energy(s.q, s.v) / *problem->energy(problem->info().q0, problem->info().v0);
  };
  // Newton's and Coulomb's law solved by hand at the initial angles, which move by 1e-3 until the impact.
  EXPECT_NEAR(kept(0.5), 1.5876, 0.02);
  EXPECT_NEAR(kept(0.1), 0.7791, 0.02);
}

TEST(RockingBlock, LosesHousnersShareInAnImpact) {
  const auto spin_ratio = [](const Problem& block) {
    const Solution s = solve_with_samples(block, "moreau_jean", 20000);
    const auto landing = std::ranges::find(s.events, 1, &Event::contact);  // of the right corner
    if (landing == s.events.end()) {
      ADD_FAILURE() << "the right corner does not land";
      return HUGE_VAL;
    }
    return landing->v_plus[2] / landing->v_minus[2];
  };
  const double sine2 = 0.1 * 0.1 / (0.1 * 0.1 + 0.4 * 0.4);
  // From the impact to phi = -1e-4 the block slows down by g b phi / omega, and the step is 75 us.
  EXPECT_NEAR(spin_ratio(*make_problem("rocking_block")), 1 - 1.5 * sine2, 0.01);
  EXPECT_GT(spin_ratio(*make_problem("rocking_block", {{"b", 0.36}, {"h", 0.3}, {"mu", 2}})), 0.05)
      << "b/h = 1.2: 0.115";
  EXPECT_NEAR(spin_ratio(*make_problem("rocking_block", {{"b", 0.45}, {"h", 0.3}, {"mu", 2}})), 0, 1e-12)
      << "b/h = 1.5: stops";
}

TEST(BeltOscillator, SticksAtBeltSpeed) {
  // Without damping and load: slip x = x_c (1 - cos(omega t)), x_c = mu m g / k, until x' = v_belt; then stick until
  // the spring carries mu m g, at x = x_c.
  const double x_c = 0.4 * 9.81 / 100, omega = 10, v_belt = 0.2;
  const double t_stick = std::asin(v_belt / (x_c * omega)) / omega;
  const double x_stick = x_c * (1 - std::cos(omega * t_stick)), t_slip = t_stick + (x_c - x_stick) / v_belt;
  const auto p = make_problem("belt_oscillator", {{"c", 0}, {"F", 0}, {"duration", 0.5}});
  const Solution s = solve_with_samples(*p, "moreau_jean", 5000);
  ASSERT_EQ(s.samples.size(), 5000u) << s.message;
  for (const auto& sample : s.samples) {
    const double x = sample.q[0];
    if (sample.t > t_stick + 1e-3 && sample.t < t_slip - 1e-3) {
      EXPECT_NEAR(sample.v_plus[0], v_belt, 1e-13);
      EXPECT_NEAR(x, x_stick + v_belt * (sample.t - t_stick), 1e-4) << "order 1: h v_belt = 2e-5";
    } else if (sample.t < t_stick - 1e-3) {
      EXPECT_NEAR(x, x_c * (1 - std::cos(omega * sample.t)), 1e-4);
    }
  }
}

TEST(BeltOscillator, ChangesBetweenSlipAndStickAgainAndAgain) {
  const auto p = make_problem("belt_oscillator");
  int sticks = 0;
  bool sticking = false;
  for (const auto& sample : solve_with_samples(*p, "moreau_jean", 3000).samples) {
    const bool now = std::abs(sample.v_plus[0] - 0.2) < 1e-12;
    sticks += now && !sticking;
    sticking = now;
  }
  EXPECT_GE(sticks, 3) << "at least one each period of 0.9 s";
}

TEST(WoodpeckerToy, ReturnsToThePublishedPointOfItsCycle) {
  const auto p = make_problem("woodpecker_toy");
  const double section = p->info().q0[2];
  double previous = section, last = 0;
  std::vector<double> periods;
  for (const auto& sample : solve_with_samples(*p, "moreau_jean", 30000).samples) {
    if (previous > section && sample.q[2] <= section) {
      periods.push_back(sample.t - last);
      last = sample.t;
      // Measured 1 % in y', the fastest component: the published numbers have four digits, the cycle attracts slowly.
      EXPECT_NEAR(sample.v_plus[0], -0.3411, 0.004);
      EXPECT_NEAR(sample.v_plus[2], -7.4583, 0.03);
    }
    previous = sample.q[2];
  }
  ASSERT_EQ(periods.size(), 2u);
  EXPECT_NEAR(periods[0], periods[1], 1e-3);
}

TEST(SliderCrankClearance, StaysInItsGuide) {
  const auto p = make_problem("slider_crank_clearance", {{"duration", 0.05}});
  const Solution s = solve_with_samples(*p, "moreau_jean", 10000);
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_GT(s.q[0], 3) << "half a turn of the crank at least";
  ASSERT_EQ(s.samples.size(), 10000u);
  for (const auto& sample : s.samples) ASSERT_GE(p->gap(sample.q).minCoeff(), -2e-4) << "h v = 5 us * 23 m/s";
}

TEST(BallInBox, ADiscThatSticksKeepsTwoThirds) {
  const auto p = make_problem("ball_in_box",
                              {{"mu", 5}, {"omega0", 0}, {"v_x0", 0.6}, {"v_y0", 0}, {"y0", 0.2}, {"duration", 0.2}});
  const Solution s = solve_with_samples(*p, "moreau_jean", 400);
  EXPECT_NEAR(s.v[0], 0.6 * 2 / 3, 1e-14) << "angular momentum about the contact point, J = m R^2 / 2";
  EXPECT_NEAR(s.v[2], -0.4 / 0.1, 1e-13) << "it rolls";
}

TEST(BallRow, HandsTheVelocityOn) {
  const auto elastic = make_problem("ball_row", {{"e", 1}});
  EXPECT_LE((solve_with_samples(*elastic, "fesd:gauss:2", 200).v - Eigen::Vector4d(0, 0, 0, 1)).norm(), 1e-12);
  for (const char* id : {"ball_row", "ball_row_touching"})
    EXPECT_NEAR(solve_with_samples(*make_problem(id), "moreau_jean", 400).v.sum(), 1, 1e-14)
        << id << " keeps its momentum";
}

TEST(StackedBlocks, SlideOverOneAnother) {
  // All three contacts slip at first.
  const double g = 9.81, t = 0.1;
  const auto p = make_problem("stacked_blocks", {{"duration", t}});
  const Solution s = solve_with_samples(*p, "moreau_jean", 2000);
  // The first two steps build the contact forces up: an error of 2 h mu g.
  EXPECT_NEAR(s.v[0], 1.5 - (0.25 * 3.5 + 0.2 * 1.5) * g / 2 * t, 1e-3);
  EXPECT_NEAR(s.v[2], (0.2 * 1.5 - 0.1 * 0.5) * g * t, 1e-3);
  EXPECT_NEAR(s.v[4], 0.1 * g * t, 1e-3);
  const Solution end = solve_with_samples(*make_problem("stacked_blocks"), "moreau_jean", 2000);
  EXPECT_LE(end.v.cwiseAbs().maxCoeff(), 1e-14) << "they come to rest";
}

TEST(Ball3d, EndsRollingWithFiveSeventhsOfItsSpeed) {
  const auto p = make_problem(
      "ball_3d", {{"height", 0.1}, {"v_x0", 1.4}, {"v_y0", 0}, {"omega_x0", 0}, {"omega_y0", 0}, {"duration", 0.5}});
  const Solution s = solve_with_samples(*p, "moreau_jean", 500);
  // The default tolerance of 1e-9 is that of the velocities of the last step, which sticks.
  EXPECT_NEAR(s.v[0], 1.0, 1e-9) << "the momentum about the contact point is kept exactly";
  EXPECT_NEAR(s.v[4], 1.0 / 0.1, 1e-8);
  EXPECT_EQ(s.v[5], 8) << "spin about the normal meets no friction";
}

TEST(Box3d, TumblesFreelyWithItsMomentum) {
  // R I omega is constant in flight: the equations in angles against the momentum in space.
  const auto p = make_problem("box_3d", {{"d_alpha0", 6}, {"d_beta0", -5}, {"d_gamma0", 9}});
  const Eigen::Vector3d I =
      Eigen::Vector3d(0.1 * 0.1 + 0.05 * 0.05, 0.15 * 0.15 + 0.05 * 0.05, 0.15 * 0.15 + 0.1 * 0.1) / 3;
  const auto momentum = [&](const Vector& q, const Vector& v) -> Eigen::Vector3d {
    using Eigen::AngleAxisd, Eigen::Vector3d;
    const Eigen::Matrix3d R_x = AngleAxisd(q[3], Vector3d::UnitX()).matrix(),
                          R_y = AngleAxisd(q[4], Vector3d::UnitY()).matrix(),
                          R_z = AngleAxisd(q[5], Vector3d::UnitZ()).matrix(), R = R_x * R_y * R_z;
    // Each rate turns about its own axis, in space.
    const Vector3d omega =
        v[3] * Vector3d::UnitX() + R_x * (v[4] * Vector3d::UnitY()) + R_x * R_y * (v[5] * Vector3d::UnitZ());
    return R * I.asDiagonal() * R.transpose() * omega;
  };
  const Solution s = solve_with_samples(*p, "irk:gauss:4,contacts=ignored", 1000);
  ASSERT_TRUE(s.succeeded()) << s.message;
  const Eigen::Vector3d start = momentum(p->info().q0, p->info().v0);
  EXPECT_LE((momentum(s.q, s.v) - start).norm(), 1e-11 * start.norm());
}

TEST(DiscInChute, EndsAtRestBetweenTheWalls) {
  const auto p = make_problem("disc_in_chute");
  const Solution s = solve_with_samples(*p, "moreau_jean", 4000);
  EXPECT_LE(p->gap(s.q).cwiseAbs().maxCoeff(), 1e-3) << "h v = 0.15 ms * 2 m/s";
  EXPECT_LE(s.v.cwiseAbs().maxCoeff(), 1e-13);
}

}  // namespace
}  // namespace ricochet
