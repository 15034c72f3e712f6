// Every relaxation of a pair: its derivatives, and what it admits.
#include "methods/complementarity/mpcc/relaxation.h"

#include <gtest/gtest.h>

#include "problems/input_error.h"
#include "tests/nlp_blocks.h"
#include "tests/nlp_check.h"

namespace ricochet {
namespace {

class Relaxations : public testing::TestWithParam<std::string_view> {
 protected:
  const Relaxation& relaxation = find_relaxation(GetParam());

  bool admits(double G, double H, double sigma) const {
    const double lowest = relaxation.frees_bounds ? -sigma : 0;
    if (G < lowest || H < lowest) return false;
    for (const auto& [c, lower, upper] : relaxation.constraints) {
      const double value = c(G, H, sigma).value;
      if (value < lower - 1e-14 || value > upper + 1e-14) return false;
    }
    return true;
  }
};

TEST_P(Relaxations, DerivativesAreThoseOfTheValues) {
  Mpcc mpcc;  // sums of two and of one variable; one variable in both pairs
  const int a = mpcc.nlp.add_variable(0, kInfinity, 0, "a"), b = mpcc.nlp.add_variable(0, kInfinity, 0, "b"),
            c = mpcc.nlp.add_variable(0, kInfinity, 0, "c"), d = mpcc.nlp.add_variable(0, kInfinity, 0, "d");
  add_terms(mpcc.nlp, mpcc.nlp.add_row(0, 1, "row"), 0, {{a, 1, 2}, {d, 3}});
  mpcc.add_pair({a, b}, {c}, "ab_c");
  mpcc.add_pair({a}, {d}, "a_d");
  RelaxedMpcc relaxed(mpcc, relaxation, 2);
  const int n = relaxed.nlp().n_variables(), m = relaxed.nlp().n_rows();
  for (const double sigma : {2.0, 0.1}) {  // both pieces of (6)
    relaxed.set_sigma(sigma);
    expect_derivatives(relaxed.nlp(), Vector{{0.7, 0.4, 0.2, 1.3, 0.6}}.head(n), Vector::LinSpaced(m, -1, 1.5));
  }
}

TEST_P(Relaxations, TendToThePair) {
  for (const double sigma : {1e-3, 1e-6}) {
    if (relaxation.is_elastic()) {
      if (relaxation.penalty) EXPECT_DOUBLE_EQ(relaxation.penalty(0.3, 0.4, sigma).value, 0.12 / sigma);
      if (relaxation.penalty) EXPECT_EQ(relaxation.penalty(0.3, 0, sigma).value, 0);
      continue;
    }
    EXPECT_FALSE(admits(0.3, 0.4, sigma));
    EXPECT_FALSE(admits(-0.3, 0.4, sigma));
    EXPECT_FALSE(admits(0.4, -0.3, sigma));
    // Within 4 sigma of (0, 1/2) there is a point.
    bool is_near = false;
    for (const double G : {0.0, sigma, 2 * sigma}) is_near |= admits(G, 0.5, sigma);
    EXPECT_TRUE(is_near);
  }
}

std::vector<std::string_view> relaxation_names() {
  std::vector<std::string_view> all;
  for (const auto& relaxation : relaxations()) all.push_back(relaxation.name);
  return all;
}
INSTANTIATE_TEST_SUITE_P(All, Relaxations, testing::ValuesIn(relaxation_names()),
                         [](const auto& name) { return std::string(name.param); });

TEST(Relaxation, SmoothedFischerBurmeisterIsTheHyperbola) {
  const double sigma = 0.01;
  for (const double G : {0.01, 0.1, 3.0})
    EXPECT_NEAR(find_relaxation("fischer_burmeister").constraints[0].c(G, sigma / G, sigma).value, 0, 1e-15);
}

TEST(Relaxation, LinFukushimaPassesThroughTheAxes) {
  const auto& curves = find_relaxation("lin_fukushima").constraints;
  EXPECT_EQ(curves[1].c(0, 0, 0.1).value, 0);
  EXPECT_GT(curves[1].c(0, 2, 0.1).value, 0);
  EXPECT_LT(curves[1].c(-0.1, 2, 0.1).value, 0);
  EXPECT_NEAR(curves[0].c(0.1, 0.1, 0.1).value, 0, 1e-17);
}

TEST(Relaxation, SteffensenUlbrichHasTwoContinuousDerivatives) {
  const auto c = find_relaxation("steffensen_ulbrich").constraints[0].c;
  const double sigma = 0.1, step = 1e-9;
  for (const double sign : {1.0, -1.0}) {
    const PairValue in = c(1 + sign * (sigma - step), 1, sigma), out = c(1 + sign * (sigma + step), 1, sigma);
    EXPECT_NEAR(in.value, out.value, 4 * step);
    EXPECT_NEAR(in.d_G, out.d_G, 4 * step);  // the second derivative is below 1.5 / sigma, and zero there
    EXPECT_NEAR(in.d_GG, out.d_GG, 2 * step * 3 / (sigma * sigma));
  }
  EXPECT_EQ(c(0, 1, sigma).value, 0);  // exact outside of |G - H| < sigma
  EXPECT_DOUBLE_EQ(c(0, 0, sigma).value, -sigma * 3 / 8);
}

TEST(Relaxation, LongSumsAreFreedBySigmaInAll) {
  Mpcc mpcc;
  for (const char* name : {"a", "b", "c"}) mpcc.nlp.add_variable(0, kInfinity, 0, name);
  mpcc.add_pair({0, 1}, {2}, "pair");
  RelaxedMpcc relaxed(mpcc, find_relaxation("kadrani"), 0.5);
  EXPECT_EQ(relaxed.nlp().variables[0].lower, -0.25);
  EXPECT_EQ(relaxed.nlp().variables[2].lower, -0.5);
  relaxed.set_sigma(0.1);
  EXPECT_EQ(relaxed.nlp().variables[2].lower, -0.1);
  EXPECT_EQ(mpcc.nlp.variables[2].lower, 0);
}

TEST(Relaxation, UnknownNameListsTheNames) {
  try {
    find_relaxation("schultes");
    FAIL() << "an unknown name was found";
  } catch (const InputError& error) {
    EXPECT_STREQ(
        error.what(),
        "relaxation = schultes: one of scholtes, scholtes_equality, fischer_burmeister, lin_fukushima, kadrani, "
        "steffensen_ulbrich, elastic_1, elastic_inf is required");
  }
}

}  // namespace
}  // namespace ricochet
