// The parts of an element of time freezing: the derivatives of its equations against differences, on each scene and in
// every region of the contacts, at states where nothing is solved; its right end; the forces at its left end; and the
// step that ends with a switch.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <random>

#include "methods/time_freezing/pseudo_time_end.h"
#include "methods/time_freezing/pseudo_time_equations.h"
#include "methods/time_freezing/region_step.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

constexpr double kLength = 0.03, kDt = 0.02;
constexpr int kStages = 2;

enum class Slip { none, sticks, slips, turns };

struct RegionCase {
  std::string problem_id, tableau;
  Region region = Region::sliding;
  Slip slip = Slip::none;
  std::shared_ptr<const Problem> problem;
};

const char* name_of(Region region) {
  return region == Region::sliding ? "sliding" : region == Region::pushed ? "pushed" : "bouncing";
}

const char* name_of(Slip slip) {
  return slip == Slip::none ? "smooth" : slip == Slip::sticks ? "sticks" : slip == Slip::slips ? "slips" : "turns";
}

std::string name_of(const RegionCase& c) {
  return test_name(c.problem_id + "_" + name_of(c.region) + "_" + name_of(c.slip) + "_" + c.tableau);
}

void PrintTo(const RegionCase& c, std::ostream* out) {
  *out << name_of(c);
}

bool can_have(const ContactInfo& contact, Slip slip) {
  if (contact.is_bilateral) return false;
  return slip == Slip::none ? contact.n_t == 0 : slip == Slip::turns ? contact.n_t == 2 : contact.n_t > 0;
}

std::vector<RegionCase> cases() {
  std::vector<RegionCase> list;
  for (const auto& problem : all_problems()) {
    const ProblemInfo& info = problem.problem->info();
    if (info.contacts.empty() || info.n_q > 16) continue;  // differences of many unknowns take long, and show no more
    for (const Region region : {Region::sliding, Region::pushed, Region::bouncing}) {
      for (const Slip slip : {Slip::none, Slip::sticks, Slip::slips, Slip::turns}) {
        if (std::ranges::none_of(info.contacts, [&](const auto& contact) { return can_have(contact, slip); })) continue;
        const char* tableau = list.size() % 2 == 0 ? "radau-iia" : "gauss";
        list.push_back({problem.id, tableau, region, slip, problem.problem});
      }
    }
  }
  return list;
}

/// An element near the initial state with made-up unknowns: its equations do not hold.
class MadeUpPseudoElement {
 public:
  explicit MadeUpPseudoElement(const RegionCase& of)
      : problem(*of.problem),
        info(problem.info()),
        tableau(make_tableau(of.tableau, kStages)),
        auxiliary(problem, 50, 0.1),
        held(info, kStages),
        equations(problem, tableau, auxiliary, held, counters) {
    Regions regions;
    regions.is_frozen = of.region != Region::sliding;
    regions.of.resize(info.contacts.size());
    for (const int i : info.unilateral) {
      if (!can_have(info.contacts[i], of.slip)) continue;
      regions.of[i].region = of.region;
      regions.of[i].sticks = of.slip == Slip::sticks;
      regions.of[i].turns = of.slip == Slip::turns;
      if (of.slip == Slip::slips || of.slip == Slip::turns) regions.of[i].direction = {0.6, 0.8};
      if (of.slip == Slip::slips && info.contacts[i].n_t == 1) regions.of[i].direction = {-1, 0};
    }
    EXPECT_TRUE(held.set(regions));
    equations.prepare(work);
    equations.resize(work);
    e.resize(info, kStages);
    e.h = kLength;
    e.q0 = info.q0 + 0.01 * random(info.n_q, 1).col(0);
    e.v0 = info.v0 + 0.5 * random(info.n_q, 1).col(0);
    e.y0 = 0.1 * random(info.n_c(), 1).col(0);
    e.w = random(info.n_q, kStages);
    e.s = Vector::Constant(kStages, 0.6) + 0.2 * random(kStages, 1).col(0);
    e.beta = Matrix::Constant(info.n_c(), kStages, 0.5) + 0.3 * random(info.n_c(), kStages);
    e.tau = 0.3 * random(info.n_lambda_t, kStages);
  }

  Matrix random(Eigen::Index rows, Eigen::Index columns) {
    return Matrix::NullaryExpr(rows, columns, [&] { return 2.0 * double(engine() % 10001) / 10000.0 - 1; });
  }

  Vector residual(PseudoTimeElement element, bool with_derivatives = false) {
    equations.begin(element, work);
    equations.set_stages(element, work);
    equations.evaluate(element, kDt, with_derivatives, work);
    return work.r;
  }

  /// The unknown of this number. Null where it is none: s stands still while time is frozen.
  double* unknown(PseudoTimeElement& element, int number) const {
    if (number == kStages * held.n_stage()) return &element.h;
    const int j = number / held.n_stage(), at = number % held.n_stage();
    if (at < info.n_q) return &element.w(at, j);
    if (at == info.n_q) return held.is_frozen() ? nullptr : &element.s[j];
    for (const HeldContact& contact : held.all()) {
      const int d = at - held.row_of(contact);
      if (d == 0) return &element.beta(contact.contact, j);
      const ContactInfo& its = info.contacts[contact.contact];
      if (d > 0 && d <= its.n_t && held.region(contact).sticks) return &element.tau(its.tangent_index + d - 1, j);
    }
    return nullptr;
  }

  const Problem& problem;
  const ProblemInfo& info;
  const ButcherTableau tableau;
  const AuxiliaryDynamics auxiliary;
  Counters counters;
  HeldContacts held;
  PseudoTimeEquations equations;
  PseudoTimeWorkspace work;
  PseudoTimeElement e;

 private:
  std::mt19937 engine{7};
};

class PseudoTimeDerivatives : public testing::TestWithParam<RegionCase> {};

TEST_P(PseudoTimeDerivatives, TheNewtonMatrixIsTheDerivativeOfTheResidual) {
  MadeUpPseudoElement made(GetParam());
  made.residual(made.e, true);
  const Matrix K = made.work.K;
  const double size = K.cwiseAbs().maxCoeff(), step = 3e-6;
  ASSERT_EQ(K.cols(), made.held.n_unknowns());
  int compared = 0;
  for (int column = 0; column < K.cols(); ++column) {
    PseudoTimeElement plus = made.e, minus = made.e;
    if (!made.unknown(plus, column)) continue;
    *made.unknown(plus, column) += step;
    *made.unknown(minus, column) -= step;
    const Vector difference = (made.residual(plus) - made.residual(minus)) / (2 * step);
    // Central differences: third derivatives times step^2, and rounding of the residual, 1e-16 / step.
    EXPECT_LT((difference - K.col(column)).cwiseAbs().maxCoeff(), 1e-7 * size)
        << "stage " << column / made.held.n_stage() + 1 << ", unknown " << column % made.held.n_stage();
    ++compared;
  }
  EXPECT_EQ(compared, K.cols() - (made.held.is_frozen() ? kStages : 0));
}

/// The right end of an element that has left its contacts: f_c = 0 for curved ones, and R' v = 0. Nothing else is changed.
TEST_P(PseudoTimeDerivatives, TheRightEndIsMovedOntoTheContacts) {
  MadeUpPseudoElement made(GetParam());
  const ProblemInfo& info = made.info;
  PseudoTimeElement& e = made.e;
  e.q1 = info.q0 + 1e-3 * made.random(info.n_q, 1).col(0);
  e.v1 = e.v0;
  const Vector q = e.q1, v = e.v1;
  PseudoTimeEnd(made.problem, made.tableau, made.held).correct(e);
  if (made.held.is_frozen() || (!made.held.has_curved() && made.tableau.is_stiffly_accurate())) {
    EXPECT_EQ(e.q1, q);
    EXPECT_EQ(e.v1, v);
    return;
  }
  const Matrix J_n = made.problem.normal_jacobian(e.q1), J_t = made.problem.tangent_jacobian(e.q1);
  const Vector gap_before = made.problem.gap(q), gap = made.problem.gap(e.q1);
  Matrix R = Matrix::Zero(info.n_q, made.held.n_rows()), N = Matrix::Zero(info.n_q, info.n_c());
  double largest_before = 0, largest = 0;
  for (const HeldContact& held : made.held.all()) {
    const ContactInfo& contact = info.contacts[held.contact];
    R.col(held.row) = N.col(held.contact) = J_n.col(held.contact);
    for (int d = 0; d < contact.n_t && made.held.region(held).sticks; ++d)
      R.col(held.row + 1 + d) = J_t.col(contact.tangent_index + d);
    largest_before = std::max(largest_before, std::abs(gap_before[held.contact]));
    largest = std::max(largest, std::abs(gap[held.contact]));
  }
  EXPECT_NE(e.v1, v);
  if (!made.held.has_curved()) EXPECT_EQ(e.q1, q);
  // Contacts of a body may contradict each other: the least is left then.
  if (made.held.has_curved() && N.colPivHouseholderQr().rank() == std::ssize(made.held.all()) && largest_before < 0.01)
    EXPECT_LT(largest, 1e-12) << "four steps of Newton's method, from " << largest_before;
  if (R.colPivHouseholderQr().rank() == R.cols())
    EXPECT_LT((R.transpose() * e.v1).cwiseAbs().maxCoeff(), 1e-11 * (1 + v.cwiseAbs().maxCoeff()));
}

INSTANTIATE_TEST_SUITE_P(Scenes, PseudoTimeDerivatives, testing::ValuesIn(cases()),
                         [](const auto& test) { return name_of(test.param); });

class RegionForcesOfScenes : public testing::TestWithParam<std::string> {};

/// Filippov's motion of contacts that slide or stick all: (1) of instant_law.h, and no acceleration of gaps and slips.
TEST_P(RegionForcesOfScenes, KeepTheContactsByNewtonsLaw) {
  const auto problem = make_problem(GetParam());
  const ProblemInfo& info = problem->info();
  Counters counters;
  InstantSystem system(*problem, counters);
  Vector q = info.q0, v = info.v0;
  for (int k = 0; k < info.n_mechanical(); ++k) {  // somewhere near the start
    q[k] += 0.01 * std::cos(k);
    v[k] += 0.3 * std::sin(1 + k);
  }
  ASSERT_TRUE(system.prepare(q, v, info.unilateral));
  Regions regions;
  regions.of.resize(info.contacts.size());
  for (const int i : info.unilateral) {
    regions.of[i].region = Region::sliding;
    regions.of[i].sticks = info.contacts[i].n_t > 0;
  }
  const AuxiliaryDynamics auxiliary(*problem, 50, 0.1);
  RegionForces forces(info);
  ASSERT_TRUE(forces.solve(system, auxiliary, regions, v, Vector::Zero(info.n_c())));

  const Matrix M = problem->mass_matrix(q), J_n = problem->normal_jacobian(q), J_t = problem->tangent_jacobian(q);
  const Vector by_contacts =
      problem->force_directions(J_n) * forces.lambda_n + problem->force_directions(J_t) * forces.lambda_t;
  const double size = 1 + problem->force(q, v).cwiseAbs().maxCoeff() + by_contacts.cwiseAbs().maxCoeff();
  if (!info.has_bilateral())
    EXPECT_LT((M * forces.w - problem->force(q, v) - by_contacts).cwiseAbs().maxCoeff(), 1e-11 * size);
  if (system.G().fullPivLu().rank() < system.G().cols())
    return;  // redundant contacts: their forces are the nearest ones
  const Vector gaps = J_n.transpose() * forces.w + problem->gap_acceleration_bias(q, v);
  const Vector slips = J_t.transpose() * forces.w + problem->slip_acceleration_bias(q, v);
  const double rate = 1e-9 * (1 + forces.w.cwiseAbs().maxCoeff());
  for (const int i : info.unilateral) {
    EXPECT_NEAR(gaps[i], 0, rate) << info.contacts[i].name;
    for (int d = 0; d < info.contacts[i].n_t; ++d) EXPECT_NEAR(slips[info.contacts[i].tangent_index + d], 0, rate);
  }
  Vector v_held = v;
  project_velocity(system, regions, v_held);
  for (const int i : info.unilateral) EXPECT_NEAR(J_n.col(i).dot(v_held), 0, 1e-11) << info.contacts[i].name;
}

std::vector<std::string> scenes_with_contacts() {
  std::vector<std::string> names;
  for (const auto& entry : scenes()) {
    const auto problem = make_problem(entry.id);
    if (!problem->info().unilateral.empty() && problem->info().n_q <= 40) names.push_back(entry.id);
  }
  return names;
}

INSTANTIATE_TEST_SUITE_P(Scenes, RegionForcesOfScenes, testing::ValuesIn(scenes_with_contacts()),
                         [](const auto& test) { return test_name(test.param); });

/// A step ends where the first switching function vanishes: a falling ball where its gap does.
TEST(RegionStep, EndsAtTheFirstZero) {
  const auto ball = make_problem("bouncing_ball", {{"e", 0}, {"m", 2}});
  const ButcherTableau tableau = make_tableau("radau-iia", 3);
  AuxiliaryDynamics auxiliary(*ball, 50, 0.1);
  Counters counters;
  ContactScales scales(*ball);
  InstantSystem system(*ball, counters);
  RegionForces forces(ball->info());
  RegionStep step(*ball, tableau, auxiliary, scales, system, forces, 1e-14, counters);
  RegionState state{.q = ball->info().q0, .v = ball->info().v0, .y = Vector::Zero(1), .regions = {}, .touching = {}};
  state.regions.of.resize(1);
  scales.begin_step(state.q.data(), state.v.data(), 0.1, true);
  const double g = -ball->force(state.q, state.v)[0] / ball->mass_matrix(state.q)(0, 0), v = state.v[0];
  const double fall = (v + std::sqrt(v * v + 2 * g * ball->gap(state.q)[0])) / g;

  double length = 2 * fall;
  RegionSwitch cause;
  ASSERT_FALSE(step.take(state, length, cause));
  EXPECT_TRUE(cause.is(SwitchKind::gap_closes, 0));
  EXPECT_NEAR(length, fall, 1e-12) << "a gap to its rounding of 2e-13, at some m/s";
  EXPECT_NEAR(step.element().v1()[0], v - g * fall, 1e-11);

  length = 0.5 * fall;
  ASSERT_FALSE(step.take(state, length, cause));
  EXPECT_FALSE(cause) << "nothing happens before";
  EXPECT_EQ(length, 0.5 * fall);
}

TEST(HeldContacts, KeepTheirEquationsWhileOnlyTurningSlipChanges) {
  const auto problem = make_problem("box_3d");
  HeldContacts held(problem->info(), kStages);
  Regions regions;
  regions.of.resize(problem->info().contacts.size());
  EXPECT_TRUE(held.set(regions)) << "the first regions";
  EXPECT_FALSE(held.set(regions));
  EXPECT_TRUE(held.all().empty());
  regions.of[0] = {.region = Region::sliding, .turns = true, .direction = {1, 0}};
  EXPECT_TRUE(held.set(regions));
  EXPECT_EQ(held.n_rows(), 1);
  regions.of[0].direction = {0, 1};
  EXPECT_FALSE(held.set(regions));
  EXPECT_EQ(held.region(held.all()[0]).direction[1], 1) << "it is taken over";
  regions.of[0].turns = false;
  EXPECT_TRUE(held.set(regions));
  regions.of[0].direction = {1, 0};
  EXPECT_TRUE(held.set(regions)) << "the direction of (8) is held";
  regions.of[0].sticks = true;
  EXPECT_TRUE(held.set(regions));
  EXPECT_EQ(held.n_rows(), 3);
  const int with_clock = held.n_unknowns();
  regions.is_frozen = true;
  EXPECT_TRUE(held.set(regions));
  EXPECT_EQ(held.n_unknowns(), with_clock - 1) << "h is given";
}

}  // namespace
}  // namespace ricochet
