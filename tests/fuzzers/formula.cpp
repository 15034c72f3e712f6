#include "problems/derivatives/straight_line_program.h"
#include "problems/input_error.h"
#include "problems/scene_file/expression.h"
#include "problems/scene_file/expression_text.h"
#include "tests/fuzzers/targets.h"

namespace ricochet::fuzzing {

/// A formula in two coordinates, a parameter and the time, with its derivative, its value and its text.
void formula(const std::string& text) {
  static const std::vector<GiNaC::symbol> q{GiNaC::symbol("q[0]"), GiNaC::symbol("q[1]")};
  static const GiNaC::symbol m("m"), t("t");
  static const ExpressionNames names{{{"m", m}, {"t", t}}, {{"q", q}}};
  try {
    const GiNaC::ex formula = parse_expression(text, names, "f");
    const StraightLineProgram program({formula, formula.diff(q[0])}, {q}, {{m, 2.5}, {t, 0.25}});
    const double at[2]{0.5, -1.5};
    double values[2];
    const double* input = at;
    program.evaluate({&input, 1}, values);
    expression_text(formula);
  } catch (const InputError&) {
  }
}

}  // namespace ricochet::fuzzing
