#include "methods/runge_kutta/embedded_tableau.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "methods/runge_kutta/butcher_tableau.h"
#include "methods/runge_kutta/explicit_coefficients.h"
#include "methods/runge_kutta/order_conditions.h"
#include "problems/input_error.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

/// Largest residual seen where a condition holds: 1.04e-14, Tsitouras 5(4), whose coefficients reach 13. Smallest
/// where one does not: 1.8e-6, Verner 9(8) with 10 nodes.
constexpr double kHolds = 2e-14;
constexpr double kBroken = 1e-6;

TEST(OrderConditions, AreThoseOfAllRootedTrees) {
  // One stage, c = a and b = 1: Phi(t) = a^{|t| - 1}. The residual is largest for the least density 1 / gamma or the
  // greatest, that of the bush, gamma = |t|, or of the tall tree, gamma = |t|!.
  const auto euler = order_conditions(Matrix::Zero(1, 1), Vector::Zero(1), 10);
  const auto implicit = order_conditions(Matrix::Ones(1, 1), Vector::Ones(1), 10);
  const int counts[] = {1, 1, 2, 4, 9, 20, 48, 115, 286, 719};  // Hairer, Norsett, Wanner I, table II.2.3
  ASSERT_EQ(euler.size(), 10u);
  for (int nodes = 1; nodes <= 10; ++nodes) {
    EXPECT_EQ(euler[nodes - 1].count, counts[nodes - 1]);
    EXPECT_DOUBLE_EQ(euler[nodes - 1].residual, 1.0 / nodes);
    EXPECT_DOUBLE_EQ(implicit[nodes - 1].residual, 1 - 1 / std::tgamma(nodes + 1));
  }
}

TEST(OrderConditions, AgreeWithTheSimplifyingAssumptions) {
  const ButcherTableau gauss = make_tableau("gauss", 5);
  EXPECT_EQ(order_from_trees(gauss.A, gauss.b, 12, kHolds), 10);
}

TEST(OrderConditions, NoTreesAreGrownBeyondABrokenOne) {
  EXPECT_EQ(order_conditions(Matrix::Zero(1, 1), Vector::Ones(1), 10, kHolds).size(), 2u) << "Euler's method";
}

class EmbeddedPair : public testing::TestWithParam<std::string> {
 protected:
  const EmbeddedTableau t = embedded_tableau(GetParam());

  void expect_order(const Vector& weights, int order) const {
    const auto conditions = order_conditions(t.A, weights, order + 1);
    for (int p = 1; p <= order; ++p) EXPECT_LE(conditions[p - 1].residual, kHolds) << t.name << ", order " << p;
    EXPECT_GE(conditions[order].residual, kBroken) << t.name << " would have a higher order than is stated";
  }
};

TEST_P(EmbeddedPair, IsExplicitWithRowSumsC) {
  EXPECT_EQ(t.id, GetParam());
  EXPECT_FALSE(t.source.empty());
  EXPECT_EQ(t.A.rows(), t.n_s);
  EXPECT_TRUE(t.A.triangularView<Eigen::Upper>().toDenseMatrix().isZero(0));
  EXPECT_LE((t.A.rowwise().sum() - t.c).cwiseAbs().maxCoeff(), kHolds);
  EXPECT_EQ(t.is_first_same_as_last, t.A.row(t.n_s - 1) == t.b.transpose());
}

TEST_P(EmbeddedPair, FulfilsTheOrderConditionsAndNoMore) {
  expect_order(t.b, t.order);
  if (t.e_2.size() == 0) return expect_order(t.b - t.e, t.error_order);
  expect_order(t.b - t.e, 5);
  expect_order(t.b - t.e_2, 3);
  EXPECT_EQ(t.error_order, 2 * 6 - 4 - 1) << "(3) of the header";
}

/// Kepler's problem, y = (x, v): all derivatives of its right-hand side count.
Vector kepler(const Vector& y) {
  Vector f(4);
  f << y.tail(2), -y.head(2) / std::pow(y.head(2).norm(), 3);
  return f;
}

Vector kepler_solution(double t) {
  const double e = 0.3, axis = std::sqrt(1 - e * e);
  double E = t;
  for (int k = 0; k < 20; ++k) E -= (E - e * std::sin(E) - t) / (1 - e * std::cos(E));  // t = E - e sin E
  const double rate = 1 / (1 - e * std::cos(E));
  return Vector{{std::cos(E) - e, axis * std::sin(E), -std::sin(E) * rate, axis * std::cos(E) * rate}};
}

struct Step {
  double error, estimate;
};

Step kepler_step(const EmbeddedTableau& t, double from, double h) {
  const Vector y = kepler_solution(from);
  Matrix k = Matrix::Zero(4, t.n_s);
  for (int i = 0; i < t.n_s; ++i) k.col(i) = kepler(y + h * k * t.A.row(i).transpose());
  double estimate = (h * k * t.e).norm();
  if (t.e_2.size() > 0) estimate *= estimate / std::hypot(estimate, 0.1 * (h * k * t.e_2).norm());  // (3)
  return {(y + h * k * t.b - kepler_solution(from + h)).norm(), estimate};
}

TEST_P(EmbeddedPair, HasItsOrderOnANonlinearProblem) {
  double error = 0, estimate = 0;  // mean powers of h over steps that start all around the orbit
  const int n = 24;
  for (int i = 0; i < n; ++i) {
    const double from = 2 * M_PI * i / n;
    const Step coarse = kepler_step(t, from, 0.4), fine = kepler_step(t, from, 0.2);
    error += std::log2(coarse.error / fine.error) / n;
    estimate += std::log2(coarse.estimate / fine.estimate) / n;
  }
  // Seen: -0.05 to 0.99 above, since good pairs have small leading coefficients. Smaller steps would show rounding.
  EXPECT_GE(error, t.order + 1 - 0.1);
  EXPECT_GE(estimate, t.error_order + 1 - 0.1);
  EXPECT_LE(estimate, t.error_order + 1 + 0.9);
}

INSTANTIATE_TEST_SUITE_P(Known, EmbeddedPair, testing::ValuesIn(embedded_tableau_names()),
                         [](const auto& test) { return test_name(test.param); });

TEST(EmbeddedTableaus, AreFoundByTheirName) {
  for (const char* name : {"dopri5", "dop853", "prince-dormand-8-7", "verner-9-8"})
    EXPECT_EQ(embedded_tableau(name).id, name);
  EXPECT_TRUE(embedded_tableau("dopri5").is_first_same_as_last);
  EXPECT_FALSE(embedded_tableau("prince-dormand-8-7").is_first_same_as_last);
  try {
    embedded_tableau("dopri");
    FAIL() << "an unknown name was taken";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("dopri5"), std::string::npos) << error.what();
  }
}

TEST(EmbeddedTableaus, AreConstantExpressions) {
  static_assert(PrinceDormand87::A[12][11] == 0, "loops that are unrolled drop this");
  static_assert(PrinceDormand87::e[1] == 0 && DormandPrince853::e_2[1] == 0);
  static_assert(is_first_same_as_last<DormandPrince54>() && !is_first_same_as_last<Verner98>());
  static_assert(DormandPrince54::b[0] == 35.0 / 384);
}

class EmbeddedTableauFile : public testing::Test {
 protected:
  std::string path =
      (std::filesystem::temp_directory_path() / fmt::format("ricochet_embedded_{}.json", ::getpid())).string();
  ~EmbeddedTableauFile() override { std::filesystem::remove(path); }
  EmbeddedTableau read(const nlohmann::json& fields) {
    std::ofstream(path) << fields;
    return read_embedded_tableau(path);
  }
  /// The pair of Heun and Euler with some fields replaced; null removes one.
  static nlohmann::json heun(const nlohmann::json& changes) {
    nlohmann::json fields = {{"A", {{0, 0}, {1, 0}}}, {"b", {"1/2", "1/2"}}, {"b_hat", {1, 0}}};
    fields.merge_patch(changes);
    return fields;
  }
  std::string error(const nlohmann::json& changes) {
    try {
      read(heun(changes));
    } catch (const InputError& e) {
      const std::string message = e.what();
      return message.substr(message.find(path) + path.size() + 2);
    }
    return "no error";
  }
};

TEST_F(EmbeddedTableauFile, IsReadWithItsOrders) {
  const EmbeddedTableau t = read_embedded_tableau(test_data("heun_euler.json"));
  EXPECT_EQ(t.name, "Heun-Euler 2(1)");
  EXPECT_EQ(t.order, 2);
  EXPECT_EQ(t.error_order, 1);
  EXPECT_EQ(t.c, (Vector{{0, 1}}));
  EXPECT_EQ(t.e, (Vector{{-0.5, 0.5}}));
  EXPECT_FALSE(t.is_first_same_as_last);
  EXPECT_EQ(t.e_2.size(), 0);
}

TEST_F(EmbeddedTableauFile, HoldsEveryKnownPair) {
  const auto list = [](const auto& v) { return std::vector<double>(v.begin(), v.end()); };
  for (const std::string& name : embedded_tableau_names()) {
    const EmbeddedTableau known = embedded_tableau(name);
    nlohmann::json rows;
    for (int i = 0; i < known.n_s; ++i) rows.push_back(list(known.A.row(i)));
    const EmbeddedTableau t = read({{"A", rows}, {"b", list(known.b)}, {"c", list(known.c)}, {"e", list(known.e)}});
    EXPECT_EQ(t.A, known.A) << name;
    EXPECT_EQ(t.b, known.b) << name;
    EXPECT_EQ(t.c, known.c) << name;
    EXPECT_EQ(t.e, known.e) << name;
    EXPECT_EQ(t.order, known.order) << name;
    EXPECT_EQ(t.error_order, name == "dop853" ? 5 : known.error_order) << name << ": a file has one estimate";
    EXPECT_EQ(t.is_first_same_as_last, known.is_first_same_as_last) << name;
  }
}

TEST_F(EmbeddedTableauFile, ExactNumbersAreRoundedOnce) {
  const EmbeddedTableau t = read(
      {{"A", {{0, 0, 0, 0}, {"1/2", 0, 0, 0}, {0, "3/4", 0, 0}, {"2/9", "0.333333333333333333333333333333", "4/9", 0}}},
       {"b", {"2/9", "1/3", "4/9", 0}},
       {"b_hat", {"7/24", "1/4", "1/3", "1/8"}}});
  const EmbeddedTableau known = embedded_tableau("bogacki-shampine-3-2");
  EXPECT_EQ(t.A, known.A);
  EXPECT_EQ(t.b, known.b);
  EXPECT_EQ(t.e, known.e);
  EXPECT_TRUE(t.is_first_same_as_last);
}

TEST_F(EmbeddedTableauFile, ALowerOrderMayBeStated) {
  EXPECT_EQ(read(heun({{"order", 1}})).order, 1);
  // Euler's method with Heun's as its estimate: the difference is O(h^2), although the weights b_hat are of order 2.
  const EmbeddedTableau euler = read(heun({{"b", {1, 0}}, {"b_hat", {0.5, 0.5}}}));
  EXPECT_EQ(euler.order, 1);
  EXPECT_EQ(euler.error_order, 1);
}

TEST_F(EmbeddedTableauFile, ErrorsNameTheField) {
  EXPECT_EQ(error({{"A", nullptr}}), "A: this field is missing");
  EXPECT_EQ(error({{"b_hat", nullptr}}), "b_hat: this field, or e in its place, is missing");
  EXPECT_EQ(error({{"e", {0.5, -0.5}}}), "b_hat: this field or e may be given, not both");
  EXPECT_EQ(error({{"b_hat", {"1/2", "1/2"}}}), "b_hat: there is no error estimate, since b_hat is b");
  EXPECT_EQ(error({{"b_hat", {1, 1}}}), "b_hat = 2: the weights must sum to 1");
  EXPECT_EQ(error({{"b_hat", nullptr}, {"e", {1, 0}}}), "e = 1: the weights must sum to 0");
  EXPECT_EQ(error({{"b", {1, 1}}}), "b = 2: the weights must sum to 1");
  EXPECT_EQ(error({{"b", nlohmann::json::array()}}), "b = []: a list of weights is required");
  EXPECT_EQ(error({{"b_hat", {1}}}), "b_hat = [1]: a list of 2 numbers is required");
  EXPECT_EQ(error({{"A", {{0, 0}}}}), "A = [[0,0]]: 2 rows are required");
  EXPECT_EQ(error({{"A", {{0, 0}, {1, "1/2"}}}}),
            "A[1][1] = 0.5: an explicit method has zeros on the diagonal and above");
  EXPECT_EQ(error({{"A", {{0, 0}, {"1/0", 0}}}}).substr(0, 7), "A[1][0]");
  EXPECT_EQ(error({{"A", {{0, 0}, {true, 0}}}}), "A[1][0] = boolean: a number or an expression in quotes is required");
  EXPECT_EQ(error({{"c", {0, 0.5}}}), "c = [0,0.5]: c must be the row sums of A");
  EXPECT_EQ(error({{"order", 3}}), "order = 3: the order conditions confirm order 2 only");
  EXPECT_EQ(error({{"order", 1.5}}), "order = 1.5: a whole number, at least 1, is required");
  EXPECT_EQ(error({{"error_order", 2}}), "error_order = 2: the order conditions confirm order 1 only");
  EXPECT_EQ(error({{"error_order", 0}}), "error_order = 0: a whole number, at least 1, is required");
  EXPECT_EQ(error({{"name", 7}}), "name = 7: a text in quotes is required");
  EXPECT_THROW(read(heun({{"bhat", {1, 0}}})), InputError) << "a misspelt field";
  EXPECT_THROW(read(nlohmann::json::array()), InputError);
  EXPECT_THROW(read_embedded_tableau("/nonexistent.json"), InputError);
}

}  // namespace
}  // namespace ricochet
