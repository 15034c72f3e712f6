// The formulas of assembled scenes say the same as their numbers.
#include <gtest/gtest.h>

#include <random>

#include "problems/derivatives/symbolic_problem.h"
#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "problems/scene_file/scene_writer.h"
#include "problems/variables.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

struct AssembledCase {
  const char* name;
  const char* scene;
  ParameterChanges changes;
};

/// Numbers and formulas round in another order: a few roundings of 1.1e-16.
constexpr double kRoundings = 2e-15;

void expect_close(const Matrix& a, const Matrix& b, const char* what) {
  ASSERT_EQ(a.rows(), b.rows()) << what;
  ASSERT_EQ(a.cols(), b.cols()) << what;
  if (a.size() == 0) return;
  EXPECT_LE((a - b).cwiseAbs().maxCoeff(), kRoundings * (1 + a.cwiseAbs().maxCoeff())) << what;
}

void expect_same_scene(const Problem& numbers, const Problem& formulas) {
  const ProblemInfo &a = numbers.info(), &b = formulas.info();
  EXPECT_EQ(a.id, b.id);
  expect_close(a.q0, b.q0, "q0");
  expect_close(a.v0, b.v0, "v0");
  EXPECT_EQ(a.end_time, b.end_time);
  EXPECT_EQ(a.impact_law.hypothesis, b.impact_law.hypothesis);
  EXPECT_EQ(a.impact_law.eta, b.impact_law.eta);
  ASSERT_EQ(a.n_c(), b.n_c());
  for (int i = 0; i < a.n_c(); ++i) {
    EXPECT_EQ(a.contacts[i].name, b.contacts[i].name);
    EXPECT_EQ(a.contacts[i].eps_r, b.contacts[i].eps_r) << a.contacts[i].name;
    EXPECT_EQ(a.contacts[i].mu, b.contacts[i].mu) << a.contacts[i].name;
    EXPECT_EQ(a.contacts[i].n_t, b.contacts[i].n_t) << a.contacts[i].name;
  }
  std::mt19937 random(7);
  std::uniform_real_distribution<double> shift(-0.3, 0.3);
  for (int repetition = 0; repetition < 5; ++repetition) {
    Vector q = a.q0, v = a.v0;
    for (double& x : q) x += shift(random);
    for (double& x : v) x += shift(random);
    expect_close(numbers.mass_matrix(q), formulas.mass_matrix(q), "M");
    expect_close(numbers.force(q, v), formulas.force(q, v), "f");
    expect_close(numbers.gap(q), formulas.gap(q), "gap");
    expect_close(numbers.normal_jacobian(q), formulas.normal_jacobian(q), "J_n");
    expect_close(numbers.tangent_jacobian(q), formulas.tangent_jacobian(q), "J_t");
    expect_close(numbers.tangent_jacobian(q).transpose() * v, formulas.tangent_jacobian(q).transpose() * v, "v_t");
    const double terms = numbers.force(q, v).cwiseAbs().dot(q.cwiseAbs());  // of the potential, -f' q
    EXPECT_NEAR(numbers.potential_energy(q.data()), formulas.potential_energy(q.data()), kRoundings * (1 + terms));
  }
}

class AssembledFormulas : public testing::TestWithParam<AssembledCase> {};

TEST_P(AssembledFormulas, AgreeWithTheNumbers) {
  const auto problem = make_problem(GetParam().scene, GetParam().changes);
  const SymbolicModel* formulas = problem->formulas();
  ASSERT_NE(formulas, nullptr);
  EXPECT_EQ(formulas, problem->formulas()) << "made once";
  EXPECT_EQ(problem->symbolic(), nullptr) << "parameters of its formulas do not change the numbers";
  const SymbolicProblem stated(*formulas);
  expect_same_scene(*problem, stated);
  Geometry drawn = *problem->info().geometry, of_symbols = *stated.info().geometry;
  std::vector<double> of_numbers, of_formulas;
  drawn.for_each_number([&](double x) { of_numbers.push_back(x); });
  of_symbols.for_each_number([&](double x) { of_formulas.push_back(x); });
  ASSERT_EQ(of_numbers.size(), of_formulas.size());
  for (std::size_t k = 0; k < of_numbers.size(); ++k) EXPECT_NEAR(of_numbers[k], of_formulas[k], kRoundings);
}

TEST_P(AssembledFormulas, AreWrittenToAFile) {
  const auto problem = make_problem(GetParam().scene, GetParam().changes);
  const auto file = read_scene_text(scene_text(*problem), GetParam().scene);
  expect_same_scene(*problem, *file);
}

INSTANTIATE_TEST_SUITE_P(Scenes, AssembledFormulas,
                         testing::Values(AssembledCase{"bead_row", "bead_row", {}},
                                         AssembledCase{"twelve_beads", "bead_row", {{"n", 12}, {"e", 0.3}}},
                                         AssembledCase{"balls_in_box", "balls_in_box", {}},
                                         AssembledCase{"five_balls", "balls_in_box", {{"n", 5}, {"seed", 3}}},
                                         AssembledCase{"block_column", "block_column", {}},
                                         AssembledCase{"heavy_top", "block_column", {{"n", 5}, {"ratio", 1.3}}},
                                         AssembledCase{"block_on_feet", "block_on_feet", {}},
                                         AssembledCase{"smooth_feet", "block_on_feet", {{"n", 3}, {"mu", 0}}},
                                         AssembledCase{"newtons_cradle", "newtons_cradle", {}},
                                         AssembledCase{"separate_balls", "separate_balls", {}},
                                         AssembledCase{"all_fall", "separate_balls", {{"n", 5}, {"falling", 5}}},
                                         AssembledCase{"sphere_pile", "sphere_pile", {}}),
                         [](const auto& test) { return std::string(test.param.name); });

/// Sums such as 0.1 / 2 + 0.1 are not those of doubles: blocks touch exactly.
TEST(AssembledFormulas, AreExact) {
  const auto problem = make_problem("block_column", {{"n", 7}});
  const SymbolicModel& model = *problem->formulas();
  GiNaC::exmap start;
  for (std::size_t k = 0; k < model.q.size(); ++k) start[model.q[k]] = model.q0[k];
  for (const auto& contact : model.contacts) EXPECT_TRUE(contact.gap.subs(start).expand().is_zero()) << contact.name;
}

TEST(AssembledFormulas, OfTheSecondLayerOfAPile) {
  const auto problem = make_problem("sphere_pile", {{"n", 5}});
  const SymbolicModel& model = *problem->formulas();
  ASSERT_EQ(std::ssize(model.q0), problem->n_q());
  for (int k = 0; k < problem->n_q(); ++k)
    EXPECT_NEAR(model.number(model.q0[static_cast<std::size_t>(k)]), problem->info().q0[k], kRoundings);
}

TEST(AssembledFormulas, CanBeVaried) {
  const auto problem = make_problem("bead_row", {{"n", 3}});
  Vector q0 = problem->info().q0;
  q0[2] += 1;
  problem->set_initial_state(q0, problem->info().v0);
  const auto varied = with_value(*problem, find_variable(problem->info(), "v0:2"), -3);
  EXPECT_EQ(varied->info().v0, Vector({{-1, -1, -3}}));
  EXPECT_EQ(varied->info().q0[2], q0[2]);
  const auto& stated = problem->formulas()->q0;
  EXPECT_EQ(varied->formulas()->q0[1], stated[1]) << "this component is still its formula";
}

}  // namespace
}  // namespace ricochet
