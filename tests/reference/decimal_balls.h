#pragma once

#include <string>

#include "reference/certified/ball.h"
#include "reference/certified/certified_motion.h"

/// @file
/// Decimal texts and certified numbers as balls, for comparison with closed forms.

namespace ricochet::reference::certified {

inline constexpr slong kTextBits = 600;  ///< more than any number in the tests has

/// The number that a decimal text states.
inline Ball decimal_ball(const std::string& text) {
  Ball ball;
  arb_set_str(ball.get(), text.c_str(), kTextBits);
  return ball;
}

/// The interval that a certified number states.
inline Ball interval(const CertifiedNumber& number) {
  Ball ball = decimal_ball(number.text);
  Magnitude radius;
  mag_set_d(radius.get(), number.radius);
  ball.widen(radius.get());
  return ball;
}

}  // namespace ricochet::reference::certified
