// Remainders of SeriesProgram: what it encloses contains direct evaluations.
#include <ginac/ginac.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "reference/certified/first_root.h"
#include "reference/certified/series_program.h"

namespace ricochet::reference::certified {
namespace {

constexpr slong kBits = 160;
constexpr slong kDirectBits = 400;  // of direct evaluations, far below the radii that are tested

double random_between(std::mt19937& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
}

/// A variable x(t) = sum c_k t^k + s rho (t/h)^(N+1), |s| <= 1, within its series.
struct Variable {
  Node node;
  std::vector<double> c;
  double rho;
};

/// A program of low order, so that remainders are not small.
class Series : public testing::Test {
 protected:
  static constexpr int N = 5;
  static constexpr double h = 0.25;

  Variable variable(double low, double high) {
    Variable x{p.state(), {random_between(random, low, high)}, random_between(random, 0, 1e-3)};
    for (int k = 1; k <= 3; ++k) x.c.push_back(random_between(random, -0.3, 0.3));
    return x;
  }

  void expand(const std::vector<Variable>& variables, Node output) {
    p.forget();
    for (const auto& x : variables) {
      for (int k = 0; k <= N + 1; ++k) {
        const Ball c(k < std::ssize(x.c) ? x.c[k] : 0.0);
        p.set(x.node, k, c.get());
      }
    }
    std::vector<Node> outputs{output};
    for (const auto& x : variables) outputs.push_back(x.node);
    const auto schedule = p.schedule(outputs);
    for (int k = 0; k <= N; ++k) {
      for (const Node i : schedule) p.compute(i, k, kBits);
    }
    p.measure(schedule, h);
    for (const auto& x : variables) mag_set_d(p.rho(x.node), x.rho);
    is_bounded = true;
    for (const Node i : schedule) is_bounded = is_bounded && p.remainder(i);
  }

  /// A value of the variable at t, somewhere within its remainder.
  Ball value_at(const Variable& x, double t, double s) const {
    Ball sum, term, time(t), scaled(t / h);
    for (std::size_t k = x.c.size(); k-- > 0;) {
      arb_mul(sum.get(), sum.get(), time.get(), kDirectBits);
      term = Ball(x.c[k]);
      arb_add(sum.get(), sum.get(), term.get(), kDirectBits);
    }
    arb_pow_ui(scaled.get(), scaled.get(), N + 1, kDirectBits);
    term = Ball(s * x.rho);
    arb_addmul(sum.get(), scaled.get(), term.get(), kDirectBits);
    return sum;
  }

  /// The enclosure (1) of a node at t.
  Ball enclosure_at(Node f, double t) const {
    Ball sum, time(t), scaled(t / h), error, rho;
    const int degree = p.degree();
    for (int k = degree; k >= 0; --k) {
      arb_mul(sum.get(), sum.get(), time.get(), kDirectBits);
      if (k == 0 || !p.is_constant(f)) arb_add(sum.get(), sum.get(), p.coefficient(f, k), kDirectBits);
    }
    arb_pow_ui(scaled.get(), scaled.get(), static_cast<ulong>(degree + 1), kDirectBits);
    arf_set_mag(arb_midref(rho.get()), p.rho(f));
    arb_mul(error.get(), scaled.get(), rho.get(), kDirectBits);
    arb_add_error(sum.get(), error.get());
    return sum;
  }

  using Direct = std::function<void(arb_ptr, const std::vector<Ball>&)>;

  /// Compares a function of `n` variables within (low, high) with its direct evaluation.
  void check(const char* name, int n, double low, double high,
             const std::function<Node(const std::vector<Node>&)>& make, const Direct& direct) {
    constexpr int kDraws = 40;
    for (int draw = 0; draw < kDraws; ++draw) {
      std::vector<Variable> variables;
      std::vector<Node> nodes;
      for (int k = 0; k < n; ++k) {
        variables.push_back(variable(low, high));
        nodes.push_back(variables.back().node);
      }
      const Node f = make(nodes);
      expand(variables, f);
      ASSERT_TRUE(is_bounded) << name;
      ASSERT_FALSE(mag_is_inf(p.rho(f))) << name;
      EXPECT_LT(mag_get_d(p.rho(f)), 3.0) << name;  // a remainder that bounds something
      for (const double t : {0.0, 0.03, 0.11, 0.19, h}) {
        for (const double s : {-1.0, 0.4, 1.0}) {
          std::vector<Ball> arguments;
          Ball value;
          for (const auto& x : variables) arguments.push_back(value_at(x, t, s));
          direct(value.get(), arguments);
          ASSERT_TRUE(arb_contains(enclosure_at(f, t).get(), value.get())) << name << " at " << t;
        }
      }
    }
  }

  SeriesProgram p{Precision{kBits, N}};
  std::mt19937 random{7};
  bool is_bounded = false;
};

TEST_F(Series, ArithmeticContainsValues) {
  using Nodes = std::vector<Node>;
  using Balls = std::vector<Ball>;
  check(
      "add", 2, -2, 2, [&](const Nodes& x) { return p.add(x[0], x[1]); },
      [](arb_ptr r, const Balls& x) { arb_add(r, x[0].get(), x[1].get(), kDirectBits); });
  check(
      "sub", 2, -2, 2, [&](const Nodes& x) { return p.sub(x[0], x[1]); },
      [](arb_ptr r, const Balls& x) { arb_sub(r, x[0].get(), x[1].get(), kDirectBits); });
  check(
      "mul", 2, -2, 2, [&](const Nodes& x) { return p.mul(x[0], x[1]); },
      [](arb_ptr r, const Balls& x) { arb_mul(r, x[0].get(), x[1].get(), kDirectBits); });
  check(
      "square", 1, -2, 2, [&](const Nodes& x) { return p.mul(x[0], x[0]); },
      [](arb_ptr r, const Balls& x) { arb_sqr(r, x[0].get(), kDirectBits); });
  check(
      "div", 2, 1, 2, [&](const Nodes& x) { return p.div(x[0], x[1]); },
      [](arb_ptr r, const Balls& x) { arb_div(r, x[0].get(), x[1].get(), kDirectBits); });
  check(
      "inverse", 1, -3, -1, [&](const Nodes& x) { return p.div(p.number(3), x[0]); },
      [](arb_ptr r, const Balls& x) { arb_ui_div(r, 3, x[0].get(), kDirectBits); });
  check(
      "scale", 1, -3, 1, [&](const Nodes& x) { return p.div(p.neg(p.mul(p.number(5), x[0])), p.number(3)); },
      [](arb_ptr r, const Balls& x) {
        arb_mul_si(r, x[0].get(), -5, kDirectBits);
        arb_div_ui(r, r, 3, kDirectBits);
      });
  check(
      "sqrt", 1, 1, 3, [&](const Nodes& x) { return p.sqrt(x[0]); },
      [](arb_ptr r, const Balls& x) { arb_sqrt(r, x[0].get(), kDirectBits); });
}

TEST_F(Series, FunctionsContainValues) {
  using Nodes = std::vector<Node>;
  using Balls = std::vector<Ball>;
  check(
      "sin", 1, -3, 3, [&](const Nodes& x) { return p.sin(x[0]); },
      [](arb_ptr r, const Balls& x) { arb_sin(r, x[0].get(), kDirectBits); });
  check(
      "cos", 1, -3, 3, [&](const Nodes& x) { return p.cos(x[0]); },
      [](arb_ptr r, const Balls& x) { arb_cos(r, x[0].get(), kDirectBits); });
  check(
      "exp", 1, -2, 1, [&](const Nodes& x) { return p.exp(x[0]); },
      [](arb_ptr r, const Balls& x) { arb_exp(r, x[0].get(), kDirectBits); });
  check(
      "log", 1, 1, 4, [&](const Nodes& x) { return p.log(x[0]); },
      [](arb_ptr r, const Balls& x) { arb_log(r, x[0].get(), kDirectBits); });
  check(
      "atan", 1, -3, 3, [&](const Nodes& x) { return p.atan(x[0]); },
      [](arb_ptr r, const Balls& x) { arb_atan(r, x[0].get(), kDirectBits); });
  check(
      "asin", 1, -0.4, 0.4, [&](const Nodes& x) { return p.asin(x[0]); },
      [](arb_ptr r, const Balls& x) { arb_asin(r, x[0].get(), kDirectBits); });
}

/// sin(x y) / sqrt(1 + y^2) and its derivatives with respect to x and y.
TEST_F(Series, CompositionsAndDerivativesContainValues) {
  const auto make = [&](const std::vector<Node>& x) {
    return p.div(p.sin(p.mul(x[0], x[1])), p.sqrt(p.add(p.number(1), p.mul(x[1], x[1]))));
  };
  const auto by = [](int which) {
    return [which](arb_ptr r, const std::vector<Ball>& x) {
      Ball product, root, s, c, term;
      arb_mul(product.get(), x[0].get(), x[1].get(), kDirectBits);
      arb_sin_cos(s.get(), c.get(), product.get(), kDirectBits);
      arb_sqr(root.get(), x[1].get(), kDirectBits);
      arb_add_ui(root.get(), root.get(), 1, kDirectBits);
      arb_sqrt(root.get(), root.get(), kDirectBits);
      if (which == 0) {
        arb_mul(r, c.get(), x[1].get(), kDirectBits);  // y cos(x y) / w
        arb_div(r, r, root.get(), kDirectBits);
      } else if (which == 1) {  // x cos(x y) / w - sin(x y) y / w^3
        arb_mul(r, c.get(), x[0].get(), kDirectBits);
        arb_div(r, r, root.get(), kDirectBits);
        arb_mul(term.get(), s.get(), x[1].get(), kDirectBits);
        for (int k = 0; k < 3; ++k) arb_div(term.get(), term.get(), root.get(), kDirectBits);
        arb_sub(r, r, term.get(), kDirectBits);
      } else {
        arb_div(r, s.get(), root.get(), kDirectBits);
      }
    };
  };
  check("value", 2, -1, 1, make, by(2));
  check(
      "by x", 2, -1, 1, [&](const std::vector<Node>& x) { return p.derivative(make(x), x[0]); }, by(0));
  check(
      "by y", 2, -1, 1, [&](const std::vector<Node>& x) { return p.derivative(make(x), x[1]); }, by(1));
}

/// f = sin(x y) with polynomials of lower degree, and f x, which is computed with this degree alone.
TEST_F(Series, LowerDegreesContainValues) {
  for (int draw = 0; draw < 40; ++draw) {
    const Variable x = variable(-1, 1), y = variable(-1, 1);
    const Node f = p.sin(p.mul(x.node, y.node)), product = p.mul(f, x.node);
    for (const int degree : {1, 3}) {
      p.set_degree(N);
      expand({x, y}, f);
      const auto known = p.schedule({f, x.node, y.node});
      p.lower_degree(known, degree);
      for (int k = 0; k <= degree; ++k) p.compute(product, k, kBits);
      p.measure({product}, h);
      ASSERT_TRUE(p.remainder(product));
      EXPECT_LT(mag_get_d(p.rho(product)), 3.0);
      for (const double t : {0.03, 0.11, 0.19, h}) {
        for (const double s : {-1.0, 0.4, 1.0}) {
          const Ball a = value_at(x, t, s), b = value_at(y, t, s);
          Ball value;
          arb_mul(value.get(), a.get(), b.get(), kDirectBits);
          arb_sin(value.get(), value.get(), kDirectBits);
          EXPECT_TRUE(arb_contains(enclosure_at(f, t).get(), value.get())) << degree << " at " << t;
          arb_mul(value.get(), value.get(), a.get(), kDirectBits);
          EXPECT_TRUE(arb_contains(enclosure_at(product, t).get(), value.get())) << degree << " at " << t;
        }
      }
    }
  }
}

/// What has no value within the step has no remainder.
TEST_F(Series, SingularitiesAreRefused) {
  const Variable x{p.state(), {0.1, -0.5}, 0};  // vanishes at t = 0.2
  for (const Node f : {p.div(p.number(1), x.node), p.sqrt(x.node), p.log(x.node), p.asin(p.add(p.number(1), x.node))}) {
    expand({x}, f);
    EXPECT_FALSE(is_bounded);
  }
}

TEST(FirstRoot, EnclosesTheFirstOfSeveralRoots) {
  BoundedPolynomial f;  // (tau - 0.3)(tau - 0.5)(0.7 - tau), rounded
  const double c[] = {0.105, -0.71, 1.5, -1};
  for (int k = 0; k < 4; ++k) arb_poly_set_coeff_arb(f.p, k, Ball(c[k]).get());
  arb_poly_derivative(f.slope, f.p, kBits);
  mag_set_d(f.rho.get(), 1e-15);
  const FirstRoot found = first_root(f, Ball(1.0), Precision{kBits, 3});
  ASSERT_EQ(found.kind, FirstRoot::Kind::found);
  EXPECT_TRUE(arb_contains(found.root.get(), Ball(0.3).get()));
  EXPECT_LT(found.root.log10_radius(), -13);
  EXPECT_EQ(first_root(f, Ball(0.2), Precision{kBits, 3}).kind, FirstRoot::Kind::none);
  EXPECT_NE(first_root(f, Ball(0.3), Precision{kBits, 3}).kind, FirstRoot::Kind::none);
}

/// A double root is neither found nor excluded.
TEST(FirstRoot, GrazingIsUnknown) {
  BoundedPolynomial f;  // (tau - 1/3)^2, rounded
  const double c[] = {1.0 / 9, -2.0 / 3, 1};
  for (int k = 0; k < 3; ++k) arb_poly_set_coeff_arb(f.p, k, Ball(c[k]).get());
  arb_poly_derivative(f.slope, f.p, kBits);
  mag_set_d(f.rho.get(), 1e-15);
  EXPECT_EQ(first_root(f, Ball(1.0), Precision{kBits, 2}).kind, FirstRoot::Kind::unknown);
}

TEST(Ball, NumbersAreReadExactly) {
  const Precision precision{200, 10};
  const Ball tenth = precision.ball(shortest_decimal(0.1)), three = precision.mul(tenth, Ball(10.0));
  EXPECT_TRUE(arb_contains(three.get(), Ball(1.0).get()));
  EXPECT_LT(tenth.log10_radius(), -59);
  EXPECT_TRUE(arb_equal(precision.ball(exact_value(0.1)).get(), Ball(0.1).get()));
  for (const double value : {1e-300, 6.02e23, -0.0001, 12345678.9, 5e-324})
    EXPECT_EQ(precision.ball(shortest_decimal(value)).nearest(), value);
}

TEST(Ball, TextsStateTheirRadius) {
  Ball third;
  arb_set_ui(third.get(), 1);
  arb_div_ui(third.get(), third.get(), 3, 100);
  const Decimal d = decimal(third, 20);
  EXPECT_EQ(d.text, "0.33333333333333333333");
  EXPECT_GE(d.radius, 1.0 / 3 * 1e-20);
  EXPECT_LT(d.radius, 1e-20);
  EXPECT_EQ(d.decimals, 20);
  EXPECT_EQ(decimal(Ball(0.5), 20).radius, 0);
}

}  // namespace
}  // namespace ricochet::reference::certified
