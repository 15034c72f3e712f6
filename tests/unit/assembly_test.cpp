#include <gtest/gtest.h>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

TEST(AssembledProblem, PutsContactsAtTheirCoordinates) {
  const double R = 0.05, spacing = 0.08;
  const auto p = make_problem("bead_row", {{"n", 4}, {"spacing", spacing}, {"distance", 10}});
  const ProblemInfo& info = p->info();
  const Vector gap = p->gap(info.q0);
  const Matrix J = p->normal_jacobian(info.q0);
  EXPECT_NEAR(gap[0], 10, 1e-14);
  EXPECT_EQ(J.col(0), Vector::Unit(4, 0));
  for (int i = 1; i < 4; ++i) {
    EXPECT_EQ(info.contacts[i].support, (std::vector<int>{i - 1, i}));
    EXPECT_TRUE(info.contacts[i].is_affine);
    EXPECT_NEAR(info.q0[i] - info.q0[i - 1], 2 * R + spacing, 1e-14);  // rounding of 10
    EXPECT_NEAR(gap[i], spacing, 1e-14);
    EXPECT_EQ(J.col(i), Vector::Unit(4, i) - Vector::Unit(4, i - 1));
  }
}

TEST(AssembledProblem, EvaluatesTheContactsThatAreAskedFor) {
  const auto p = make_problem("sphere_pile", {{"n", 5}});
  const ProblemInfo& info = p->info();
  std::vector<int> chosen;
  for (int i = 0; i < info.n_c(); i += 2) chosen.push_back(i);
  const double untouched = -7;
  Vector all_n(info.n_normal_entries), all_t(info.n_tangent_entries);
  Vector J_n = Vector::Constant(all_n.size(), untouched), J_t = Vector::Constant(all_t.size(), untouched);
  p->normal_jacobian(info.q0.data(), all_n.data());
  p->tangent_jacobian(info.q0.data(), all_t.data());
  p->normal_jacobian_of(chosen, info.q0.data(), J_n.data());
  p->tangent_jacobian_of(chosen, info.q0.data(), J_t.data());
  for (int i = 0; i < info.n_c(); ++i) {
    const bool is_chosen = i % 2 == 0;
    const auto& contact = info.contacts[i];
    const auto size = static_cast<int>(contact.support.size());
    for (int k = 0; k < size; ++k)
      EXPECT_EQ(J_n[contact.normal_begin + k], is_chosen ? all_n[contact.normal_begin + k] : untouched) << i;
    for (int k = 0; k < size * contact.n_t; ++k)
      EXPECT_EQ(J_t[contact.tangent_begin + k], is_chosen ? all_t[contact.tangent_begin + k] : untouched) << i;
  }
}

/// Without restitution the beads stop one after the other, the first when it has fallen the distance.
TEST(BeadRow, ComesToRestAtTheWall) {
  const auto p = make_problem("bead_row", {{"n", 6}});
  Settings settings;
  settings.steps = 500;
  const Solution s = make_method("fesd:radau-iia:2,elements=as_needed")->solve(*p, settings);
  ASSERT_TRUE(s.succeeded()) << s.message;
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(s.q[i], 0.05 + 0.1 * i, 1e-12);  // rounding of the closed gaps, added up
  EXPECT_LE(s.v.cwiseAbs().maxCoeff(), 1e-12);
  // Each bead falls freely until it meets those at rest, and what stops it goes through them into the wall.
  double impulse = 0, momentum = 0;
  for (const auto& event : s.events) {
    if (event.kind == EventKind::impact) impulse += event.Lambda_n[0];
  }
  for (int i = 0; i < 6; ++i) momentum += 0.5 * std::sqrt(1 + 2 * 9.81 * (p->info().q0[i] - (0.05 + 0.1 * i)));
  EXPECT_NEAR(impulse, momentum, 1e-12 * momentum);
}

/// Friction between blocks stops them; momentum in x goes to the ground only.
TEST(BlockColumn, StopsAsOne) {
  const auto p = make_problem("block_column", {{"n", 5}, {"duration", 1}});
  Settings settings;
  settings.steps = 2000;
  const Solution moreau = make_method("moreau_jean")->solve(*p, settings);
  settings.steps = 200;
  const Solution fesd = make_method("fesd:radau-iia:2,elements=as_needed")->solve(*p, settings);
  ASSERT_TRUE(moreau.succeeded() && fesd.succeeded()) << moreau.message << fesd.message;
  EXPECT_LE(fesd.v.cwiseAbs().maxCoeff(), 1e-10);              // all stick at the end
  EXPECT_LE((fesd.q - moreau.q).cwiseAbs().maxCoeff(), 2e-3);  // one step of Moreau-Jean, 5e-4 s, times 1 m/s, twice
}

TEST(AssembledProblem, RefusesWrongParameters) {
  EXPECT_THROW(make_problem("bead_row", {{"n", 0}}), InputError);
  EXPECT_THROW(make_problem("bead_row", {{"n", 2.5}}), InputError);
  EXPECT_THROW(make_problem("bead_row", {{"k", 2}}), InputError);
  EXPECT_THROW(make_problem("block_column", {{"mu", -1}}), InputError);
  EXPECT_THROW(make_problem("sphere_pile", {{"R", 0}}), InputError);
}

}  // namespace
}  // namespace ricochet
