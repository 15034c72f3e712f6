#include "problems/derivatives/real_functions.h"

#include <algorithm>
#include <exception>
#include <map>
#include <string>

namespace ricochet {
namespace {

using GiNaC::ex;
using GiNaC::symbol;

bool is_number(const ex& x) {
  return GiNaC::is_a<GiNaC::numeric>(x);
}

// Registration with GiNaC: a new name, the evaluation of a call, and its derivative.

DECLARE_FUNCTION_1P(real_abs)
DECLARE_FUNCTION_1P(real_sign)
DECLARE_FUNCTION_3P(real_choose)

ex abs_of(const ex& x) {
  return is_number(x) ? ex(GiNaC::abs(GiNaC::ex_to<GiNaC::numeric>(x))) : real_abs(x).hold();
}
ex abs_derivative(const ex& x, const symbol& s) {
  return real_sign(x) * x.diff(s);
}

ex sign_of(const ex& x) {
  return is_number(x) ? ex(GiNaC::csgn(GiNaC::ex_to<GiNaC::numeric>(x))) : real_sign(x).hold();
}
ex sign_derivative(const ex&, const symbol&) {
  return 0;
}

ex choice_of(const ex& c, const ex& a, const ex& b) {
  if (a.is_equal(b)) return a;
  if (is_number(c)) return GiNaC::ex_to<GiNaC::numeric>(c).is_positive() ? a : b;
  return real_choose(c, a, b).hold();
}
ex choice_derivative(const ex& c, const ex& a, const ex& b, const symbol& s) {
  return real_choose(c, a.diff(s), b.diff(s));
}

REGISTER_FUNCTION(real_abs, set_name("magnitude").eval_func(abs_of).expl_derivative_func(abs_derivative))
REGISTER_FUNCTION(real_sign, set_name("sign").eval_func(sign_of).expl_derivative_func(sign_derivative))
REGISTER_FUNCTION(real_choose, set_name("choose").eval_func(choice_of).expl_derivative_func(choice_derivative))

/// Replaces GiNaC's functions of complex symbols.
struct RealSymbols : GiNaC::map_function {
  ex operator()(const ex& e) override {
    const ex inner = e.map(*this);
    if (!GiNaC::is_a<GiNaC::function>(inner)) return inner;
    const std::string name = GiNaC::ex_to<GiNaC::function>(inner).get_name();
    if (name == "abs") return real_abs(inner.op(0));
    if (name == "csgn") return real_sign(inner.op(0));
    if (name == "step") return real_choose(inner.op(0), 1, 0);
    if (name == "conjugate" || name == "real_part") return inner.op(0);
    if (name == "imag_part") return 0;
    return inner;
  }
};

}  // namespace

ex sign(const ex& x) {
  return real_sign(x);
}

ex choose(const ex& c, const ex& a, const ex& b) {
  return real_choose(c, a, b);
}

ex magnitude(const ex& x) {
  return real_abs(x);
}

namespace {

/// Whether a difference of branches vanishes at c = 0. Two proofs are tried. Either c divides the numerator of the
/// difference as a polynomial in symbols and functions; or c is linear in a symbol or function x, c = A x + B, and the
/// difference is 0 at x = -B / A and where a common factor of A and B is 0.
bool vanishes_where(const ex& c, const ex& difference) {
  try {
    GiNaC::exmap kernels;
    const ex fraction = difference.to_rational(kernels).normal();
    ex quotient;
    if (fraction.is_zero() || GiNaC::divide(fraction.numer().expand(), c.to_rational(kernels).expand(), quotient))
      return true;
  } catch (const std::exception&) {  // no polynomials
  }
  for (auto part = c.preorder_begin(); part != c.preorder_end(); ++part) {
    if (!GiNaC::is_a<symbol>(*part) && !GiNaC::is_a<GiNaC::function>(*part)) continue;
    try {
      const symbol x;
      const ex of_x = c.subs(*part == x).expand();
      if (!of_x.is_polynomial(x) || of_x.degree(x) != 1) continue;
      const ex A = of_x.coeff(x, 1), B = of_x.coeff(x, 0), common = GiNaC::gcd(A, B);
      if (!is_number(common) && !vanishes_where(common, difference)) continue;
      const ex zero = -B / A;
      if (difference.subs(*part == x).subs(x == zero).normal().is_zero()) return true;
    } catch (const std::exception&) {  // a pole at the zero, or no polynomial
    }
  }
  return false;
}

}  // namespace

bool may_jump(const ex& expression) {
  for (auto part = expression.preorder_begin(); part != expression.preorder_end(); ++part) {
    if (!GiNaC::is_a<GiNaC::function>(*part)) continue;
    const std::string name = GiNaC::ex_to<GiNaC::function>(*part).get_name();
    if (name != "sign" && name != "choose") continue;
    const bool is_sign = name == "sign";
    const ex above = is_sign ? ex(1) : part->op(1), below = is_sign ? ex(-1) : part->op(2);
    const ex difference = expression.subs(*part == above) - expression.subs(*part == below);
    if (!vanishes_where(part->op(0), difference)) return true;
  }
  return false;
}

bool may_bend(const ex& expression) {
  return std::any_of(expression.preorder_begin(), expression.preorder_end(), [](const ex& part) {
    if (!GiNaC::is_a<GiNaC::function>(part)) return false;
    const std::string name = GiNaC::ex_to<GiNaC::function>(part).get_name();
    return name == "magnitude" || name == "sign" || name == "choose";
  });
}

ex with_real_symbols(const ex& expression) {
  return RealSymbols()(expression);
}

}  // namespace ricochet
