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

/// J_t' x of a contact. @param J_t  packed, of all contacts  @param values  out: n_t
void packed_tangent_dots(const ContactInfo& contact, const double* J_t, const auto& x, double* values) {
  const double* column = J_t + contact.tangent_begin;
  for (int d = 0; d < contact.n_t; ++d, column += contact.support.size()) values[d] = packed_dot(contact, column, x);
}

/// |J|' |x|, the scale of the rounding error of J' x.
double packed_terms(const ContactInfo& contact, const double* column, const auto& x) {
  double sum = 0;
  for (const int k : contact.support) sum += std::abs(*column++ * x[k]);
  return sum;
}

}  // namespace ricochet
