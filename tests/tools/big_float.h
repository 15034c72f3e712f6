#pragma once

#include <cln/cln.h>

#include <string>
#include <vector>

namespace ricochet::arbiter {

/// A real number with a given number of digits and an exponent without bound: m 2^e, 1/2 <= |m| < 1, or 0.
///
/// In an inelastic collapse a gap may be squared by each impact: after 130 impacts it is 10^(-10^39), which no exponent
/// of a machine word holds, and yet the velocities are what they are because it is not zero.
class BigFloat {
 public:
  static constexpr int kDigits = 100;  ///< decimal, of m

  BigFloat() : BigFloat(0) {}
  BigFloat(int x) : BigFloat(cln::cl_R(x)) {}  // NOLINT: numbers are written as they are
  explicit BigFloat(const cln::cl_R& x) : BigFloat(cln::cl_float(x, cln::float_format(kDigits)), 0) {}

  bool is_zero() const { return cln::zerop(m_); }
  int sign() const { return is_zero() ? 0 : cln::minusp(m_) ? -1 : 1; }

  BigFloat operator-() const;
  BigFloat& operator+=(const BigFloat& other);
  BigFloat& operator-=(const BigFloat& other) { return *this += -other; }
  BigFloat& operator*=(const BigFloat& other);
  BigFloat& operator/=(const BigFloat& other);  ///< @throws cln::division_by_0_exception

  friend BigFloat operator+(BigFloat a, const BigFloat& b) { return a += b; }
  friend BigFloat operator-(BigFloat a, const BigFloat& b) { return a -= b; }
  friend BigFloat operator*(BigFloat a, const BigFloat& b) { return a *= b; }
  friend BigFloat operator/(BigFloat a, const BigFloat& b) { return a /= b; }
  friend bool operator<(const BigFloat& a, const BigFloat& b) { return (a - b).sign() < 0; }
  friend bool operator>(const BigFloat& a, const BigFloat& b) { return b < a; }
  friend bool operator<=(const BigFloat& a, const BigFloat& b) { return !(b < a); }
  friend bool operator>=(const BigFloat& a, const BigFloat& b) { return !(a < b); }

  friend BigFloat abs(const BigFloat& x) { return x.sign() < 0 ? -x : x; }
  friend BigFloat sqrt(const BigFloat& x);

  double to_double() const;  ///< 0 below the smallest double
  /// 10^n
  static BigFloat power_of_ten(int n);

 private:
  BigFloat(const cln::cl_F& m, const cln::cl_I& e) : m_(m), e_(e) { normalise(); }
  void normalise();

  cln::cl_F m_;
  cln::cl_I e_;
};

using BigVector = std::vector<BigFloat>;

}  // namespace ricochet::arbiter
