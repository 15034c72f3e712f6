// Programs of others as methods: the clients of examples/external, and clients that break the protocol.
#include <gtest/gtest.h>

#include <cstdlib>

#include "bench/measure/timing.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

const std::string kEuler = std::string("external:") + RICOCHET_PYTHON + " " + RICOCHET_EXAMPLES + "/external/euler.py";

std::string odd(const std::string& way) {
  return std::string("external:") + RICOCHET_PYTHON + " " + RICOCHET_ODD_CLIENT + " '" + way + "'";
}

Settings with_steps(int steps) {
  Settings settings;
  settings.steps = steps;
  return settings;
}

double distance(const Solution& a, const Solution& b) {
  return std::max((a.q - b.q).lpNorm<Eigen::Infinity>(), (a.v - b.v).lpNorm<Eigen::Infinity>());
}

/// The client's scheme is that of moreau_jean with theta = 1 where forces are constant and contacts affine. Elsewhere,
/// and after infinitely many impacts, both have order one and differ by about what two values of theta do: up to five
/// times of it in the scenes here.
TEST(ExternalEuler, AgreesWithMoreauJeanOnFrictionlessScenes) {
  const auto client = make_method(kEuler), jean = make_method("moreau_jean,theta=1"),
             other = make_method("moreau_jean");
  int same = 0, alike = 0;
  for (const auto& scene : scenes()) {
    const auto problem = make_problem(scene.id);
    const ProblemInfo& info = problem->info();
    if (info.has_friction() || !client->can_run(info).ok || !jean->can_run(info).ok) continue;
    SCOPED_TRACE(scene.id);
    const auto is_affine = [](const ContactInfo& contact) { return contact.is_affine; };
    const bool is_constant = info.structure.constant_mass && !info.structure.force_uses_position &&
                             !info.structure.force_uses_velocity && info.clock < 0 &&
                             std::ranges::all_of(info.contacts, is_affine) && scene.id != "P1d_ball_e05_through_zeno";
    const Settings settings = with_steps(is_constant ? 400 : 3200);
    const Solution a = client->solve(*problem, settings), b = jean->solve(*problem, settings);
    ASSERT_TRUE(a.succeeded()) << a.message;
    ASSERT_TRUE(b.succeeded()) << b.message;
    if (is_constant) {
      // Impacts along a row are solved by sweeps, which end at 1e-13 of the velocity.
      EXPECT_LE(distance(a, b), 1e-11) << "the same scheme";
      ++same;
    } else {
      EXPECT_LE(distance(a, b), 10 * distance(b, other->solve(*problem, settings)));
      ++alike;
    }
    EXPECT_EQ(a.counters.steps, settings.steps);
    EXPECT_GT(a.own_seconds, 0);
  }
  EXPECT_GE(same, 3);
  EXPECT_GE(alike, 6);
}

/// With friction it is held against the ground truth: of order one, with a constant that 1e-2 covers at 2000 steps.
TEST(ExternalEuler, ConvergesWithFrictionInThePlaneAndInSpace) {
  const auto client = make_method(kEuler);
  for (const char* id : {"P3_sliding_block", "P5_slip_reversal", "P4a_clock_driven_block", "P7a_slide3d_to_stick"}) {
    const auto problem = ground_truth_problem(id);
    for (const auto& truth : ground_truth()) {
      if (truth.id != id) continue;
      const Solution s = client->solve(*problem, with_steps(2000));
      ASSERT_TRUE(s.succeeded()) << s.message;
      EXPECT_LE(state_error(s, truth), 1e-2) << id;
    }
  }
}

TEST(ExternalEuler, TellsImpactsAndStates) {
  const auto problem = make_problem("bouncing_ball");
  Settings settings = with_steps(500);
  settings.recording = Recording::grid;
  const Solution s = make_method(kEuler)->solve(*problem, settings);
  ASSERT_EQ(s.events.size(), 3u);
  EXPECT_EQ(s.events[0].kind, EventKind::impact);
  // An impact is found within a step of 4 ms; the ball falls from 1 m in sqrt(2 / 9.81) s less its radius' part.
  EXPECT_NEAR(s.events[0].t, make_method("fesd:radau-iia:2")->solve(*problem, settings).events[0].t, 8e-3);
  EXPECT_GT(s.events[0].Lambda_n[0], 0);
  EXPECT_EQ(s.samples.size(), 500u);
  settings.recording = Recording::final_state;
  EXPECT_TRUE(make_method(kEuler)->solve(*problem, settings).events.empty());
}

class OddClient : public testing::TestWithParam<std::pair<const char*, const char*>> {};

/// A failed row with the reason, never a crash or a hang; and the next run starts the program again.
TEST_P(OddClient, IsAFailedRunWithTheReason) {
  const auto [way, reason] = GetParam();
  const auto method = make_method(odd(way));
  const auto problem = make_problem("bouncing_ball");
  Settings settings = with_steps(10);
  if (std::string(way) == "is silent") settings.time_limit = 0.2;
  for (int again = 0; again < 2; ++again) {
    const Solution s = method->solve(*problem, settings);
    EXPECT_FALSE(s.succeeded());
    EXPECT_NE(s.message.find(reason), std::string::npos) << s.message;
    EXPECT_EQ(s.q.size(), problem->n_q());
    EXPECT_EQ(s.status == Status::time_limit, settings.time_limit > 0);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Ways, OddClient,
    testing::Values(std::pair{"crashes", "Segmentation fault: the last words"}, std::pair{"exits", "exit code 3"},
                    std::pair{"is silent", "no answer within 1.2 s"}, std::pair{"talks", "progress: 10 %"},
                    std::pair{"short", "q: 0 numbers; 1 are required"}, std::pair{"not a number", "no JSON object"},
                    std::pair{"too large", "q: [\"1e400\"]; a list of numbers"}, std::pair{"other id", "\"id\": "},
                    std::pair{"ends early", "the end time, is required"}, std::pair{"no reason", "message: missing"},
                    std::pair{"gives up", "no way out"}, std::pair{"odd status", "status: 'happy'"},
                    std::pair{"odd event", "events[0].contact: 7"}, std::pair{"odd counter", "counters.beers"},
                    std::pair{"no seconds", "seconds: missing"}, std::pair{"refuses", "too hot"}),
    [](const auto& of) { return test_name(of.param.first); });

TEST(OddClients, ThatDoNotGreetAreBadInput) {
  for (const auto& [way, reason] : {std::pair{"no greeting", "I would rather not"},
                                    {"other version", "ricochet: 2"},
                                    {"odd feature", "levitation"}}) {
    try {
      make_method(odd(way));
      ADD_FAILURE() << way;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(make_method("external:/no/such/program"), InputError);
  EXPECT_THROW(make_method("external"), InputError);
  EXPECT_THROW(make_method(kEuler + ",seed=x"), InputError);
}

/// One start for many runs; a scene is sent again when its parameters change, not for another initial state.
TEST(LivingClient, ServesManyRuns) {
  const auto first = make_problem("bouncing_ball"), heavier = make_problem("bouncing_ball", {{"m", 3}});
  const auto speed = [&](const Problem& problem) {  // 100 scenes + solves
    return make_method(odd("counts"))->solve(problem, with_steps(10)).v[0];
  };
  EXPECT_EQ(speed(*first), 101);
  first->set_initial_state(Vector::Constant(1, 2), Vector::Zero(1));
  EXPECT_EQ(speed(*first), 102);
  EXPECT_EQ(speed(*heavier), 203);
}

TEST(LivingClient, KnowsWhatToRecord) {
  const auto problem = make_problem("bouncing_ball");
  const auto method = make_method(odd("echoes record"));
  Settings settings = with_steps(10);
  double expected = 1;
  for (const Recording recording : {Recording::final_state, Recording::events, Recording::grid}) {
    settings.recording = recording;
    EXPECT_EQ(method->solve(*problem, settings).v[0], expected++);
  }
}

/// Tables show the time of the solve, as the client took it: a quarter of a second, which no clock here sees.
TEST(LivingClient, SaysHowLongItTook) {
  const auto problem = make_problem("bouncing_ball");
  const auto method = make_method(odd("counts"));
  const auto run = [&] { return method->solve(*problem, with_steps(10)); };
  Solution solution;
  EXPECT_EQ(seconds_of(run, solution), 0.25);
  const auto timings = time_runs({{"", 1e-3, [&] { return run().own_seconds; }}}, true, [](double) {});
  EXPECT_NEAR(timings.front().median, 0.25, 1e-12) << "a mean of equal numbers";
}

}  // namespace
}  // namespace ricochet
