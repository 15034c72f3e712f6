#include "problems/adjustable_problem.h"

#include <gtest/gtest.h>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

AdjustableProblem::Make make(const std::string& id) {
  return [id](const ParameterChanges& changes) { return make_problem(id, changes); };
}

/// What the problem says at a state, function after function.
std::vector<double> everything(const Problem& p, const Vector& q, const Vector& v) {
  const ProblemInfo& info = p.info();
  const int n = p.n_q();
  const Vector a = Vector::LinSpaced(n, 0.5, 1.5), lambda_n = Vector::LinSpaced(p.n_c(), 1, 2);
  const Vector lambda_t = Vector::LinSpaced(info.n_lambda_t, -1, 0.5);
  std::vector<double> all;
  const auto take = [&](int size, const auto& evaluate) {
    std::vector<double> values(static_cast<std::size_t>(size));
    evaluate(values.data());
    all.insert(all.end(), values.begin(), values.end());
  };
  const double *u = info.u.data(), *x = q.data(), *y = v.data();
  take(n * n, [&](double* M) { p.mass_matrix(x, M); });
  take(n, [&](double* f) { p.force(x, y, u, f); });
  take(p.n_c(), [&](double* f_c) { p.gap(x, f_c); });
  take(info.n_normal_entries, [&](double* J_n) { p.normal_jacobian(x, J_n); });
  take(info.n_tangent_entries, [&](double* J_t) { p.tangent_jacobian(x, J_t); });
  take(1, [&](double* energy) { *energy = p.potential_energy(x); });
  take(2 * n * n, [&](double* f_q) { p.force_jacobians(x, y, u, f_q, f_q + n * n); });
  take(n * n, [&](double* Ma_q) { p.mass_derivative(x, a.data(), Ma_q); });
  take(n * n, [&](double* Jl_q) { p.contact_force_derivative(x, lambda_n.data(), lambda_t.data(), Jl_q); });
  take(p.n_c(), [&](double* b) { p.gap_acceleration_bias(x, y, b); });
  take(info.n_lambda_t * n, [&](double* T) { p.slip_velocity_derivative(x, y, T); });
  for (const Vector* values : {&info.q0, &info.v0, &info.u}) all.insert(all.end(), values->begin(), values->end());
  all.push_back(info.end_time);
  for (const auto& contact : info.contacts) all.insert(all.end(), {contact.eps_r, contact.mu});
  for (const auto& parameter : info.parameters) all.push_back(parameter.value);
  return all;
}

/// Every parameter of a scene made smaller by a few percent, each by another share.
ParameterChanges smaller(const ProblemInfo& info) {
  ParameterChanges changes;
  double factor = 1;
  for (const auto& parameter : info.parameters) changes[parameter.name] = parameter.value * (factor -= 0.0037);
  return changes;
}

class EveryAdjustableScene : public testing::TestWithParam<std::string> {};

TEST_P(EveryAdjustableScene, IsTheSameAsOneThatIsMadeWithItsParameters) {
  const auto plain = make_problem(GetParam());
  const ParameterChanges changes = smaller(plain->info());
  std::vector<std::string> names;
  std::vector<double> values;
  for (const auto& [name, value] : changes) {
    names.push_back(name);
    values.push_back(value);
  }
  if (names.empty()) GTEST_SKIP() << "no parameter in its formulas";
  AdjustableProblem varied(make(GetParam()), names);
  std::string refused;
  std::unique_ptr<Problem> made;
  try {
    made = make_problem(GetParam(), changes);
  } catch (const InputError& error) {
    refused = error.what();
  }
  if (!made) {
    try {
      varied.at(values);
      FAIL() << "these parameters are refused: " << refused;
    } catch (const InputError& error) {
      EXPECT_EQ(error.what(), refused);
    }
    return;
  }
  const Vector q = (made->info().q0.array() + 0.1).matrix(), v = (made->info().v0.array() - 0.2).matrix();
  const auto expected = everything(*made, q, v);
  EXPECT_EQ(everything(varied.at(values), q, v), expected);
  std::vector<double> others = values;
  for (double& value : others) value *= 0.999;
  try {
    varied.at(others);
  } catch (const InputError&) {
  }
  EXPECT_EQ(everything(varied.at(values), q, v), expected) << "nothing is left of the values before";
}

INSTANTIATE_TEST_SUITE_P(AdjustableProblems, EveryAdjustableScene, testing::ValuesIn([] {
                           std::vector<std::string> ids;
                           for (const auto& scene : scenes()) ids.push_back(scene.id);
                           return ids;
                         }()),
                         [](const auto& test) { return test_name(test.param); });

TEST(AdjustableProblem, StartsFromOtherInitialValues) {
  AdjustableProblem varied(make("two_balls_spring"), {"k", "v0:1", "q0:0"});
  const std::vector<double> values{5e3, -0.5, 1.1};
  const Problem& problem = varied.at(values);
  EXPECT_EQ(problem.info().q0, (Vector(2) << 1.1, 2).finished());
  EXPECT_EQ(problem.info().v0, (Vector(2) << 0, -0.5).finished());
  EXPECT_EQ(problem.force(problem.info().q0, problem.info().v0)[0], -9.81 + 5e3 * (2 - 1.1 - 1));
}

TEST(AdjustableProblem, OfAnAssembledSceneIsMadeAfresh) {
  AdjustableProblem varied(make("bead_row"), {"e", "n", "v0:2"});
  const std::vector<double> values{0.25, 5, -3};
  const Problem& problem = varied.at(values);
  EXPECT_EQ(problem.n_c(), 5);
  EXPECT_EQ(problem.info().contacts[4].eps_r, 0.25);
  EXPECT_EQ(problem.info().v0[2], -3);
  EXPECT_EQ(problem.info().v0[1], -1);
  EXPECT_THROW(varied.at(std::vector<double>{0.25, 5.5, -3}), InputError);
  EXPECT_EQ(varied.at(values).n_c(), 5) << "behind a refusal";
}

/// A contact without friction has no tangents: the scene is made once more.
TEST(AdjustableProblem, LosesItsFriction) {
  AdjustableProblem varied(make("sliding_block"), {"mu"});
  const double with = varied.base().contacts[0].mu;
  ASSERT_GT(with, 0);
  const auto without = make_problem("sliding_block", {{"mu", 0}}), same = make_problem("sliding_block");
  for (int k = 0; k < 2; ++k) {
    const Problem& smooth = varied.at(std::vector<double>{0});
    EXPECT_EQ(smooth.info().n_lambda_t, 0);
    EXPECT_EQ(everything(smooth, without->info().q0, without->info().v0),
              everything(*without, without->info().q0, without->info().v0));
    const Problem& rough = varied.at(std::vector<double>{with});
    EXPECT_EQ(rough.info().n_lambda_t, 1);
    EXPECT_EQ(everything(rough, same->info().q0, same->info().v0), everything(*same, same->info().q0, same->info().v0));
  }
}

TEST(AdjustableProblem, NamesWhatItDoesNotKnow) {
  EXPECT_THROW(AdjustableProblem(make("two_balls_spring"), {"stiffness"}), InputError);
  EXPECT_THROW(AdjustableProblem(make("two_balls_spring"), {"q0:2"}), InputError);
  EXPECT_THROW(AdjustableProblem(make("two_balls_spring"), {"e", "e"}), InputError);
  AdjustableProblem varied(make("two_balls_spring"), {"e"});
  EXPECT_THROW(varied.at(std::vector<double>{1.5}), InputError);
}

}  // namespace
}  // namespace ricochet
