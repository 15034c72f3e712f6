#include "reference/certified/ball.h"

#include <fmt/format.h>
#include <ginac/ginac.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>

namespace ricochet::reference::certified {
namespace {

constexpr double kLog10Of2 = 0.30102999566398120;

/// A whole number of GiNaC.
Ball whole(const GiNaC::numeric& number) {
  std::ostringstream text;
  text << number;
  fmpz_t integer;
  fmpz_init(integer);
  fmpz_set_str(integer, text.str().c_str(), 10);
  Ball ball;
  arb_set_fmpz(ball.get(), integer);
  fmpz_clear(integer);
  return ball;
}

}  // namespace

Sign Ball::sign() const {
  if (arb_is_positive(ball_)) return Sign::positive;
  return arb_is_negative(ball_) ? Sign::negative : Sign::unknown;
}

Ball Ball::midpoint() const {
  Ball result;
  arf_set(arb_midref(result.ball_), arb_midref(ball_));
  return result;
}

double Ball::nearest() const {
  return arf_get_d(arb_midref(ball_), ARF_RND_NEAR);
}

double Ball::log10_radius() const {
  if (mag_is_zero(arb_radref(ball_))) return -1e9;
  if (mag_is_inf(arb_radref(ball_)) || !arb_is_finite(ball_)) return 1e9;
  return mag_get_d_log2_approx(arb_radref(ball_)) * kLog10Of2 + 1e-4;
}

double Magnitude::upper() const {
  if (mag_is_inf(mag_) || mag_cmp_2exp_si(mag_, 1000) > 0) return std::numeric_limits<double>::infinity();
  if (mag_is_zero(mag_)) return 0;
  if (mag_cmp_2exp_si(mag_, -1000) < 0) return std::ldexp(1.0, -1000);
  return mag_get_d(mag_);  // exact: a mantissa of 30 bits
}

Ball Precision::add(const Ball& a, const Ball& b) const {
  Ball r;
  arb_add(r.get(), a.get(), b.get(), bits);
  return r;
}

Ball Precision::sub(const Ball& a, const Ball& b) const {
  Ball r;
  arb_sub(r.get(), a.get(), b.get(), bits);
  return r;
}

Ball Precision::mul(const Ball& a, const Ball& b) const {
  Ball r;
  arb_mul(r.get(), a.get(), b.get(), bits);
  return r;
}

Ball Precision::div(const Ball& a, const Ball& b) const {
  Ball r;
  arb_div(r.get(), a.get(), b.get(), bits);
  return r;
}

Ball Precision::hull(const Ball& a, const Ball& b) const {
  Ball r;
  arb_union(r.get(), a.get(), b.get(), bits);
  return r;
}

Ball Precision::ball(const GiNaC::numeric& number) const {
  return div(whole(number.numer()), whole(number.denom()));
}

Ball upper_bound(const Ball& x, slong bits) {
  Ball bound;
  arb_get_ubound_arf(arb_midref(bound.get()), x.get(), bits);
  return bound;
}

Ball least_size(const Ball& x, slong bits) {
  Ball least;
  arb_get_abs_lbound_arf(arb_midref(least.get()), x.get(), bits);
  return least;
}

Ball greatest_size(const Ball& x, slong bits) {
  Ball most;
  arb_get_abs_ubound_arf(arb_midref(most.get()), x.get(), bits);
  return most;
}

Ball square_root(const Ball& x, slong bits) {
  Ball root;
  arb_sqrt(root.get(), x.get(), bits);
  return root;
}

Decimal decimal(const Ball& ball, int digits) {
  Decimal result;
  char* const text = arb_get_str(ball.get(), digits, ARB_STR_NO_RADIUS);
  result.text = text;
  flint_free(text);
  if (!arb_is_finite(ball.get())) return {"nan", std::numeric_limits<double>::infinity(), -999};
  if (result.text.find("+/-") != std::string::npos) result.text = "0";  // no digit is proven
  constexpr slong kExact = 20000;  // bits: decimal texts of a few thousand digits are read almost exactly
  Ball read, difference;
  arb_set_str(read.get(), result.text.c_str(), kExact);
  arb_sub(difference.get(), ball.get(), read.get(), kExact);
  const Magnitude distance(difference);
  result.radius = distance.upper();
  result.decimals = mag_is_zero(distance.get())
                        ? 999
                        : static_cast<int>(std::floor(-mag_get_d_log2_approx(distance.get()) * kLog10Of2 - 1e-3));
  return result;
}

GiNaC::numeric exact_value(double value) {
  int exponent = 0;
  const double mantissa = std::ldexp(std::frexp(value, &exponent), 53);
  return GiNaC::numeric(static_cast<long>(mantissa)) * GiNaC::numeric(2).power(GiNaC::numeric(exponent - 53));
}

GiNaC::numeric shortest_decimal(double value) {
  const std::string text = fmt::format("{}", value);  // the shortest digits, with or without an exponent
  const auto e = text.find('e');
  std::string digits = text.substr(0, e);
  int exponent = e == std::string::npos ? 0 : std::atoi(text.c_str() + e + 1);
  if (const auto point = digits.find('.'); point != std::string::npos) {
    exponent -= static_cast<int>(digits.size() - point - 1);
    digits.erase(point, 1);
  }
  return GiNaC::numeric(digits.c_str()) * GiNaC::numeric(10).power(GiNaC::numeric(exponent));
}

}  // namespace ricochet::reference::certified
