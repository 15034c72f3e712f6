// A method in another language: the client of examples/external for Octave.
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "methods/registry.h"
#include "problems/registry.h"
#include "reference/agreement.h"

namespace ricochet {
namespace {

/// Both clients have the same scheme: their numbers differ by the order of a sum.
TEST(Octave, ClientTakesTheStepsOfThePythonClient) {
  if (std::system("octave-cli --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "octave-cli is not installed";
  const std::string clients = RICOCHET_EXAMPLES "/external/euler";
  const auto octave = make_method("external:octave-cli --no-gui " + clients + ".m");
  const auto python = make_method("external:" RICOCHET_PYTHON " " + clients + ".py");
  Settings settings;
  settings.steps = 200;
  for (const char* id : {"bouncing_ball", "two_balls_spring", "double_pendulum_wall", "ball_row"}) {
    const auto problem = make_problem(id);
    const Solution a = octave->solve(*problem, settings), b = python->solve(*problem, settings);
    ASSERT_TRUE(a.succeeded()) << a.message;
    EXPECT_LE(reference::final_state_difference(a.q, a.v, b.q, b.v), 1e-10) << id;
  }
  EXPECT_FALSE(octave->can_run(make_problem("sliding_block")->info()).ok);
}

}  // namespace
}  // namespace ricochet
