#include <array>

#include "reference/certified/series_program.h"

/// Remainders of a SeriesProgram. With alpha_k = |a_k| h^k and t <= h:
///
///     tail(a, b) = sum_{i+j>N} alpha_i beta_j                                                                   (8)
///     low(a) = |a_0| - sum_{k>=1} alpha_k - rho_a <= |a(t)|                                                     (9)
///     a b:      tail(a, b) + |a| rho_b + |b| rho_a + rho_a rho_b,   |a| = sum alpha_k                           (10)
///     c = a/b:  (tail(c, b) + rho_a + |c| rho_b) / low(b)                                                       (11)
///     c = sqrt(a): (tail(c, c) + rho_a) / (sqrt(low(a)) + low_p(c)),   low_p without rho                        (12)
///     F(a):     sum_{k>N} |s_k| h^k + rho_a max |F'|,   s_k those of F(p), p the polynomial of a                (13)
///     |s_k| h^k <= max_{|z| <= sigma h} |F(p(z))| sigma^-k   (Cauchy)                                            (14)
///
/// All roundings are upward, of lower bounds downward.

namespace ricochet::reference::certified {

void SeriesProgram::measure(const std::vector<Node>& schedule, double h) {
  const int N = degree_;
  std::vector<Magnitude> power(N + 1);
  Magnitude length;
  mag_set_d(length.get(), h);
  mag_one(power[0].get());
  for (int k = 1; k <= N; ++k) mag_mul(power[k].get(), power[k - 1].get(), length.get());
  for (const Node i : schedule) {
    Entry& x = nodes_[i];
    x.alpha.resize(N + 1);
    x.suffix.resize(N + 2);
    mag_zero(x.suffix[N + 1].get());
    for (int k = N; k >= 0; --k) {
      const mag_ptr alpha = x.alpha[k].get();
      if (k > 0 && x.op == Op::constant) {
        mag_zero(alpha);
      } else {
        arb_get_mag(alpha, x.c.at(k));
        mag_mul(alpha, alpha, power[k].get());
      }
      mag_add(x.suffix[k].get(), x.suffix[k + 1].get(), alpha);
    }
  }
}

void SeriesProgram::lower_degree(const std::vector<Node>& schedule, int degree) {
  for (const Node i : schedule) {
    Entry& x = nodes_[i];
    mag_add(x.rho.get(), x.rho.get(), x.suffix[degree + 1].get());
    mag_zero(x.suffix[degree + 1].get());
    for (int k = degree; k >= 0; --k) mag_add(x.suffix[k].get(), x.suffix[k + 1].get(), x.alpha[k].get());
  }
  degree_ = degree;
}

void SeriesProgram::tail(Magnitude& r, const Entry& a, const Entry& b) const {
  mag_zero(r.get());
  const int N = degree_;
  for (int i = 1; i <= N; ++i) mag_addmul(r.get(), a.alpha[i].get(), b.suffix[N + 1 - i].get());
}

/// (9), rounded downward. @returns false if it is not positive
bool SeriesProgram::lower_bound(Magnitude& r, const Entry& a) const {
  Magnitude rest;
  arb_get_mag_lower(r.get(), a.c.at(0));
  mag_add(rest.get(), a.suffix[1].get(), a.rho.get());
  mag_sub_lower(r.get(), r.get(), rest.get());
  return !mag_is_zero(r.get());
}

bool SeriesProgram::remainder(Node i) {
  Entry& x = nodes_[i];
  switch (x.op) {
    case Op::constant:
      mag_zero(x.rho.get());
      return true;
    case Op::state:
      return true;
    case Op::add:
    case Op::sub:
      mag_add(x.rho.get(), nodes_[x.a].rho.get(), nodes_[x.b].rho.get());
      return true;
    case Op::neg:
      mag_set(x.rho.get(), nodes_[x.a].rho.get());
      return true;
    case Op::mul: {
      const Entry &a = nodes_[x.a], &b = nodes_[x.b];
      Magnitude sum;
      tail(sum, a, b);
      mag_addmul(sum.get(), a.suffix[0].get(), b.rho.get());
      mag_addmul(sum.get(), b.suffix[0].get(), a.rho.get());
      mag_addmul(sum.get(), a.rho.get(), b.rho.get());
      x.rho = sum;
      return true;
    }
    case Op::div:
      return remainder_of_quotient(x);
    case Op::sqrt:
      return remainder_of_root(x);
    case Op::sin:
    case Op::cos:
    case Op::exp:
    case Op::log:
    case Op::atan:
    case Op::asin:
      return remainder_of_function(x);
  }
  return false;
}

bool SeriesProgram::remainder_of_quotient(Entry& x) {
  const Entry &a = nodes_[x.a], &b = nodes_[x.b];
  Magnitude low, sum;
  if (!lower_bound(low, b)) return false;
  tail(sum, x, b);
  mag_add(sum.get(), sum.get(), a.rho.get());
  mag_addmul(sum.get(), x.suffix[0].get(), b.rho.get());
  mag_div(x.rho.get(), sum.get(), low.get());
  return true;
}

bool SeriesProgram::remainder_of_root(Entry& x) {
  const Entry& a = nodes_[x.a];
  Magnitude low, sum, own;
  if (!arb_is_positive(a.c.at(0)) || !lower_bound(low, a)) return false;
  mag_sqrt_lower(low.get(), low.get());
  arb_get_mag_lower(own.get(), x.c.at(0));
  mag_sub_lower(own.get(), own.get(), x.suffix[1].get());
  if (mag_is_zero(own.get())) return false;  // the polynomial may be negative, (12) then divides by less
  mag_add_lower(low.get(), low.get(), own.get());
  tail(sum, x, x);
  mag_add(sum.get(), sum.get(), a.rho.get());
  mag_div(x.rho.get(), sum.get(), low.get());
  return true;
}

/// Bound of |F'| over all values of the argument, polynomial and function.
bool SeriesProgram::slope_bound(Magnitude& r, const Entry& x) const {
  const Entry& a = nodes_[x.a];
  Magnitude spread;
  mag_add(spread.get(), a.suffix[1].get(), a.rho.get());
  switch (x.op) {
    case Op::exp: {
      Ball argument(a.c.at(0));
      argument.widen(spread.get());
      arb_exp(argument.get(), argument.get(), 53);
      arb_get_mag(r.get(), argument.get());
      return true;
    }
    case Op::log: {
      Magnitude low;
      if (!arb_is_positive(a.c.at(0)) || !lower_bound(low, a)) return false;
      mag_inv(r.get(), low.get());
      return true;
    }
    case Op::asin: {
      Ball argument(a.c.at(0)), one(1.0);
      argument.widen(spread.get());
      arb_sqr(argument.get(), argument.get(), 53);
      arb_sub(argument.get(), one.get(), argument.get(), 53);
      if (!arb_is_positive(argument.get())) return false;
      arb_rsqrt(argument.get(), argument.get(), 53);
      arb_get_mag(r.get(), argument.get());
      return true;
    }
    default:
      mag_one(r.get());
      return true;  // sin, cos, atan
  }
}

/// Bound of |F(z)| over the disc |z - a_0| <= U of complex numbers. @returns false if F may not be analytic there
bool SeriesProgram::disc_bound(Magnitude& r, Op op, const Entry& a, const Magnitude& U) const {
  switch (op) {
    case Op::exp: {
      Ball e;
      arb_exp(e.get(), a.c.at(0), 53);
      mag_exp(r.get(), U.get());
      mag_mul(r.get(), r.get(), Magnitude(e).get());
      return true;
    }
    case Op::log: {  // |log z| <= |log a_0| - log(1 - U / a_0)
      Ball ratio, own, radius;
      arf_set_mag(arb_midref(radius.get()), U.get());
      arb_div(ratio.get(), radius.get(), a.c.at(0), 53);
      arb_sub_ui(ratio.get(), ratio.get(), 1, 53);
      if (!arb_is_positive(a.c.at(0)) || !arb_is_negative(ratio.get())) return false;
      arb_neg(ratio.get(), ratio.get());
      arb_log(ratio.get(), ratio.get(), 53);
      arb_log(own.get(), a.c.at(0), 53);
      mag_add(r.get(), Magnitude(ratio).get(), Magnitude(own).get());
      return true;
    }
    case Op::atan: {  // |1 + z^2| = |z - i| |z + i| >= (sqrt(1 + a_0^2) - U)^2; a disc without i and -i crosses no cut
      Ball distance, radius;
      arf_set_mag(arb_midref(radius.get()), U.get());
      arb_sqr(distance.get(), a.c.at(0), 53);
      arb_add_ui(distance.get(), distance.get(), 1, 53);
      arb_sqrt(distance.get(), distance.get(), 53);
      arb_sub(distance.get(), distance.get(), radius.get(), 53);
      if (!arb_is_positive(distance.get())) return false;
      arb_sqr(distance.get(), distance.get(), 53);
      arb_div(distance.get(), radius.get(), distance.get(), 53);
      arb_add_ui(distance.get(), distance.get(), 2, 53);  // |atan a_0| < 2
      arb_get_mag(r.get(), distance.get());
      return true;
    }
    case Op::asin: {  // the series of asin has positive coefficients: |asin z| <= asin 1 < 2 for |z| <= 1
      Magnitude farthest;
      arb_get_mag(farthest.get(), a.c.at(0));
      mag_add(farthest.get(), farthest.get(), U.get());
      mag_set_ui(r.get(), 2);
      return mag_cmp_2exp_si(farthest.get(), 0) < 0;
    }
    default:
      mag_cosh(r.get(), U.get());
      return true;  // |sin z|, |cos z| <= cosh(Im z)
  }
}

/// (14) for the best of some sigma. A polynomial that is constant has a constant image, without remainder.
bool SeriesProgram::cauchy(Magnitude& r, Op op, const Entry& a) const {
  if (mag_is_zero(a.suffix[1].get())) {
    mag_zero(r.get());
    return true;
  }
  static constexpr std::array kSigma{1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 11.0, 16.0, 32.0, 64.0};
  const int N = degree_;
  mag_inf(r.get());
  for (const double sigma : kSigma) {
    Magnitude s, power, U, bound, divisor;
    mag_set_d(s.get(), sigma);
    mag_one(power.get());
    for (int k = 1; k <= N; ++k) {
      mag_mul(power.get(), power.get(), s.get());
      mag_addmul(U.get(), power.get(), a.alpha[k].get());
    }
    if (mag_cmp_2exp_si(U.get(), 12) > 0 || !disc_bound(bound, op, a, U)) break;
    mag_set_d_lower(divisor.get(), sigma);
    mag_pow_ui_lower(divisor.get(), divisor.get(), static_cast<ulong>(N + 1));
    mag_div(bound.get(), bound.get(), divisor.get());
    mag_set_d(divisor.get(), sigma / (sigma - 1) * (1 + 1e-12));  // sum of sigma^-k over k >= 0, above the rounding
    mag_mul(bound.get(), bound.get(), divisor.get());
    if (mag_cmp(bound.get(), r.get()) < 0) r = bound;
  }
  return !mag_is_inf(r.get());
}

bool SeriesProgram::remainder_of_function(Entry& x) {
  const Entry& a = nodes_[x.a];
  Magnitude sum, slope;
  if (!cauchy(sum, x.op, a) || !slope_bound(slope, x)) return false;
  mag_addmul(sum.get(), a.rho.get(), slope.get());
  x.rho = sum;
  return true;
}

}  // namespace ricochet::reference::certified
