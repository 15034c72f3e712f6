#include "methods/islands/island_run.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "methods/registry.h"
#include "problems/assembly/assembled_problem.h"

namespace ricochet {
namespace {

template <class T>
struct DiscOnFloor : ContactScene<T, 1> {
  Vec<T, 1> gap(const Vec<T, 1>& q) const { return {q[0] - this->size}; }
};

template <class T>
struct DiscOnDisc : ContactScene<T, 4> {
  Vec<T, 1> gap(const Vec<T, 4>& q) const {
    using std::sqrt;
    const T x = q[2] - q[0], y = q[3] - q[1];
    return {sqrt(x * x + y * y) - 2 * this->size};
  }
};

/// Pairs of discs of radius R over a floor, far from each other: in each pair one disc falls on the other, a little
/// beside its middle. Every two discs have a contact.
std::unique_ptr<Problem> pairs_of_discs(int n_pairs, double e) {
  constexpr double R = 0.05, m = 0.1, g = 9.81;
  auto discs = std::make_unique<AssembledProblem>(SceneText{"pairs", "", "", ""}, 0.5);
  const auto floor = discs->add_kind(DiscOnFloor<double>{{R, e}});
  const auto pair = discs->add_kind(DiscOnDisc<double>{{R, e}});
  const int n = 2 * n_pairs;
  for (int i = 0; i < n; ++i) {
    discs->add_coordinate(m, 0, 20 * R * (i / 2) + (i % 2) * 0.1 * R, 0);
    discs->add_coordinate(m, -m * g, i % 2 ? 4 * R : 1.5 * R, 0);
    discs->add_contact(floor, {2 * i + 1}, fmt::format("{} on the floor", i));
  }
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n; ++j)
      discs->add_contact(pair, {2 * i, 2 * i + 1, 2 * j, 2 * j + 1}, fmt::format("{} on {}", j, i));
  }
  return discs;
}

Settings to(double tolerance, Recording recording = Recording::events) {
  Settings settings;
  settings.tolerance = tolerance;
  settings.recording = recording;
  return settings;
}

/// A method whose solvers serve an IslandRun.
class DividedRun {
 public:
  explicit DividedRun(const Problem& problem, const std::string& method = "event_driven")
      : method_(make_method(method)), run_(problem, [this](const Problem& part) { return method_->prepare(part); }) {}
  Solution solve(const Settings& settings) { return run_.solve(settings); }

 private:
  std::unique_ptr<Method> method_;
  IslandRun run_;
};

TEST(PartOfAssembledProblem, HasTheEquationsOfTheWhole) {
  const auto whole = make_problem("sphere_pile", {{"n", 5}});
  const ProblemInfo& info = whole->info();
  // Two spheres with all that they touch.
  std::vector<int> contacts, coordinates;
  const int per_sphere = info.n_q / 5;
  for (int k = per_sphere; k < 3 * per_sphere; ++k) coordinates.push_back(k);
  for (int i = 0; i < info.n_c(); ++i) {
    const auto& support = info.contacts[i].support;
    if (support.front() >= per_sphere && support.back() < 3 * per_sphere) contacts.push_back(i);
  }
  ASSERT_GE(contacts.size(), 3U);
  const auto part = whole->part(coordinates, contacts);
  ASSERT_TRUE(part);
  const Vector q = info.q0(coordinates), v = Vector::LinSpaced(q.size(), -1, 2);
  Vector v_whole = Vector::Zero(info.n_q);
  v_whole(coordinates) = v;
  EXPECT_EQ(part->info().q0, q);
  EXPECT_EQ(part->mass_matrix(q), Matrix(whole->mass_matrix(info.q0)(coordinates, coordinates)));
  EXPECT_EQ(part->force(q, v), Vector(whole->force(info.q0, v_whole)(coordinates)));
  EXPECT_EQ(part->gap(q), Vector(whole->gap(info.q0)(contacts)));
  EXPECT_EQ(part->normal_jacobian(q), Matrix(whole->normal_jacobian(info.q0)(coordinates, contacts)));
  std::vector<int> tangents;
  for (const int i : contacts) {
    for (int d = 0; d < info.contacts[i].n_t; ++d) tangents.push_back(info.contacts[i].tangent_index + d);
  }
  EXPECT_EQ(part->tangent_jacobian(q), Matrix(whole->tangent_jacobian(info.q0)(coordinates, tangents)));
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    EXPECT_EQ(part->info().contacts[k].name, info.contacts[contacts[k]].name);
    EXPECT_EQ(part->info().contacts[k].mu, info.contacts[contacts[k]].mu);
  }
}

/// The ground does not see how a sphere is turned about the vertical: that coordinate is elsewhere.
TEST(PartOfAssembledProblem, NeedsOnlyTheSupportsOfItsContacts) {
  const auto whole = make_problem("sphere_pile", {{"n", 3}});
  const ProblemInfo& info = whole->info();
  for (int i = 0; i < info.n_c(); ++i) {
    const auto& contact = info.contacts[i];
    const auto part = whole->part(contact.support, std::vector<int>{i});
    const Vector q = info.q0(contact.support);
    EXPECT_EQ(part->gap(q)[0], whole->gap(info.q0)[i]) << contact.name;
    EXPECT_EQ(part->normal_jacobian(q), Matrix(whole->normal_jacobian(info.q0)(contact.support, std::vector<int>{i})));
    const Matrix tangents = whole->tangent_jacobian(info.q0).middleCols(contact.tangent_index, contact.n_t);
    EXPECT_EQ(part->tangent_jacobian(q), Matrix(tangents(contact.support, Eigen::all))) << contact.name;
  }
}

TEST(WindowPlan, JoinsWhatMayMeet) {
  const auto discs = pairs_of_discs(3, 0.5);
  WindowPlan plan(*discs);
  const ProblemInfo& info = discs->info();
  plan.divide(info.q0, info.v0, 0.01, 1e-8);  // too short to fall anywhere
  ASSERT_EQ(plan.parts().size(), 1U);
  EXPECT_TRUE(plan.parts()[0].contacts.empty());
  EXPECT_EQ(plan.parts()[0].coordinates.size(), 12U);
  plan.divide(info.q0, info.v0, 0.15, 1e-8);
  ASSERT_EQ(plan.parts().size(), 3U);
  for (std::size_t pair = 0; pair < 3; ++pair) {
    const int first = 4 * static_cast<int>(pair);
    EXPECT_EQ(plan.parts()[pair].coordinates, (std::vector<int>{first, first + 1, first + 2, first + 3}));
    ASSERT_GE(plan.parts()[pair].contacts.size(), 2U);  // the floor, and each other
    EXPECT_EQ(plan.parts()[pair].contacts[0], 2 * static_cast<int>(pair));
  }
  plan.divide(info.q0, info.v0, 10, 1e-8);
  EXPECT_EQ(plan.parts().size(), 1U);
  EXPECT_EQ(plan.parts()[0].contacts.size(), static_cast<std::size_t>(info.n_c()));
}

/// Each pair moves as it does alone, in as many steps: an event does not cost more where there are more bodies.
TEST(IslandRun, AdvancesPairsAsEachAlone) {
  const auto one = pairs_of_discs(1, 0.5), many = pairs_of_discs(25, 0.5);
  const Solution alone = DividedRun(*one).solve(to(1e-8)), together = DividedRun(*many).solve(to(1e-8));
  ASSERT_TRUE(alone.succeeded()) << alone.message;
  ASSERT_TRUE(together.succeeded()) << together.message;
  EXPECT_EQ(together.t, 0.5);
  EXPECT_GT(alone.counters.events, 5);
  for (int pair = 0; pair < 25; ++pair) {
    EXPECT_NEAR(together.q[4 * pair + 1], alone.q[1], 1e-7);  // rounding of 25 m, and its growth
    EXPECT_NEAR(together.q[4 * pair + 3], alone.q[3], 1e-7);
  }
  // Bounces end a little earlier where rounding of the coordinates is larger.
  const auto steps_per_event = [](const Solution& s) {
    return static_cast<double>(s.counters.steps) / static_cast<double>(s.counters.events);
  };
  EXPECT_NEAR(steps_per_event(together), steps_per_event(alone), 0.1 * steps_per_event(alone));
}

/// Against one run of the whole, at times before the errors of impacts have grown.
TEST(IslandRun, MovesAsTheWhole) {
  for (const char* method : {"event_driven", "fesd_adaptive:radau-iia:4"}) {
    SCOPED_TRACE(method);
    // Fewer coordinates than those from which Method divides scenes itself.
    const auto box = make_problem("balls_in_box", {{"n", 11}, {"e", 0.8}, {"duration", 0.3}});
    const Solution whole = make_method(method)->prepare(*box)->solve(to(1e-9));
    const Solution parts = DividedRun(*box, method).solve(to(1e-9));
    ASSERT_TRUE(parts.succeeded()) << parts.message;
    ASSERT_EQ(parts.counters.events, whole.counters.events);
    EXPECT_LE((parts.q - whole.q).lpNorm<Eigen::Infinity>(), 1e-6);  // 1e-9 times the growth over some 20 impacts
    for (std::size_t k = 0; k < whole.events.size(); ++k) {
      EXPECT_NEAR(parts.events[k].t, whole.events[k].t, 1e-6);
      EXPECT_EQ(parts.events[k].contact, whole.events[k].contact);
    }
  }
}

/// Spheres with friction, at first each for itself, and beads that nothing moves.
TEST(IslandRun, RunsScenesOfOtherKinds) {
  for (const char* method : {"event_driven", "fesd_adaptive:radau-iia:4"}) {
    const auto spheres = make_problem("sphere_pile", {{"n", 18}, {"duration", 0.02}});
    const Solution s = make_method(method)->solve(*spheres, to(1e-6));
    EXPECT_TRUE(s.succeeded()) << method << ": " << s.message;
    const auto beads = make_problem("bead_row", {{"n", 120}, {"g", 0}, {"speed", 0}});
    const Solution at_rest = make_method(method)->solve(*beads, to(1e-6));
    EXPECT_TRUE(at_rest.succeeded()) << method << ": " << at_rest.message;
    EXPECT_EQ(at_rest.q, beads->info().q0) << method;
  }
}

/// Whatever is recorded, the motion and its counters are the same.
TEST(IslandRun, CountsEventsAtEveryRecording) {
  const auto discs = pairs_of_discs(4, 0.5);
  const Solution all = DividedRun(*discs).solve(to(1e-8, Recording::motion)),
                 few = DividedRun(*discs).solve(to(1e-8, Recording::final_state));
  EXPECT_EQ(few.q, all.q);
  EXPECT_EQ(few.counters.events, all.counters.events);
  EXPECT_EQ(few.counters.events, std::ssize(all.events));
  EXPECT_EQ(few.initial_modes, all.initial_modes);
}

TEST(IslandRun, RecordsTheWhole) {
  const auto discs = pairs_of_discs(4, 1);
  const ProblemInfo& info = discs->info();
  const Solution s = DividedRun(*discs).solve(to(1e-8, Recording::motion));
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_TRUE(std::ranges::is_sorted(s.events, {}, &Event::t));
  EXPECT_TRUE(std::ranges::is_sorted(s.samples, {}, &Sample::t));
  EXPECT_GT(s.events.size(), 20U);
  const Matrix M = discs->mass_matrix(info.q0);
  for (const Event& event : s.events) {
    ASSERT_EQ(event.modes.size(), info.contacts.size());
    const Vector impulse = discs->normal_jacobian(event.q) * event.Lambda_n;
    EXPECT_LE((M * (event.v_plus - event.v_minus) - impulse).lpNorm<Eigen::Infinity>(), 1e-9) << event.t;
    EXPECT_GE(discs->gap(event.q).minCoeff(), -1e-8);
  }
  EXPECT_EQ(s.motion.begin(), 0);
  EXPECT_EQ(s.motion.end(), 0.5);
  Vector q, v;
  s.motion.at(0.5, q, v);
  EXPECT_LE((q - s.q).lpNorm<Eigen::Infinity>(), 1e-12);  // rounding of the interpolation
  for (const Sample& sample : s.samples) {
    s.motion.at(sample.t, q, v, Motion::Side::after);
    EXPECT_LE((q - sample.q).lpNorm<Eigen::Infinity>(), 1e-7) << sample.t;  // the tolerance of the interpolation
  }
}

TEST(IslandRun, ForgetsTheRunsBefore) {
  const auto discs = pairs_of_discs(3, 0.5);
  DividedRun kept(*discs);
  const Solution first = kept.solve(to(1e-8)), second = kept.solve(to(1e-8));
  EXPECT_EQ(first.q, second.q);
  EXPECT_EQ(first.counters.steps, second.counters.steps);
}

/// A solver whose results are changed.
class Disturbed : public Solver {
 public:
  using Disturbance = std::function<void(const Problem& part, const Settings& settings, Solution& solution)>;
  Disturbed(const Problem& part, std::unique_ptr<Solver> solver, const Disturbance& disturb)
      : part_(part), solver_(std::move(solver)), disturb_(disturb) {}
  Solution solve(const Settings& settings) override {
    Solution solution = solver_->solve(settings);
    disturb_(part_, settings, solution);
    return solution;
  }

 private:
  const Problem& part_;
  std::unique_ptr<Solver> solver_;
  const Disturbance& disturb_;
};

Solution solve_disturbed(const Problem& problem, const Disturbed::Disturbance& disturb) {
  const auto method = make_method("event_driven");
  IslandRun run(problem,
                [&](const Problem& part) { return std::make_unique<Disturbed>(part, method->prepare(part), disturb); });
  return run.solve(to(1e-8));
}

/// Bodies that have left the box in which they were expected may have hit others: the window is repeated.
TEST(IslandRun, RepeatsWindowsInWhichBodiesMoveTooFar) {
  const auto discs = pairs_of_discs(3, 0.5);
  const Solution expected = DividedRun(*discs).solve(to(1e-8));
  int repeated = 0;
  double longest = 0;
  const Solution s = solve_disturbed(*discs, [&](const Problem& part, const Settings& settings, Solution&) {
    if (part.info().end_time < 0.005) {
      longest = std::max(longest, part.info().end_time);
      return;
    }
    (*settings.reached)[0] = {-1e3, 1e3};
    ++repeated;
  });
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_GT(repeated, 0);
  EXPECT_GT(longest, 0.001);
  EXPECT_LE((s.q - expected.q).lpNorm<Eigen::Infinity>(), 1e-6);  // the tolerance and its growth
}

TEST(IslandRun, EndsAllPartsWhereOneFails) {
  const auto discs = pairs_of_discs(3, 0.5);
  const double t_fail = 0.3;
  const Solution s = solve_disturbed(*discs, [&](const Problem& part, const Settings& settings, Solution& solution) {
    const bool is_second_pair = part.n_c() > 0 && part.info().contacts[0].name.starts_with('2');
    if (!is_second_pair || settings.begin + solution.t < t_fail) return;
    // The run pretends that it has ended half way.
    solution.status = Status::infeasible;
    solution.message = "nothing fits";
    solution.t *= 0.5;
  });
  EXPECT_EQ(s.status, Status::infeasible);
  EXPECT_EQ(s.message, "nothing fits");
  EXPECT_GT(s.t, 0.1);
  EXPECT_LT(s.t, t_fail + 0.1);
  auto until = pairs_of_discs(1, 0.5);
  until->set_end_time(s.t);
  const Solution alone = DividedRun(*until).solve(to(1e-8));
  EXPECT_NEAR(s.q[1], alone.q[1], 1e-7);  // the first pair, up to that time
  EXPECT_NEAR(s.q[3], alone.q[3], 1e-7);
}

TEST(IslandRun, EndsAtTheTimeLimit) {
  const auto discs = pairs_of_discs(10, 0.5);
  Settings settings = to(1e-8);
  settings.time_limit = 1e-9;
  const Solution s = DividedRun(*discs).solve(settings);
  EXPECT_EQ(s.status, Status::time_limit);
  EXPECT_LT(s.t, 0.5);
  EXPECT_EQ(s.q.size(), 40);
}

}  // namespace
}  // namespace ricochet
