// Small mathematical programs with complementarity constraints of the collection MacMPEC and their optimal values.
// Source: Leyffer, MacMPEC: AMPL collection of MPECs, Argonne National Laboratory (2000), and the publications named
// there.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "methods/complementarity/mpcc/nlp.h"
#include "tests/nlp_blocks.h"

namespace ricochet::macmpec {

struct Problem {
  std::string name;
  double optimum = 0;
  Mpcc mpcc;

  int variable(const char* of, double guess, double lower = -kInfinity, double upper = kInfinity) {
    return mpcc.nlp.add_variable(lower, upper, guess, of);
  }
  int nonnegative(const char* of, double guess) { return variable(of, guess, 0); }
  void minimize(double c, const std::vector<Term>& terms) { add_terms(mpcc.nlp, -1, c, terms); }
  /// c + terms in [lower, upper]
  void row(const char* of, double lower, double upper, double c, const std::vector<Term>& terms) {
    add_terms(mpcc.nlp, mpcc.nlp.add_row(lower, upper, of), c, terms);
  }
  /// A slack that equals c + terms, to be one side of a pair.
  int slack(const char* of, double guess, double c, std::vector<Term> terms) {
    const int s = nonnegative(of, guess);
    terms.push_back({s, -1});
    row(of, 0, 0, c, terms);
    return s;
  }
  void pair(int v, int w) {
    mpcc.add_pair({v}, {w}, mpcc.nlp.variables[v].name + " _|_ " + mpcc.nlp.variables[w].name);
  }
};

/// y - exp(x) - exp(z) - s: variables x, y, z, s
class ExponentialRow : public NlpBlock {
 public:
  ExponentialRow(int row, std::vector<int> xyzs) {
    rows = {row};
    variables = std::move(xyzs);
  }
  void evaluate(const double* x, double* values) const override {
    values[0] = x[1] - std::exp(x[0]) - std::exp(x[2]) - x[3];
  }
  void jacobian(const double* x, double* J) const override {
    J[0] = -std::exp(x[0]);
    J[1] = 1;
    J[2] = -std::exp(x[2]);
    J[3] = -1;
  }
  void hessian(const double* x, const double* weights, double* H) const override {
    H[0] = -weights[0] * std::exp(x[0]);
    H[10] = -weights[0] * std::exp(x[2]);
  }
};

/// min (x + 1)^2 + (y - a)^2 + b (z + 1)^2,  z >= 0,  0 <= y - exp(x) - exp(z) _|_ x >= 0
inline Problem exponential(std::string name, double optimum, double a, double b) {
  Problem p{std::move(name), optimum, {}};
  const int x = p.nonnegative("x", 1), y = p.variable("y", 1), z = p.nonnegative("z", 1), s = p.nonnegative("s", 0);
  p.minimize(1 + a * a + b, {{x, 2, 1}, {y, -2 * a, 1}, {z, 2 * b, b}});
  p.mpcc.nlp.add_block(
      std::make_unique<ExponentialRow>(p.mpcc.nlp.add_row(0, 0, "nonlinear"), std::vector<int>{x, y, z, s}));
  p.pair(s, x);
  return p;
}
inline Problem scholtes1() {
  return exponential("scholtes1", 2, 2.5, 1);
}
inline Problem scholtes2() {
  return exponential("scholtes2", 15, 0, 10);
}

/// weight (factor x - 1)^2
struct Square {
  double weight = 1, factor = 1;
};

/// min of a square in x and one in y,  0 <= x _|_ y >= 0, from x = y = start
inline Problem two_squares(std::string name, double optimum, Square in_x, Square in_y, double start) {
  Problem p{std::move(name), optimum, {}};
  const int x = p.nonnegative("x", start), y = p.nonnegative("y", start);
  const auto term = [](int variable, Square s) {
    return Term{variable, -2 * s.weight * s.factor, s.weight * s.factor * s.factor};
  };
  p.minimize(in_x.weight + in_y.weight, {term(x, in_x), term(y, in_y)});
  p.pair(x, y);
  return p;
}
inline Problem scholtes3() {
  return two_squares("scholtes3", 0.5, {.weight = 0.5}, {.weight = 0.5}, 1e-4);
}
inline Problem scale1() {
  return two_squares("scale1", 1, {.factor = 100}, {}, 0);
}
/// A local minimum with the value 100, too: y = 1.
inline Problem scale2() {
  return two_squares("scale2", 1, {.weight = 100}, {}, 0);
}
inline Problem scale4() {
  return two_squares("scale4", 1, {.factor = 100}, {.factor = 100}, 0);
}
inline Problem scale5() {
  return two_squares("scale5", 100, {.weight = 100}, {.weight = 100}, 0);
}

/// B-stationary and M-stationary, not S-stationary.
inline Problem scholtes4() {
  Problem p{"scholtes4", 0, {}};
  const int x = p.nonnegative("z1", 0), y = p.nonnegative("z2", 1), z = p.variable("z3", 0);
  p.minimize(0, {{x, 1}, {y, 1}, {z, -1}});
  p.row("lin1", -kInfinity, 0, 0, {{x, -4}, {z, 1}});
  p.row("lin2", -kInfinity, 0, 0, {{y, -4}, {z, 1}});
  p.pair(x, y);
  return p;
}

inline Problem scholtes5() {
  Problem p{"scholtes5", 1, {}};
  const int x = p.nonnegative("z1", 1), y = p.nonnegative("z2", 1), z = p.nonnegative("z3", 1);
  p.minimize(6, {{x, -2, 1}, {y, -4, 1}, {z, 2, 1}});
  p.pair(x, z);
  p.pair(y, z);
  return p;
}

/// B-stationary and M-stationary, not S-stationary.
inline Problem ralph1() {
  Problem p{"ralph1", 0, {}};
  const int x = p.nonnegative("x", 0), y = p.nonnegative("y", 0);
  p.minimize(0, {{x, 2}, {y, -1}});
  p.pair(y, p.slack("y - x", 0, 0, {{y, 1}, {x, -1}}));
  return p;
}

inline Problem ralph2() {
  Problem p{"ralph2", 0, {}};
  const int x = p.nonnegative("x", 1), y = p.nonnegative("y", 1);
  p.mpcc.nlp.add_block(
      std::make_unique<QuadraticBlock>(-1, std::vector{x, y}, 0, Vector::Zero(2), Matrix{{2, -4}, {-4, 2}}));
  p.pair(x, y);
  return p;
}

inline Problem bard1() {
  Problem p{"bard1", 17, {}};
  const int x = p.nonnegative("x", 0), y = p.nonnegative("y", 0);
  const int l1 = p.nonnegative("l1", 0), l2 = p.nonnegative("l2", 0), l3 = p.nonnegative("l3", 0);
  p.minimize(26, {{x, -10, 1}, {y, 4, 4}});
  p.row("KKT", 0, 0, -2, {{y, 2}, {x, -1.5}, {l1, 1}, {l2, -0.5}, {l3, 1}});
  p.pair(p.slack("lin1", 0, -3, {{x, 3}, {y, -1}}), l1);
  p.pair(p.slack("lin2", 4, 4, {{x, -1}, {y, 0.5}}), l2);
  p.pair(p.slack("lin3", 7, 7, {{x, -1}, {y, -1}}), l3);
  return p;
}

/// min (z1 - 1)^2 + z2^2, or with z1 and z2 exchanged there,  0 <= z2 _|_ z2 - z1 >= 0
inline Problem jiang_ralph(std::string name, bool is_first) {
  Problem p{std::move(name), 0.5, {}};
  const int z1 = p.variable("z1", 0), z2 = p.nonnegative("z2", 0);
  p.minimize(1, {{z1, is_first ? -2.0 : 0.0, 1}, {z2, is_first ? 0.0 : -2.0, 1}});
  p.pair(z2, p.slack("z2 - z1", 0, 0, {{z2, 1}, {z1, -1}}));
  return p;
}
inline Problem jr1() {
  return jiang_ralph("jr1", true);
}
inline Problem jr2() {
  return jiang_ralph("jr2", false);
}

/// min c + terms in z1, z2,  0 <= z1 _|_ z2 >= 0
inline Problem kth(std::string name, double optimum, double z1_0, double z2_0, double c, Term z1, Term z2) {
  Problem p{std::move(name), optimum, {}};
  z1.variable = p.nonnegative("z1", z1_0);
  z2.variable = p.nonnegative("z2", z2_0);
  p.minimize(c, {z1, z2});
  p.pair(z1.variable, z2.variable);
  return p;
}
inline Problem kth1() {
  return kth("kth1", 0, 0, 1, 0, {0, 1}, {0, 1});
}
inline Problem kth2() {
  return kth("kth2", 0, 1, 0, 1, {0, 1}, {0, -2, 1});
}
/// A local minimum with the value 1, too: z1 = 1.
inline Problem kth3() {
  return kth("kth3", 0.5, 1, 1, 1.5, {0, -1, 0.5}, {0, -2, 1});
}

inline Problem gauvin() {
  Problem p{"gauvin", 20, {}};
  const int x = p.variable("x", 7.5, 0, 15), y = p.nonnegative("y", 0), u = p.nonnegative("u", 1);
  p.minimize(100, {{x, 0, 1}, {y, -20, 1}});
  p.pair(p.slack("Fy", 0, -120, {{x, 4}, {y, 8}, {u, 1}}), y);
  p.pair(p.slack("Fu", 12.5, 20, {{x, -1}, {y, -1}}), u);
  return p;
}

inline std::vector<Problem> all() {
  std::vector<Problem> problems;
  for (const auto make : {scholtes1, scholtes2, scholtes3, scholtes4, scholtes5, ralph1, ralph2, bard1, jr1, jr2, kth1,
                          kth2, kth3, gauvin, scale1, scale2, scale4, scale5})
    problems.push_back(make());
  return problems;
}

}  // namespace ricochet::macmpec
