#include "bench/studies/grid/contact_cost.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "methods/registry.h"

namespace ricochet {
namespace {

TEST(ContactCost, MotionsHaveTheCornersOnThePlaneThatTheyPromise) {
  for (const BoxMotion& motion : box_motions()) {
    const auto problem = make_problem("box_3d", motion.scene);
    const Vector gap = problem->gap(problem->info().q0);
    // Rounding of a sum of a few lengths below 1 m; the next corner is centimetres higher.
    EXPECT_EQ((gap.array().abs() < 1e-15).count(), motion.closed) << motion.name;
    EXPECT_EQ(problem->info().has_friction(), motion.name != "slide without friction");
    Settings settings;
    settings.steps = 20;
    const Solution s = make_method("fesd:radau-iia:2,n_fe=1")->solve(*problem, settings);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_TRUE(s.events.empty()) << motion.name << " " << motion.closed;
    EXPECT_EQ(std::count_if(s.initial_modes.begin(), s.initial_modes.end(), is_closed), motion.closed);
  }
}

TEST(ContactCost, FrictionIsNotCountedWhereNothingTouches) {
  Counters without, with;
  for (const BoxMotion& motion : box_motions()) {
    if (motion.closed > 0) continue;
    Settings settings;
    settings.steps = 20;
    const auto problem = make_problem("box_3d", motion.scene);
    (problem->info().has_friction() ? with : without) =
        make_method("fesd:radau-iia:3")->solve(*problem, settings).counters;
  }
  EXPECT_GT(without.force_evaluations, 0);
  EXPECT_EQ(with.force_evaluations, without.force_evaluations);
  EXPECT_EQ(with.inner_iterations, without.inner_iterations);
  EXPECT_EQ(with.matrix_factorizations, without.matrix_factorizations);
  EXPECT_EQ(with.complementarity_solves, 0);
}

TEST(ContactCost, ATableHasARowPerKindOfContact) {
  const Table table = contact_cost_table(measure_contact_cost({"moreau_jean"}, true));
  ASSERT_EQ(table.rows.size(), 3u);
  for (const auto& row : table.rows) {
    ASSERT_EQ(row.size(), table.columns.size());
    for (std::size_t k = 2; k < 6; ++k) EXPECT_GT(std::stod(row[k]), 0) << row[1];
  }
}

TEST(ContactCost, NamesTheMotionThatFails) {
  // Without a stage at the right end Gauss loses curved contacts.
  const auto costs = measure_contact_cost({"fesd:gauss:2"}, true);
  const auto failed = std::ranges::find_if(costs, [](const ricochet::Run& run) { return !run.succeeded(); });
  ASSERT_NE(failed, costs.end()) << "it ends with a status";
  EXPECT_EQ(failed->condition("closed"), 1);
  EXPECT_FALSE(failed->message.empty());
  EXPECT_EQ(costs.size(), box_motions().size()) << "and the others are measured";
}

}  // namespace
}  // namespace ricochet
