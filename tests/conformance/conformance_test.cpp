// Every registered method on every scene. A new method is covered by the examples it registers, a new scene by its
// name.
#include <gtest/gtest.h>

#include <cstring>
#include <set>

#include "methods/contact_laws/friction_polygon.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "tests/method_scene_pairs.h"

namespace ricochet {
namespace {

using Pair = MethodScenePair;

Settings test_settings(int steps) {
  Settings settings;
  settings.steps = steps;
  settings.tolerance = 1e-9;
  settings.audit = true;
  settings.recording = Recording::grid;
  settings.time_limit = 20;
  return settings;
}

class Conformance : public testing::TestWithParam<Pair> {};

/// Methods that evaluate their own equations afresh: all of FESD-J but its homotopy, and time stepping with a contact
/// problem in each step.
bool is_audited(const std::string& method) {
  const std::string name = MethodSpec(method).name();
  static const std::set<std::string> without = {"irk", "event_driven",  "cvode",  "arkode",
                                                "ida", "fesd_homotopy", "penalty"};
  return !without.contains(name) && !name.starts_with("siconos");
}

/// Peers that keep no samples: their steps are their own.
bool keeps_samples(const std::string& method) {
  static const std::set<std::string> without = {"cvode", "arkode", "ida", "siconos_event_driven"};
  return !without.contains(MethodSpec(method).name());
}

bool same_bits(const Vector& a, const Vector& b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())) == 0;
}

TEST_P(Conformance, KeepsItsPromises) {
  const Pair& pair = GetParam();
  const Problem& problem = *pair.problem;
  const ProblemInfo& info = problem.info();
  const auto method = make_method(pair.method);
  const Solution s = method->solve(problem, test_settings(pair.steps));

  // A status, with a reason and a state, whatever happened.
  ASSERT_EQ(s.q.size(), info.n_q);
  ASSERT_EQ(s.v.size(), info.n_q);
  EXPECT_EQ(s.message.empty(), s.succeeded()) << s.message;
  EXPECT_TRUE(s.q.allFinite() && s.v.allFinite());
  if (s.succeeded()) {
    EXPECT_EQ(s.t, info.end_time) << "it ends exactly at the end";
  } else {
    EXPECT_LT(s.t, info.end_time);
    EXPECT_NE(s.status, Status::non_finite);
  }
  // The audit's bound, relative to the terms that cancel: twice what the sign conditions take for rounding of a force.
  // FESD-J lets the box come to rest on four corners at once, and keeps their cones in that one stage to the order of
  // the method only (switch_function.h, eq. (9)): up to 0.017 was seen with 380 to 500 steps, by where the stage lies. Time stepping has a solver that iterates where friction is in space, to
  // contact_tolerance=1e-9 of the largest contact; one with a hundredth of its force has 1e-7 of its own (2.6e-8 was seen
  // with FMA).
  const bool is_fesd = pair.method.starts_with("fesd");
  const bool iterates = has_friction_in_space(info) && !is_fesd;
  EXPECT_LE(s.max_residual(), is_fesd && pair.problem_id == "box_3d" ? 0.05 : iterates ? 1e-7 : 2e-12);
  EXPECT_EQ(s.residuals.empty(), !is_audited(pair.method));
  if (s.counters.steps > 0) EXPECT_GE(s.counters.force_evaluations, 1);
  // What follows about samples says nothing without any.
  if (s.counters.steps > 0) EXPECT_EQ(s.samples.empty(), !keeps_samples(pair.method));

  // Events: in order, impulses push, contacts without impulse carry none.
  double t = 0;
  for (const Event& e : s.events) {
    EXPECT_GE(e.t, t);
    t = e.t;
    ASSERT_GE(e.contact, 0);
    ASSERT_LT(e.contact, info.n_c());
    EXPECT_FALSE(info.contacts[e.contact].is_bilateral) << "it never switches";
    if (e.kind == EventKind::impact) EXPECT_GT(e.Lambda_n[e.contact], 0);
    for (const int i : info.unilateral) EXPECT_GE(e.Lambda_n[i], 0);
  }

  // No energy from nowhere: e <= 1 and friction only dissipate. Time stepping gains O(h) on curved constraints and
  // through explicit forces, so its bound is 5 % of the energy that moves; Kane's pendulum gains 0.018 J with Newton's
  // law and any method, 1e-3 of it. What moves by itself may do work.
  const auto before = info.clock < 0 ? problem.energy(info.q0, info.v0) : std::nullopt;
  if (before) {
    double moved = problem.kinetic_energy(info.q0, info.v0);
    for (const auto& sample : s.samples) moved = std::max(moved, problem.kinetic_energy(sample.q, sample.v_plus));
    const bool first_order = method->info().order_impacts <= 1;
    for (const auto& sample : s.samples) {
      const double gained = *problem.energy(sample.q, sample.v_plus) - *before;
      ASSERT_LE(gained, (first_order ? 0.05 : 1e-3) * moved + 1e-12) << "at t = " << sample.t;
    }
  }

  // The clock is the time, whatever contacts do.
  for (const auto& sample : s.samples) {
    if (info.clock < 0) break;
    // Thousands of additions; an unknown among others, to the tolerance of the interior point method, for the homotopy.
    const double rounding = pair.method.starts_with("fesd_homotopy") ? 1e-9 : 1e-13;
    EXPECT_NEAR(sample.q[info.clock], sample.t, 10 * rounding * std::max(1.0, info.end_time));
    EXPECT_NEAR(sample.v_plus[info.clock], 1, rounding);
  }

  // Twice the same bits, whatever is recorded.
  Settings plain = test_settings(pair.steps);
  plain.recording = Recording::final_state;
  const Solution again = method->solve(problem, plain);
  if (s.status == Status::time_limit || again.status == Status::time_limit) return;  // a slow machine, not the method
  EXPECT_TRUE(same_bits(s.q, again.q) && same_bits(s.v, again.v));
  EXPECT_EQ(s.counters.force_evaluations, again.counters.force_evaluations);
  EXPECT_EQ(s.counters.events, again.counters.events);
  EXPECT_EQ(s.counters.events, static_cast<std::int64_t>(s.events.size()));
  EXPECT_TRUE(again.events.empty() && again.samples.empty());
}

INSTANTIATE_TEST_SUITE_P(AllPairs, Conformance, testing::ValuesIn(pairs_that(true)), [](const auto& test) {
  return test_name(test.param.method + "_on_" + test.param.problem_id);
});

TEST(UnsupportedPairs, SayWhyAndAreRefused) {
  for (const auto& pair : pairs_that(false)) {
    const auto method = make_method(pair.method);
    EXPECT_FALSE(method->supports(pair.problem->info()).reason.empty()) << pair.method << " on " << pair.problem_id;
    EXPECT_THROW(method->solve(*pair.problem, test_settings(pair.steps)), InputError)
        << pair.method << " on " << pair.problem_id;
  }
}

TEST(Registry, EveryMethodIsDescribed) {
  for (const auto& entry : methods()) {
    EXPECT_FALSE(entry.summary.empty()) << entry.name;
    EXPECT_FALSE(entry.usage.empty()) << entry.name;
    if (!entry.make) {
      EXPECT_FALSE(entry.not_built.empty()) << entry.name;
      continue;
    }
    if (entry.name == "external") continue;  // there is none without a program: external_test.cpp
    EXPECT_FALSE(entry.examples.empty()) << entry.name << " is not covered without examples";
    for (const auto& example : entry.examples) {
      const auto info = make_method(example)->info();
      EXPECT_EQ(info.id, example);
      EXPECT_FALSE(info.title.empty());
      EXPECT_FALSE(info.source.empty());
    }
  }
}

TEST(Settings, AreChecked) {
  const auto problem = make_problem("bouncing_ball");
  const auto fesd = make_method("fesd:gauss:2"), cvode = make_method("cvode:adams");
  const auto message = [&](const Method& method, const Settings& settings) {
    try {
      method.solve(*problem, settings);
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  Settings settings;
  EXPECT_EQ(message(*fesd, settings), "steps = 0: at least one step is required, h = T / steps > 0");
  settings.steps = -5;
  EXPECT_EQ(message(*fesd, settings), "steps = -5: at least one step is required, h = T / steps > 0");
  EXPECT_EQ(message(*cvode, settings), "tolerance = 0: a number from 1e-15 to 1 is required");
  settings.tolerance = std::nan("");
  EXPECT_EQ(message(*cvode, settings), "tolerance = nan: a number from 1e-15 to 1 is required");
  settings.steps = 10;
  settings.inner_tolerance = 0;
  EXPECT_EQ(message(*fesd, settings), "inner_tolerance = 0: a number between 0 and 1 is required");
}

}  // namespace
}  // namespace ricochet
