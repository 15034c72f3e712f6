#pragma once

#include <ginac/ginac.h>

/// @file
/// Functions of real symbols that bend or jump. GiNaC takes symbols as complex: it differentiates |x| to a quotient that
/// is 0/0 at x = 0, where every body at rest is, and the sign of x not at all. Here
///
///     d|x|/dx = sign(x), 0 at x = 0;   d sign(x)/dx = 0;   d choose(c, a, b)/dx = choose(c, da/dx, db/dx)        (1)
///
/// as one-sided or mean values where the left side does not exist. The points where these functions jump have measure
/// zero, and nothing marks them: a time step across one sees the derivative of the side it looks from. Newton's methods
/// go on; the order of a method is that of the smoothness there, 1 across a jump of the force, 2 across a kink.
///
/// In a scene, `sign` and `choose` serve numbers and symbols alike, and so does `using std::abs; abs(x)`.

namespace ricochet {

/// The sign of `x`: -1, 0 or 1.
inline double sign(double x) {
  return static_cast<double>((x > 0) - (x < 0));
}
/// The same of an expression `x`, with the derivative (1).
GiNaC::ex sign(const GiNaC::ex& x);

/// `a` where `c` > 0, else `b`: max(a, b) is choose(a - b, a, b).
inline double choose(double c, double a, double b) {
  return c > 0 ? a : b;
}
/// The same of expressions `c`, `a`, `b`, with the derivative (1).
GiNaC::ex choose(const GiNaC::ex& c, const GiNaC::ex& a, const GiNaC::ex& b);

/// |x| of an expression `x`, with the derivative (1); its name is `magnitude`, GiNaC's own function being `abs`.
GiNaC::ex magnitude(const GiNaC::ex& x);
/// The same of a number `x`.
inline double magnitude(double x) {
  return x < 0 ? -x : x;
}

/// The `expression` for real symbols: with (1) in place of GiNaC's abs, csgn and step, and without conjugates and real
/// parts.
GiNaC::ex with_real_symbols(const GiNaC::ex& expression);

/// Whether the `expression` may jump: it contains a `sign` or a `choose` at whose switching point c = 0 its two branches
/// differ. They are proven to agree where c divides their difference as a polynomial of its symbols and functions, as in
/// max(a, b) and x sign(x), or where the difference vanishes when c = 0 is solved for one of them, as in max(-x, 0)**1.5.
bool may_jump(const GiNaC::ex& expression);

}  // namespace ricochet
