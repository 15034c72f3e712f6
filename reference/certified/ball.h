#pragma once

#include <arb.h>

#include <string>
#include <utility>

namespace GiNaC {
class numeric;
}

/// @file
/// Numbers of proofs: Ball, a real number known up to a radius, and Magnitude, an upper bound. Both are those of Arb.

namespace ricochet::reference::certified {

/// The sign of a real number, as far as its ball proves it.
enum class Sign { negative = -1, unknown = 0, positive = 1 };

/// All real numbers within a radius of a midpoint. The result of an operation on balls contains the results of all
/// members.
class Ball {
 public:
  Ball() { arb_init(ball_); }
  explicit Ball(double value) : Ball() { arb_set_d(ball_, value); }  ///< The exact value of a double.
  Ball(const Ball& other) : Ball() { arb_set(ball_, other.ball_); }
  Ball(Ball&& other) noexcept : Ball() { arb_swap(ball_, other.ball_); }
  explicit Ball(arb_srcptr other) : Ball() { arb_set(ball_, other); }
  Ball& operator=(const Ball& other) {
    arb_set(ball_, other.ball_);
    return *this;
  }
  Ball& operator=(Ball&& other) noexcept {
    arb_swap(ball_, other.ball_);
    return *this;
  }
  ~Ball() { arb_clear(ball_); }

  arb_ptr get() { return ball_; }           ///< For functions of Arb.
  arb_srcptr get() const { return ball_; }  ///< The same.

  Sign sign() const;                                        ///< Strict sign of all members.
  bool is_zero() const { return arb_is_zero(ball_) != 0; }  ///< The number zero, exactly.
  Ball midpoint() const;                                    ///< Without the radius.
  double nearest() const;                                   ///< Midpoint, rounded.
  double log10_radius() const;  ///< Upper bound, about 1e-4 wide; -1e9 if the radius is zero.
  void widen(mag_srcptr radius) { arb_add_error_mag(ball_, radius); }  ///< Adds to the radius.

 private:
  arb_t ball_;
};

/// A non-negative upper bound with 30 bits, or a lower bound where that is stated.
class Magnitude {
 public:
  Magnitude() { mag_init(mag_); }
  explicit Magnitude(const Ball& ball) : Magnitude() { arb_get_mag(mag_, ball.get()); }  ///< Of all members.
  Magnitude(const Magnitude& other) : Magnitude() { mag_set(mag_, other.mag_); }
  Magnitude& operator=(const Magnitude& other) {
    mag_set(mag_, other.mag_);
    return *this;
  }
  ~Magnitude() { mag_clear(mag_); }

  mag_ptr get() { return mag_; }           ///< For functions of Arb.
  mag_srcptr get() const { return mag_; }  ///< The same.
  double upper() const;                    ///< Rounded up; infinite above the range of doubles.

 private:
  mag_t mag_;
};

/// How accurately to compute; passed explicitly to everything that rounds or truncates.
struct Precision {
  slong bits = 160;  ///< of the midpoints of balls
  int order = 56;    ///< N: Taylor polynomials have the degree N

  Ball add(const Ball& a, const Ball& b) const;   ///< a + b
  Ball sub(const Ball& a, const Ball& b) const;   ///< a - b
  Ball mul(const Ball& a, const Ball& b) const;   ///< a b
  Ball div(const Ball& a, const Ball& b) const;   ///< a / b, not finite if b may be zero
  Ball hull(const Ball& a, const Ball& b) const;  ///< Contains both.
  /// The exact rational `number` as a ball.
  Ball ball(const GiNaC::numeric& number) const;
};

// Exact balls that bound one; `bits` of their midpoints.
Ball upper_bound(const Ball& x, slong bits);    ///< Of x.
Ball least_size(const Ball& x, slong bits);     ///< Lower bound of |x|.
Ball greatest_size(const Ball& x, slong bits);  ///< Upper bound of |x|.

Ball square_root(const Ball& x, slong bits);  ///< Not finite if x may be negative.

inline Ball operator-(const Ball& a) {  ///< Exact.
  Ball result;
  arb_neg(result.get(), a.get());
  return result;
}

/// A decimal number and the proven bound of its distance to the value.
struct Decimal {
  std::string text;   ///< decimal digits, all of them proven up to one unit of the last place
  double radius = 0;  ///< upper bound of |value - text|
  int decimals = 0;   ///< floor(-log10(radius)): proven places after the point; 999 if the text is exact
};

/// The `ball` as a decimal number with at most `digits` significant digits. Its radius includes the rounding of the
/// text.
Decimal decimal(const Ball& ball, int digits);

/// The exact value of a finite double as a rational number.
GiNaC::numeric exact_value(double value);
/// The shortest decimal number that reads back as the finite double `value`, as a rational number: 3/10 for 0.3.
GiNaC::numeric shortest_decimal(double value);

}  // namespace ricochet::reference::certified
