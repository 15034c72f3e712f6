#pragma once

#include <cmath>

#include "problems/problem.h"

namespace ricochet {

/// J' x for one column of a packed J_n or J_t: its entries stand at the support of the contact.
/// @param x  n_q, anything indexed by coordinate
double packed_dot(const ContactInfo& contact, const double* column, const auto& x) {
  double sum = 0;
  for (const int k : contact.support) sum += *column++ * x[k];
  return sum;
}

/// |J|' |x|: what the rounding of J' x is measured against.
double packed_terms(const ContactInfo& contact, const double* column, const auto& x) {
  double sum = 0;
  for (const int k : contact.support) sum += std::abs(*column++ * x[k]);
  return sum;
}

}  // namespace ricochet
