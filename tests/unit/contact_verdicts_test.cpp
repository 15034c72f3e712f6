// Contact solvers on problems without a solution, on their neighbours that have one, and in other units.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "methods/contact_laws/conflicting_contacts.h"
#include "methods/registry.h"
#include "tests/contact_problems.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

std::unique_ptr<ContactSolver> named_solver(const ContactSolverEntry& entry, double tolerance = kContactTolerance) {
  // 200 sweeps: each inner problem of the staggered solver takes all of its iterations where none has a solution.
  const int iterations = entry.kind == ContactSolverKind::staggered ? 200 : entry.usual_iterations;
  return make_contact_solver({.kind = entry.kind, .tolerance = tolerance, .iterations = iterations});
}

Vector numbers(std::initializer_list<double> entries) {
  return Eigen::Map<const Vector>(entries.begin(), static_cast<Eigen::Index>(entries.size()));
}

struct VerdictCase {
  const char* name;
  Matrix J;  ///< n_q x rows: M^-1/2 times the directions of the contacts
  int n_t;   ///< tangents of each contact
  Vector b;
  std::vector<int> conflict;  ///< contacts that close against each other; empty: there is a solution
  bool pgs_is_slow = false;   ///< it would need as many sweeps as the ratio of the masses
};

ContactProblem problem_of(const VerdictCase& c, FrictionLaw law = FrictionLaw::coulomb) {
  const auto n = static_cast<int>(c.b.size()) / (1 + c.n_t);
  std::vector<ContactProblem::Contact> contacts;
  for (int i = 0; i < n; ++i) contacts.push_back({.id = i, .n_t = c.n_t, .mu = c.n_t > 0 ? 0.5 : 0});
  ContactProblem problem;
  problem.law = law;
  set_operator(problem, c.J.transpose() * c.J, contacts);
  problem.b = c.b;
  return problem;
}

/// A point in the plane and walls whose normals have these angles, with tangents where there is friction.
Matrix walls(std::initializer_list<double> angles, bool has_friction) {
  Matrix J(2, static_cast<Eigen::Index>(angles.size()) * (has_friction ? 2 : 1));
  Eigen::Index column = 0;
  for (const double angle : angles) {
    J.col(column++) << std::cos(angle), std::sin(angle);
    if (has_friction) J.col(column++) << -std::sin(angle), std::cos(angle);
  }
  return J;
}

Matrix entries_of(Eigen::Index n, std::initializer_list<double> entries) {
  const auto count = static_cast<Eigen::Index>(entries.size());
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(entries.begin(), n,
                                                                                                  count / n);
}

const std::vector<VerdictCase>& verdict_cases() {
  const double third = 2 * std::numbers::pi / 3;
  const Matrix in_space = entries_of(3, {1, 0, 0, -1, 0, 0,  //
                                         0, 1, 0, 0, 1, 0,   //
                                         0, 0, 1, 0, 0, 1});
  static const std::vector<VerdictCase> all = {
      {"TwoWalls", entries_of(1, {1, -1}), 0, numbers({-1, -1}), {0, 1}},
      {"OneWallFollows", entries_of(1, {1, -1}), 0, numbers({-1, 0.25}), {0, 1}},
      {"SlowWalls", entries_of(1, {1, -1}), 0, numbers({-1e-9, -1e-9}), {0, 1}},
      {"LightBody", entries_of(1, {1e6, -1e6}), 0, numbers({-1, -1}), {0, 1}},
      {"HeavyBody", entries_of(1, {1e-6, -1e-6}), 0, numbers({-1, -1}), {0, 1}},
      {"GapsInOtherUnits", entries_of(1, {1e6, -1}), 0, numbers({-1e6, -1}), {0, 1}},
      {"WithFriction", walls({0, std::numbers::pi}, true), 1, numbers({-1, 0.3, -1, -0.3}), {0, 1}},
      {"InSpace", in_space, 2, numbers({-1, 0.3, 0.1, -1, 0.3, 0.1}), {0, 1}},
      {"ThreeWalls", walls({0, third, 2 * third}, false), 0, numbers({-1, -1, -1}), {0, 1, 2}},
      {"ThreeWallsWithFriction", walls({0, third, 2 * third}, true), 1, numbers({-1, 0, -1, 0, -1, 0}), {0, 1, 2}},
      // A fast body elsewhere, and one that rests: the first and the last contact.
      {"Bystanders", entries_of(3, {1, 0, 0, 0, 0, 1, -1, 0, 0, 0, 0, 1}), 0, numbers({-100, -1, -1, 0}), {1, 2}},

      {"WallsThatKeepTheirDistance", entries_of(1, {1, -1}), 0, numbers({-1, 1}), {}},
      {"WallsThatPart", entries_of(1, {1, -1}), 0, numbers({-1, 1.001}), {}},
      {"ThreeWallsThatMoveAsOne", walls({0, third, 2 * third}, false), 0, numbers({-1, 0.5, 0.5}), {}},
      {"Wedge", walls({0, std::numbers::pi - 1e-3}, false), 0, numbers({-1, -1}), {}, true},
      {"ThinWedge", walls({0, std::numbers::pi - 1e-4}, false), 0, numbers({-1, -1}), {}, true},
      {"HeavyOnLight", entries_of(2, {1, -1, 0, 1e-4}), 0, numbers({0, -1.98}), {}, true},
      {"HeavyOnLightWithFriction",  //
       entries_of(4, {1, 0, -1, 0, 0, 1, 0, -1, 0, 0, 1e-3, 0, 0, 0, 0, 1e-3}),
       1,
       numbers({-1, 0.1, 0, 0}),
       {},
       true},
      {"SpaceBetweenPlates", in_space, 2, numbers({-1, 0.3, 0.1, 1, 0.3, 0.1}), {}},
  };
  return all;
}

using VerdictSolver = std::tuple<ContactSolverEntry, std::size_t>;
class ContactVerdicts : public testing::TestWithParam<VerdictSolver> {
 protected:
  const ContactSolverEntry& entry() const { return std::get<0>(GetParam()); }
  const VerdictCase& stated() const { return verdict_cases()[std::get<1>(GetParam())]; }
};

TEST_P(ContactVerdicts, AreRight) {
  const VerdictCase& c = stated();
  const ContactProblem problem = problem_of(c);
  EXPECT_EQ(conflicting_contacts(problem), c.conflict);
  if (c.pgs_is_slow && (entry().kind == ContactSolverKind::pgs || entry().kind == ContactSolverKind::siconos)) return;
  const SolverAnswer answer = solve(*named_solver(entry()), problem);
  if (!c.conflict.empty()) {
    EXPECT_NE(answer.status, ContactStatus::solved) << "r = " << answer.r.transpose();
    return;
  }
  ASSERT_EQ(answer.status, ContactStatus::solved);
  if (c.n_t == 2 && entry().kind == ContactSolverKind::lemke) return;  // another law, the polygon
  // The laws in long double, relative to b. 1e-9 is asked for; and the rounding of terms, up to 4e8 here, twice what a
  // solver allows, which has rounded W.
  const Matrix W = c.J.transpose() * c.J;
  const Eigen::Matrix<long double, Eigen::Dynamic, 1> r = answer.r.cast<long double>(),
                                                      w = W.cast<long double>() * r + c.b.cast<long double>();
  const long double allowed = 2e-9L * c.b.cwiseAbs().maxCoeff() + 32 * std::numeric_limits<double>::epsilon() *
                                                                      (W.cwiseAbs() * answer.r.cwiseAbs()).maxCoeff();
  for (Eigen::Index row = 0; row < r.size(); row += 1 + c.n_t) {
    EXPECT_LE(std::abs(std::min(W(row, row) * r[row], w[row])), allowed) << row;
    if (c.n_t == 0) continue;
    const auto r_t = r.segment(row + 1, c.n_t), w_t = w.segment(row + 1, c.n_t);
    const long double radius = 0.5L * r[row], excess = r_t.norm() - radius;
    EXPECT_LE(W(row, row) * excess, allowed) << row;
    // Slip takes the whole cone, against itself.
    if (w_t.norm() > allowed) EXPECT_LE(W(row, row) * (r_t + radius * w_t / w_t.norm()).norm(), 1e3L * allowed) << row;
  }
}

/// Under the associated law, too.
TEST_P(ContactVerdicts, AreRightForTheAssociatedLaw) {
  const VerdictCase& c = stated();
  if (c.conflict.empty() || c.n_t == 0) return;
  if (entry().kind == ContactSolverKind::staggered || entry().kind == ContactSolverKind::siconos) return;  // declined
  EXPECT_NE(solve(*named_solver(entry()), problem_of(c, FrictionLaw::associated)).status, ContactStatus::solved);
}

INSTANTIATE_TEST_SUITE_P(All, ContactVerdicts,
                         testing::Combine(testing::ValuesIn(contact_solvers()),
                                          testing::Range(std::size_t{0}, verdict_cases().size())),
                         [](const auto& test) {
                           return fmt::format("{}_{}", std::get<0>(test.param).name,
                                              verdict_cases()[std::get<1>(test.param)].name);
                         });

/// Two walls close on a ball: every solver ends a run with the names of both.
TEST(ContactVerdictsInARun, NameTheContacts) {
  const auto problem = read_scene_file(reference_data("public_reports/scenes/crush.json"));
  std::vector<std::string> methods{"schatzman_paoli",   "stewart_trinkle", "anitescu_potra", "anitescu_convex",
                                   "generalized_alpha", "rattle",          "d1_minus"};
  for (const auto& entry : contact_solvers()) methods.push_back(fmt::format("moreau_jean,solver={}", entry.name));
  Settings settings;
  settings.steps = 200;
  for (const std::string& method : methods) {
    const Solution solution = make_method(method)->solve(*problem, settings);
    EXPECT_EQ(solution.status, Status::inner_solver_failed) << method;
    EXPECT_NE(solution.message.find("contacts 'left' and 'right'"), std::string::npos) << method << solution.message;
    EXPECT_LE(solution.t, 5.03) << method << ": a step of 0.03 s after the walls have met";
  }
}

/// A heavy box falls onto a light one that lies on the floor, and both come to rest.
TEST(ContactVerdictsInARun, AllowMassRatios) {
  for (const double ratio : {1e-8, 1e4, 1e8, 1e10}) {
    const auto problem =
        read_scene_file(reference_data("public_reports/scenes/heavy_on_light_1e8.json"), {{"M", ratio}});
    for (const std::string method : {"fesd_adaptive:radau-iia:4", "event_driven"}) {
      Settings settings;
      settings.tolerance = 1e-8;
      const Solution solution = make_method(method)->solve(*problem, settings);
      ASSERT_TRUE(solution.succeeded()) << method << ratio << solution.message;
      // The tolerance; event_driven has forces to the rounding of 1e-16 times the ratio.
      const double allowed = 1e-8 + (method == "event_driven" ? 2e-16 * ratio : 0);
      EXPECT_NEAR(solution.q[0], 0, allowed) << method << ratio;
      EXPECT_NEAR(solution.q[1], 0.1, allowed) << method << ratio;
      EXPECT_NEAR(solution.v[1], 0, 10 * allowed) << method << ratio;
    }
  }
}

/// g, c and one s_i per contact: G -> g s_i G s_j, b -> c s_i b, r -> c / (g s_i) r, w -> c s_i w.
struct Units {
  int g, c;  ///< powers of two
  std::vector<int> s;
};

ContactProblem in_units(const ContactProblem& problem, const Units& units) {
  const int n = problem.G.n_rows();
  Vector s(n);
  for (int i = 0; i < problem.G.n_contacts(); ++i)
    s.segment(problem.G.row(i), problem.G.size(i)).setConstant(std::ldexp(1.0, units.s[i % units.s.size()]));
  Matrix G(n, n);
  problem.G.to_dense(G);
  ContactProblem other;
  other.law = problem.law;
  set_operator(other, std::ldexp(1.0, units.g) * (s.asDiagonal() * G * s.asDiagonal()), problem.contacts);
  other.b = std::ldexp(1.0, units.c) * s.cwiseProduct(problem.b.head(n));
  return other;
}

class UnitsOfContacts : public testing::TestWithParam<ContactSolverEntry> {};

/// kg for t, mm for km, and gaps that are angles: nothing but the exponents of the results changes.
TEST_P(UnitsOfContacts, ChangeNoVerdictAndNoVelocity) {
  const std::vector<Units> all = {{60, 0, {0}},  {-60, 0, {0}},  {0, 30, {0}},         {0, -30, {0}},
                                  {20, 7, {11}}, {-31, 5, {-9}}, {0, 0, {0, 20, -20}}, {30, -30, {-30, 0, 10, 30}}};
  std::vector<ContactProblem> problems;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    for (const int n_t : {0, 1, 2}) {
      problems.push_back(random_problem(FrictionLaw::coulomb, 4, n_t, 20, seed));
      if (seed <= 3) problems.push_back(random_problem(FrictionLaw::coulomb, 4, n_t, 3, seed));  // redundant
    }
  }
  for (const VerdictCase& c : verdict_cases()) problems.push_back(problem_of(c));
  int count = 0;
  for (const ContactProblem& problem : problems) {
    // What takes a thousand iterations to fail does so in all units.
    if (GetParam().kind == ContactSolverKind::staggered && !conflicting_contacts(problem).empty()) continue;
    const SolverAnswer here = solve(*named_solver(GetParam(), 1e-11), problem);
    for (const Units& units : all) {
      const ContactProblem other = in_units(problem, units);
      const SolverAnswer there = solve(*named_solver(GetParam(), 1e-11), other);
      ASSERT_EQ(there.status == ContactStatus::solved, here.status == ContactStatus::solved)
          << "problem " << count << ", units " << (&units - all.data()) << ": " << reason_of(there.status)
          << ", violation " << there.violation << " and here " << here.violation;
      EXPECT_EQ(conflicting_contacts(other), conflicting_contacts(problem)) << count;
      if (here.status != ContactStatus::solved) continue;
      const double size = problem.b.cwiseAbs().maxCoeff();
      for (int i = 0; i < problem.G.n_contacts(); ++i) {
        const double unit = std::ldexp(1.0, units.c + units.s[i % units.s.size()]);
        for (int row = problem.G.row(i); row < problem.G.row(i) + problem.G.size(i); ++row) {
          // 1e-11 asked for, times the condition of a problem with unique velocities, up to 1e4; and rounding of large
          // impulses
          const double rounding =
              16 * std::numeric_limits<double>::epsilon() * problem.G.row_terms(i, here.r.data(), problem.b.data());
          EXPECT_NEAR(there.w[row] / unit, here.w[row], 1e-7 * size + rounding)
              << "problem " << count << ", units " << (&units - all.data()) << ", row " << row;
        }
      }
    }
    ++count;
  }
}

INSTANTIATE_TEST_SUITE_P(All, UnitsOfContacts, testing::ValuesIn(contact_solvers()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace ricochet
