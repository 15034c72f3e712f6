#pragma once

#include <ginac/ginac.h>

/// @file
/// Functions of real symbols that have kinks or jumps. GiNaC treats symbols as complex numbers. Its derivative of |x|
/// is a quotient that is 0/0 at x = 0, the state of every body at rest, and it has none for the sign of x. Here
///
///     d|x|/dx = sign(x), 0 at x = 0;   d sign(x)/dx = 0;   d choose(c, a, b)/dx = choose(c, da/dx, db/dx)        (1)
///
/// are one-sided or mean values where the derivative does not exist. Methods that locate borders never differentiate across
/// them (problems/regions/switching_functions.h); others use the side on which they evaluate.
///
/// In a scene, `sign` and `choose` serve numbers and symbols alike, and so does `using std::abs; abs(x)`.

namespace ricochet {

/// The sign of `x`: -1, 0 or 1.
inline double sign(double x) {
  return static_cast<double>((x > 0) - (x < 0));
}
/// The sign of an expression `x`, with the derivative (1).
GiNaC::ex sign(const GiNaC::ex& x);

/// `a` if `c` > 0, else `b`. For example, max(a, b) is choose(a - b, a, b).
inline double choose(double c, double a, double b) {
  return c > 0 ? a : b;
}
/// choose() for expressions `c`, `a`, `b`, with the derivative (1).
GiNaC::ex choose(const GiNaC::ex& c, const GiNaC::ex& a, const GiNaC::ex& b);

/// |x| of an expression `x`, with the derivative (1). The name differs from `abs`, which is GiNaC's own function.
GiNaC::ex magnitude(const GiNaC::ex& x);
/// |x| of a number `x`.
inline double magnitude(double x) {
  return x < 0 ? -x : x;
}

/// Rewrites the `expression` for real symbols: (1) replaces GiNaC's abs, csgn and step; conjugates and real parts are
/// removed.
GiNaC::ex with_real_symbols(const GiNaC::ex& expression);

/// Whether the `expression` may jump: it contains a `sign` or a `choose` whose two branches differ at the switching
/// point c = 0. Two cases are continuous: c divides the difference of the branches as a polynomial, as in max(a, b)
/// and x sign(x), or the difference vanishes after c = 0 is solved for a symbol, as in max(-x, 0)**1.5.
bool may_jump(const GiNaC::ex& expression);

/// Whether the `expression` contains one of the functions of this file, so that it or its derivative may jump.
bool may_bend(const GiNaC::ex& expression);

}  // namespace ricochet
