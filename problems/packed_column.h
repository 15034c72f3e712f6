#pragma once

#include <cmath>

#include "problems/problem.h"

namespace ricochet {

/// J' x for one column of a packed J_n or J_t, whose entries belong to the support of the contact.
/// @param x  n_q, indexed by coordinate
double packed_dot(const ContactInfo& contact, const double* column, const auto& x) {
  double sum = 0;
  for (const int k : contact.support) sum += *column++ * x[k];
  return sum;
}

/// |J|' |x|, the scale of the rounding error of J' x.
double packed_terms(const ContactInfo& contact, const double* column, const auto& x) {
  double sum = 0;
  for (const int k : contact.support) sum += std::abs(*column++ * x[k]);
  return sum;
}

}  // namespace ricochet
