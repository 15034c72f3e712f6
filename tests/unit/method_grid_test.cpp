// The runs of a grid of methods and settings, as their rows say.
#include <gtest/gtest.h>

#include "reports/record.h"
#include "tests/small_experiment.h"

namespace ricochet {
namespace {

/// Orders are drawn against T / (N_sim N_FE), however many elements an impact adds to a step.
TEST(MethodGrid, StepLengthsAreThoseOfTheElements) {
  const auto records = run_small_experiment(R"({"id": "grid", "kind": "method_grid", "title": "t", "description": "d.",
      "problem": "bouncing_ball", "parameters": {"duration": 2}, "reference": null, "times": false, "grids": {"few": [100, 250]},
      "methods": [{"method": "fesd:radau-iia:2,elements=as_needed,n_fe=1", "steps": "few"},
                  {"method": "fesd:radau-iia:2,elements=as_needed", "steps": "few"},
                  {"method": "fesd:radau-iia:2,elements=as_needed,n_fe=3", "steps": "few"},
                  {"method": "moreau_jean", "steps": "few"}]})")
                           .all<Record>();
  ASSERT_EQ(records.size(), 8u);
  const int elements[] = {1, 2, 3, 1};
  for (std::size_t k = 0; k < records.size(); ++k) {
    ASSERT_TRUE(records[k].succeeded()) << records[k].message;
    EXPECT_NEAR(records[k].h_bar, 2.0 / (records[k].steps * elements[k / 2]), 1e-16) << records[k].method;
  }
}

}  // namespace
}  // namespace ricochet
