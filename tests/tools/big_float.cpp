#include "tests/tools/big_float.h"

#include <cmath>

namespace ricochet::arbiter {

void BigFloat::normalise() {
  if (cln::zerop(m_)) {
    e_ = 0;
    return;
  }
  const cln::cl_I shift = cln::float_exponent(m_);
  m_ = cln::scale_float(m_, -shift);
  e_ = e_ + shift;
}

BigFloat BigFloat::operator-() const {
  BigFloat result = *this;
  result.m_ = -m_;
  return result;
}

BigFloat& BigFloat::operator+=(const BigFloat& other) {
  if (other.is_zero()) return *this;
  if (is_zero()) return *this = other;
  const cln::cl_I difference = e_ - other.e_;
  static const cln::cl_I beyond = cln::cl_I(4 * kDigits);  // more bits than m has
  if (difference > beyond) return *this;
  if (-difference > beyond) return *this = other;
  m_ = m_ + cln::scale_float(other.m_, -difference);
  normalise();
  return *this;
}

BigFloat& BigFloat::operator*=(const BigFloat& other) {
  m_ = m_ * other.m_;
  e_ = e_ + other.e_;
  normalise();
  return *this;
}

BigFloat& BigFloat::operator/=(const BigFloat& other) {
  m_ = m_ / other.m_;
  e_ = e_ - other.e_;
  normalise();
  return *this;
}

BigFloat sqrt(const BigFloat& x) {
  if (x.is_zero()) return x;
  const bool is_odd = cln::oddp(x.e_);
  return {cln::sqrt(is_odd ? cln::scale_float(x.m_, cln::cl_I(-1)) : x.m_),
          cln::exquo(is_odd ? x.e_ + 1 : x.e_, cln::cl_I(2))};
}

double BigFloat::to_double() const {
  if (is_zero() || e_ < cln::cl_I(-1000)) return 0;
  return std::ldexp(cln::double_approx(m_), cln::cl_I_to_int(e_));
}

BigFloat BigFloat::power_of_ten(int n) {
  const BigFloat positive(cln::cl_R(cln::expt_pos(cln::cl_I(10), cln::cl_I(n < 0 ? -n : n))));
  return n < 0 ? BigFloat(1) / positive : positive;
}

}  // namespace ricochet::arbiter
