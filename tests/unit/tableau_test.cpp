#include <gtest/gtest.h>

#include <Eigen/LU>
#include <complex>
#include <filesystem>
#include <fstream>

#include "methods/runge_kutta/butcher_tableau.h"
#include "problems/input_error.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

/// Coefficients are at most 1 in size and correct to half a unit in the last place; a condition sums up to 9 products.
constexpr double kSum = 4e-16;

struct Known {
  const char* family;
  int min_stages;
  int C_deficit, D_deficit, order_deficit;  // C(n_s - d), D(n_s - d), order 2 n_s - d: Hairer, Wanner II, table IV.5.13
  int numerator_deficit, denominator_deficit;  // degrees of the stability function, n_s - d
};
const Known kKnown[] = {
    {"gauss", 1, 0, 0, 0, 0, 0},        {"radau-ia", 1, 1, 0, 1, 1, 0},     {"radau-iia", 1, 0, 1, 1, 1, 0},
    {"lobatto-iiia", 2, 0, 2, 2, 1, 1}, {"lobatto-iiib", 2, 2, 0, 2, 1, 1}, {"lobatto-iiic", 2, 1, 1, 2, 2, 0},
};

class Tableau : public testing::TestWithParam<Known> {};

TEST_P(Tableau, FulfilsItsSimplifyingAssumptions) {
  const Known& known = GetParam();
  for (int s = known.min_stages; s <= 9; ++s) {
    const ButcherTableau t = make_tableau(known.family, s);
    EXPECT_EQ(t.order, 2 * s - known.order_deficit);
    EXPECT_LE(residual_B(t, t.order), kSum) << t.name;
    EXPECT_LE(residual_C(t, s - known.C_deficit), kSum) << t.name;
    EXPECT_LE(residual_D(t, s - known.D_deficit), kSum) << t.name;
    EXPECT_GT(residual_B(t, t.order + 1), 1e-13) << t.name << " would have a higher order than it can have";
    EXPECT_GE(verified_order(t), t.order) << t.name;
    if (s - known.C_deficit >= 1) EXPECT_LE((t.A.rowwise().sum() - t.c).cwiseAbs().maxCoeff(), kSum) << t.name;
  }
}

/// Pade approximation of exp with numerator degree m and denominator degree k (Hairer, Wanner II, theorem IV.3.11).
std::complex<double> pade(int m, int k, std::complex<double> z) {
  const auto polynomial = [](int own, int other, std::complex<double> x) {
    std::complex<double> sum = 1, term = 1;
    for (int j = 1; j <= own; ++j) {
      term *= x * static_cast<double>(own - j + 1) / static_cast<double>(own + other - j + 1) / static_cast<double>(j);
      sum += term;
    }
    return sum;
  };
  return polynomial(m, k, z) / polynomial(k, m, -z);
}

TEST_P(Tableau, HasItsStabilityFunction) {
  const Known& known = GetParam();
  using Complex = std::complex<double>;
  for (int s = known.min_stages; s <= 9; ++s) {
    const ButcherTableau t = make_tableau(known.family, s);
    for (const Complex z : {Complex(-0.7, 0.4), Complex(0, 2.5), Complex(-8, 3), Complex(1, 0.5)}) {
      const Eigen::MatrixXcd matrix = Eigen::MatrixXcd::Identity(s, s) - z * t.A.cast<Complex>();
      const Eigen::VectorXcd stages = matrix.partialPivLu().solve(Eigen::VectorXcd::Ones(s));
      const Complex R = 1.0 + z * (t.b.cast<Complex>().transpose() * stages)(0);
      const Complex expected = pade(s - known.numerator_deficit, s - known.denominator_deficit, z);
      EXPECT_LE(std::abs(R - expected), 1e-13 * (1 + std::abs(expected)))
          << t.name << " at " << z << ": |z| = 8 costs two digits";
    }
  }
}

TEST_P(Tableau, KnowsItsRightEnd) {
  const Known& known = GetParam();
  for (int s = known.min_stages; s <= 9; ++s) {
    const ButcherTableau t = make_tableau(known.family, s);
    const bool stiffly_accurate = std::string(known.family) == "radau-iia" ||
                                  std::string(known.family) == "lobatto-iiia" ||
                                  std::string(known.family) == "lobatto-iiic";
    if (t.name == "radau-ia:1") continue;  // A = b = 1, that of the implicit Euler method, but c = 0
    EXPECT_EQ(t.is_stiffly_accurate(), stiffly_accurate) << t.name;
    for (int k = 0; k < s; ++k) {  // weights reproduce the value 1 of c^k at the right end
      EXPECT_NEAR(t.right_end.dot(t.c.array().pow(k).matrix()), 1, 1e-12)
          << t.name << ": Gauss weights reach 1e3 for nine stages";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Families, Tableau, testing::ValuesIn(kKnown),
                         [](const auto& test) { return test_name(test.param.family); });

double rounded(long double x) {
  return static_cast<double>(x);
}

TEST(TableauCoefficients, AreCorrectToTheLastBit) {
  // Hairer, Wanner II, tables IV.5.2, IV.5.5, IV.5.6, IV.5.12; long double carries 11 bits more than the result.
  const long double r3 = sqrtl(3), r6 = sqrtl(6), r15 = sqrtl(15);
  const ButcherTableau g2 = make_tableau("gauss", 2), g3 = make_tableau("gauss", 3), r2 = make_tableau("radau-iia", 2),
                       r3a = make_tableau("radau-iia", 3), ia2 = make_tableau("radau-ia", 2),
                       l3c = make_tableau("lobatto-iiic", 3);
  EXPECT_EQ(g2.A(0, 0), 0.25);
  EXPECT_EQ(g2.A(0, 1), rounded(0.25L - r3 / 6));
  EXPECT_EQ(g2.A(1, 0), rounded(0.25L + r3 / 6));
  EXPECT_EQ(g2.c[0], rounded(0.5L - r3 / 6));
  EXPECT_EQ(g3.A(0, 1), rounded(2.0L / 9 - r15 / 15));
  EXPECT_EQ(g3.A(2, 0), rounded(5.0L / 36 + r15 / 30));
  EXPECT_EQ(g3.b[1], rounded(4.0L / 9));
  EXPECT_EQ(r2.A(0, 0), rounded(5.0L / 12));
  EXPECT_EQ(r2.A(0, 1), rounded(-1.0L / 12));
  EXPECT_EQ(r2.c[1], 1.0);
  EXPECT_EQ(r3a.A(0, 0), rounded((88 - 7 * r6) / 360));
  EXPECT_EQ(r3a.A(1, 2), rounded((-2 - 3 * r6) / 225));
  EXPECT_EQ(r3a.A(2, 1), rounded((16 + r6) / 36));
  EXPECT_EQ(r3a.c[0], rounded((4 - r6) / 10));
  EXPECT_EQ(ia2.A(0, 0), 0.25);
  EXPECT_EQ(ia2.A(1, 1), rounded(5.0L / 12));
  EXPECT_EQ(ia2.c[0], 0.0);
  EXPECT_EQ(l3c.A(0, 1), rounded(-1.0L / 3));
  EXPECT_EQ(l3c.A(1, 1), rounded(5.0L / 12));
  EXPECT_EQ(l3c.c[1], 0.5);
}

TEST(TableauCoefficients, OneStageMethodsAreTheKnownOnes) {
  EXPECT_EQ(make_tableau("gauss", 1).A(0, 0), 0.5);
  EXPECT_EQ(make_tableau("radau-iia", 1).A(0, 0), 1.0);
  EXPECT_EQ(make_tableau("radau-ia", 1).A(0, 0), 1.0);
  EXPECT_EQ(make_tableau("radau-ia", 1).c[0], 0.0) << "c is not the row sum here: Radau IA 1 fulfils C(0) only";
}

TEST(TableauCoefficients, StagesOutOfRange) {
  EXPECT_THROW(make_tableau("gauss", 0), InputError);
  EXPECT_THROW(make_tableau("gauss", 10), InputError);
  EXPECT_THROW(make_tableau("lobatto-iiia", 1), InputError);
  EXPECT_THROW(make_tableau("gaus", 2), InputError);
}

class TableauFile : public testing::Test {
 protected:
  std::string path =
      (std::filesystem::temp_directory_path() / ("ricochet_tableau_" + std::to_string(::getpid()) + ".json")).string();
  ~TableauFile() override { std::filesystem::remove(path); }
  ButcherTableau read(const std::string& text) {
    std::ofstream(path) << text;
    return read_tableau_file(path);
  }
  std::string error(const std::string& text) {
    try {
      read(text);
    } catch (const InputError& e) {
      std::string message = e.what();
      return message.substr(message.find(": ") + 2);
    }
    return "no error";
  }
};

TEST_F(TableauFile, ReadsExactExpressions) {
  const ButcherTableau t =
      read(R"({"name": "my gauss", "A": [["1/4", "1/4-sqrt(3)/6"], ["1/4+sqrt(3)/6", "1/4"]], "b": ["1/2", "1/2"]})");
  const ButcherTableau g = make_tableau("gauss", 2);
  EXPECT_EQ(t.A, g.A);
  EXPECT_EQ(t.b, g.b);
  EXPECT_EQ(t.order, 4);
  EXPECT_EQ(t.name, "my gauss");
}

TEST_F(TableauFile, ClassicalRungeKuttaHasOrderFour) {
  const ButcherTableau t =
      read(R"({"A": [[0,0,0,0],["1/2",0,0,0],[0,"1/2",0,0],[0,0,1,0]], "b": ["1/6","1/3","1/3","1/6"], "order": 4})");
  EXPECT_EQ(t.order, 4) << "found by rooted trees: C(1) and D(1) alone would prove order 3";
  EXPECT_EQ(t.right_end.size(), 0) << "two abscissae coincide";
}

TEST_F(TableauFile, KuttasThirdOrderMethodIsNotOfOrderFour) {
  EXPECT_EQ(read(R"({"A": [[0,0,0],["1/2",0,0],[-1,2,0]], "b": ["1/6","2/3","1/6"]})").order, 3);
}

TEST_F(TableauFile, ErrorsNameTheField) {
  EXPECT_EQ(error(R"({"b": [1]})"), "A: this field is missing");
  EXPECT_EQ(error(R"({"A": [[1]], "b": ["1/2"]})"), "b = 0.5: the weights must sum to 1");
  EXPECT_EQ(error(R"({"A": [[1, 2]], "b": [1]})"), "A[0] = [1,2]: a list of 1 numbers is required");
  EXPECT_EQ(error(R"({"A": [["x"]], "b": [1]})").substr(0, 34), "A[0][0], column 1: unknown name 'x");
  EXPECT_EQ(error(R"({"A": [["1/2"]], "b": [1], "order": 3})"), "order = 3: the order conditions confirm order 2 only");
  EXPECT_EQ(error(R"({"A": [["1/2"]], "b": [1], "c": [1]})"), "c = [1]: c must be the row sums of A");
  EXPECT_THROW(read("{"), InputError);
  EXPECT_THROW(read_tableau_file("/nonexistent.json"), InputError);
}

}  // namespace
}  // namespace ricochet
