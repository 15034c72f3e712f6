#include "problems/scene_file/expression.h"

#include <gtest/gtest.h>

#include <cmath>

#include "problems/derivatives/real_functions.h"
#include "problems/derivatives/straight_line_program.h"
#include "problems/input_error.h"
#include "problems/scene_file/expression_text.h"

namespace ricochet {
namespace {

class Expression : public testing::Test {
 protected:
  GiNaC::symbol m{"m"}, q0{"q[0]"}, q1{"q[1]"};
  ExpressionNames names{{{"m", m}}, {{"q", {q0, q1}}}};

  double value(const std::string& text) {
    const StraightLineProgram program({parse_expression(text, names, "field")}, {{q0, q1}}, {{m, 2.0}});
    const double q[2] = {0.3, -1.7};
    const double* inputs[] = {q};
    double result = 0;
    program.evaluate(inputs, &result);
    return result;
  }

  /// The message without the picture below it.
  std::string error(const std::string& text) {
    try {
      parse_expression(text, names, "field");
    } catch (const InputError& e) {
      const std::string message = e.what();
      return message.substr(0, message.find('\n'));
    }
    return "no error";
  }
};

TEST_F(Expression, FollowsPythonsPrecedence) {
  const double a = 0.3, b = -1.7, mass = 2.0;
  EXPECT_DOUBLE_EQ(value("-m**2"), -4);
  EXPECT_DOUBLE_EQ(value("2**-1"), 0.5);
  EXPECT_DOUBLE_EQ(value("2**3**2"), 512) << "powers group from the right";
  EXPECT_DOUBLE_EQ(value("q[0]**-2*q[1]"), b / (a * a)) << "a power binds tighter than the product after it";
  EXPECT_DOUBLE_EQ(value("8/4/2"), 1) << "quotients group from the left";
  EXPECT_DOUBLE_EQ(value("1-2-3"), -4);
  EXPECT_DOUBLE_EQ(value("m - -q[0]"), mass + a);
  EXPECT_DOUBLE_EQ(value("m*-q[0]"), -mass * a);
  EXPECT_DOUBLE_EQ(value(" ( m + 1 ) * q [ 1 ] "), 3 * b);
  EXPECT_DOUBLE_EQ(value("1.5e-3*m + .5 + 2."), 1.5e-3 * mass + 2.5);
  EXPECT_DOUBLE_EQ(value("+m"), mass);
}

TEST_F(Expression, KnowsTheFunctions) {
  const double a = 0.3, b = -1.7;
  EXPECT_DOUBLE_EQ(value("sin(q[0])*cos(q[1])"), std::sin(a) * std::cos(b));
  EXPECT_DOUBLE_EQ(value("sqrt(q[0]*q[0]+q[1]*q[1])"), std::sqrt(a * a + b * b));
  EXPECT_DOUBLE_EQ(value("atan2(q[1], q[0])"), std::atan2(b, a));
  EXPECT_DOUBLE_EQ(value("exp(q[0])+log(m)+tanh(q[1])+abs(q[1])"),
                   std::exp(a) + std::log(2.0) + std::tanh(b) + std::abs(b));
  EXPECT_DOUBLE_EQ(value("2*pi"), 2 * M_PI);
}

TEST_F(Expression, Chooses) {
  const double a = 0.3, b = -1.7;
  EXPECT_EQ(value("max(q[0], q[1])"), a);
  EXPECT_EQ(value("min(q[0], q[1])"), b);
  EXPECT_EQ(value("sign(q[1]) + 10*sign(q[0]) + 100*sign(q[0]-q[0])"), 9);
  EXPECT_EQ(value("if(q[0] < q[1], 1, 2)"), 2);
  EXPECT_EQ(value("if(q[0] > q[1], 1, 2)"), 1);
  EXPECT_EQ(value("if(q[0] <= 0.3, 1, 2) + if(q[0] >= 0.3, 10, 20)"), 11) << "0.3 is the double that the program has";
  EXPECT_EQ(value("if(q[0] < 0.3, 1, 2) + if(q[0] > 0.3, 10, 20)"), 22);
  EXPECT_EQ(value("if(1 < 2, 3, 4)"), 3);
  EXPECT_DOUBLE_EQ(value("if(q[1] > 0, sqrt(q[1]), -q[1])"), 1.7) << "the other branch is not a number";
  EXPECT_EQ(error("if(q[0], 1, 2)"), "field, column 8: a condition is expected, two expressions with <, <=, > or >=");
  EXPECT_EQ(error("if(q[0] < 1, 2)"), "field, column 15: ',' is expected: if(condition, a, b)");
  EXPECT_EQ(error("max(1)"), "field, column 1: max takes 2 argument(s), not 1");
}

TEST_F(Expression, BendsWithRealDerivatives) {
  const auto derivative = [&](const std::string& text) { return parse_expression(text, names, "field").diff(q0); };
  const auto at = [&](const GiNaC::ex& e, double x) {
    const StraightLineProgram program({e}, {{q0, q1}}, {{m, 2.0}});
    const double q[2] = {x, -1.7};
    const double* inputs[] = {q};
    double result = 0;
    program.evaluate(inputs, &result);
    return result;
  };
  for (const double x : {-0.7, 0.0, 0.4}) {
    EXPECT_EQ(at(derivative("abs(q[0])"), x), (x > 0) - (x < 0));
    EXPECT_DOUBLE_EQ(at(derivative("-m*q[0]*abs(q[0])"), x), -4 * std::abs(x)) << "quadratic drag, at rest too";
    EXPECT_DOUBLE_EQ(at(derivative("-m*q[0]*abs(q[0])").diff(q0), x), -4.0 * ((x > 0) - (x < 0)));
    EXPECT_EQ(at(derivative("max(0, q[0])**2/2"), x), std::max(0.0, x));
    EXPECT_EQ(at(derivative("if(q[0] < 0.1, q[0], q[0]**2)"), x), x < 0.1 ? 1 : 2 * x);
  }
}

TEST_F(Expression, IsWrittenAsItIsRead) {
  for (const char* text : {"m",
                           "-m",
                           "-3/4*q[0]",
                           "0.1*q[0]-1e-9",
                           "-(q[0]-q[1])**2/m",
                           "(-q[0])**m",
                           "2**(-q[0]-m)",
                           "(1/2)**q[0]",
                           "1/(q[0]*m)**3",
                           "m/(q[0]/q[1])",
                           "1/(q[0]-q[1])",
                           "sqrt(-q[0]+m)",
                           "(q[0]-q[1])**(3/2)",
                           "q[0]**(-1/2)",
                           "(q[0]**2)**m",
                           "-q[0]*(-m-q[1])",
                           "1-(m-(q[0]-2*q[1]))*m",
                           "sin(-q[0]-m)*cos(q[1]-q[0])",
                           "pi*m**-pi",
                           "atan2(-q[0], q[1]-m)",
                           "abs(-q[0])+exp(-q[1])+log(m)",
                           "-3*q[0]*abs(q[0])-sign(q[1]-m)",
                           "max(q[0], m*q[1])+min(0, q[1])",
                           "if(q[0]+q[1] < m, if(q[1] >= 2, -q[0], 1), q[0]**2)-if(m > q[0], 1, 2)"}) {
    const GiNaC::ex expression = parse_expression(text, names, "field");
    const std::string written = expression_text(expression);
    EXPECT_TRUE(parse_expression(written, names, "field").is_equal(expression)) << text << " -> " << written;
  }
  EXPECT_EQ(expression_text(parse_expression("q[1]*-m + 3/4*q[0]**2 - 1", names, "field")), "-1+3*q[0]**2/4-m*q[1]");
  EXPECT_EQ(expression_text((q1 - q0) * m), expression_text(-m * (q0 - q1)));
  EXPECT_EQ(expression_text(magnitude(q0).diff(q0)), "sign(q[0])");
  EXPECT_THROW(expression_text(GiNaC::tgamma(q0)), InputError) << "the grammar has no gamma function";
}

TEST_F(Expression, ErrorsNameTheColumn) {
  EXPECT_EQ(error("m+kk"), "field, column 3: unknown name 'kk'; known are m, q[i], pi and the functions");
  EXPECT_EQ(error("m+"), "field, column 3: a number, a name or '(' is expected");
  EXPECT_EQ(error(""), "field, column 1: a number, a name or '(' is expected");
  EXPECT_EQ(error("q[2]"), "field, column 1: index out of range, q has 2 entries");
  EXPECT_EQ(error("q[-1]"), "field, column 3: a whole number is expected as index");
  EXPECT_EQ(error("w[0]"), "field, column 1: unknown name 'w'; known are m, q[i], pi and the functions");
  EXPECT_EQ(error("m[0]"), "field, column 1: 'm' is a number and has no entries");
  EXPECT_EQ(error("2*q"), "field, column 3: 'q' has 2 entries; write q[0] for the first");
  EXPECT_EQ(error("2*(q[0]"), "field, column 8: ')' is expected");
  EXPECT_EQ(error("sin(q[0],m)"), "field, column 1: sin takes 1 argument(s), not 2");
  EXPECT_EQ(error("m q[0]"), "field, column 3: an operator or the end of the expression is expected");
  EXPECT_TRUE(error("sinn(m)").starts_with("field, column 1: unknown function 'sinn'; known are abs"));
  for (const char* power : {"0**m", "(0*q[0])**q[1]", "1+(-2)**m"})
    EXPECT_TRUE(error(power).ends_with("a base above zero is required where the exponent is no number")) << power;
  EXPECT_TRUE(error("1/0").starts_with("field, column 2: ")) << error("1/0");
}

TEST_F(Expression, OperatorsOfOtherLanguagesAreNamedWithWhatToWrite) {
  const std::string both = "' is not possible here; nest if: if(c, if(d, x, y), y) is x where c and d hold";
  const std::string either = "' is not possible here; nest if: if(c, x, if(d, x, y)) is x where c or d holds";
  const std::string comparison = "' is not possible here; conditions compare with <, <=, > or >=";
  const std::string negation =
      "' is not possible here; exchange the branches of if: if(c, y, x) is x where c does not hold";
  EXPECT_EQ(error("m^2"), "field, column 2: '^' is not possible here; write a**b for a power");
  EXPECT_EQ(error("if(m^2 < 1, 1, 2)"), "field, column 5: '^' is not possible here; write a**b for a power");
  EXPECT_EQ(error("if(m < 1 and m > 0, 1, 2)"), "field, column 10: 'and" + both);
  EXPECT_EQ(error("if(m < 1 && m > 0, 1, 2)"), "field, column 10: '&&" + both);
  EXPECT_EQ(error("if(m < 1 or m > 2, 1, 2)"), "field, column 10: 'or" + either);
  EXPECT_EQ(error("if(m < 1 || m > 2, 1, 2)"), "field, column 10: '||" + either);
  EXPECT_EQ(error("if(m == 1, 1, 2)"), "field, column 6: '==" + comparison);
  EXPECT_EQ(error("if(m != 1, 1, 2)"), "field, column 6: '!=" + comparison);
  EXPECT_EQ(error("if(m = 1, 1, 2)"), "field, column 6: '=" + comparison);
  EXPECT_EQ(error("if(!m, 1, 2)"), "field, column 4: '!" + negation);
  EXPECT_EQ(error("if(not m < 1, 1, 2)"), "field, column 4: 'not" + negation);
  EXPECT_EQ(error("if(not(m), 1, 2)"), "field, column 4: 'not" + negation);
  EXPECT_EQ(error("m < 1"),
            "field, column 3: '<' is not possible here; comparisons stand in if alone: if(a < b, x, y)");
  EXPECT_EQ(error("m ? 1 : 2"), "field, column 3: '?' is not possible here; write if(condition, a, b)");
  EXPECT_EQ(error("if(m, 1, 2)"), "field, column 5: a condition is expected, two expressions with <, <=, > or >=");
}

TEST_F(Expression, ANameOfAnotherFieldIsRefusedWithTheReason) {
  EXPECT_EQ(
      error("1+t"),
      "field, column 3: 't' is not allowed here: this field may depend on q only; allowed are m, q[i], pi and the "
      "functions");
  names = {{{"g", m}}, {}};
  EXPECT_EQ(
      error("if(q[0]<1, 1, 2)"),
      "field, column 4: 'q' is not allowed here: this field is a constant of the motion, a formula of parameters; "
      "allowed are g, pi and the functions");
  names = {};
  EXPECT_EQ(error("x"), "field, column 1: unknown name 'x'; known are pi and the functions");
}

TEST_F(Expression, DeepNestingIsAnErrorNotACrash) {
  EXPECT_NE(error(std::string(50000, '(')).find("nesting depth"), std::string::npos);
  EXPECT_NE(error(std::string(50000, '-') + "m").find("nesting depth"), std::string::npos);
}

TEST_F(Expression, ErrorShowsThePlace) {
  try {
    parse_expression("m+kk*2", names, "scene.json: f[0]");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("\n  m+kk*2\n    ^"), std::string::npos) << e.what();
  }
}

TEST_F(Expression, TellsJumpsFromBends) {
  names.scalars["t"] = GiNaC::symbol("t");
  for (const char* continuous : {"m",
                                 "max(q[0], m)",
                                 "min(q[0], q[1])",
                                 "abs(q[0])",
                                 "q[0]*sign(q[0])",
                                 "q[0]*abs(q[0])",
                                 "q[0]**2*sign(q[0])+3",
                                 "sign(q[0])**2",
                                 "sign(q[0])*abs(q[0])",
                                 "sign(q[0])*sin(q[0])",
                                 "max(-q[0], 0)**1.5",
                                 "-m*max(m-q[0]*q[1], 0)**(3/2)",
                                 "max(sin(m*t), 0)",
                                 "max(sin(t), 0)**1.5",
                                 "max(q[0], max(q[1], m))",
                                 "min(max(q[0], -m), m)",
                                 "abs(abs(q[0])-m)",
                                 "if(q[0] < m, q[0], m)",
                                 "if(q[0] < 0, m*q[0], 2*q[0])",
                                 "if(t < 1, t, 2-t)",
                                 "if(t < 1, sin(pi*t), 0)",
                                 "if(t < m, q[0]*t, q[0]*m)",
                                 "if(t < 1, m, m)",
                                 "if(t < 1, t, if(t < 2, 1, 3-t))",
                                 "if(q[0] < 1, if(q[1] < 0, q[1], 2*q[1])*(q[0]-1), 0)"})
    EXPECT_FALSE(may_jump(parse_expression(continuous, names, "field"))) << continuous;
  for (const char* jump : {"sign(q[0])", "-m*sign(q[0]-q[1])", "q[1]*sign(q[0])", "q[1]*sign(q[0]*q[1])",
                           "cos(q[0])*sign(q[0])", "if(t < 1, 1, -1)", "if(t < 1, t, 3-t)", "if(q[0] < 0, 0, m)",
                           "if(q[0]+q[0]**2 > 0, q[0]/(q[0]+q[0]**2), 0)", "max(q[0], if(t < 1, 0, 1))",
                           "if(t < 1, t, if(t < 2, 1, 2-t))", "if(q[0] < 1, if(q[1] < 0, 1, 2)*(q[0]-1), 0)"})
    EXPECT_TRUE(may_jump(parse_expression(jump, names, "field"))) << jump;
}

TEST(StraightLineProgram, ComputesEqualSubexpressionsOnce) {
  const GiNaC::symbol x("x"), y("y");
  const GiNaC::ex shared = sin(x + y);
  const StraightLineProgram program({shared * shared, shared + x, cos(x + y)}, {{x, y}}, {});
  EXPECT_EQ(program.n_operations(), 5) << "x + y, sin, square, sum, cos";
}

TEST(StraightLineProgram, FoldsConstants) {
  const GiNaC::symbol x("x"), k("k");
  EXPECT_TRUE(StraightLineProgram({k * 2 + 1}, {{x}}, {{k, 3}}).is_constant());
  EXPECT_EQ(StraightLineProgram({k * 2 + 1, sqrt(k)}, {{x}}, {{k, 3}}).n_operations(), 0);
  EXPECT_FALSE(StraightLineProgram({k * x}, {{x}}, {{k, 3}}).is_constant());
}

TEST(StraightLineProgram, RoundsTheSameHoweverTheSignsAreWritten) {
  // GiNaC turns k (y - x - l) into -k (x + l - y) or not, depending on memory addresses: both must round alike.
  const GiNaC::symbol x("x"), y("y"), l("l"), k("k");
  const StraightLineProgram program(
      {k * (y - x - l), -k * (x + l - y), (y - x - l) / k, pow(y - x - l, 3), -pow(x + l - y, 3)}, {{x, y, l, k}}, {});
  const double input[] = {0.1, 0.7, 0.3, 3.3};
  const double* inputs[] = {input};
  double out[5];
  program.evaluate(inputs, out);
  EXPECT_EQ(out[0], out[1]);
  EXPECT_EQ(out[3], out[4]);
  EXPECT_LE(program.n_operations(), 6 + 3) << "they are one value, computed once, with up to three changes of sign";
}

}  // namespace
}  // namespace ricochet
