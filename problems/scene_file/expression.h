#pragma once

#include <ginac/ginac.h>

#include <map>
#include <set>
#include <string>
#include <vector>

namespace ricochet {

/// Names that an expression may use.
struct ExpressionNames {
  std::map<std::string, GiNaC::ex> scalars;                   ///< parameters, t
  std::map<std::string, std::vector<GiNaC::symbol>> vectors;  ///< q[i], v[i], u[i]
};

/// Reads an expression in Python's syntax: + - * / **, parentheses, numbers, names, q[i], pi, and the functions sin,
/// cos, tan, asin, acos, atan, atan2, sinh, cosh, tanh, exp, log, sqrt, abs, sign, min, max. Decimal numbers remain
/// exact. if(a < b, x, y), with <, <=, > or >=, is x if the condition holds, else y. Functions with kinks or jumps have
/// the derivatives of real_functions.h.
///
/// Numbers are exact, so a short text could fill the memory. These are rejected: numbers outside 1e-400 to 1e400,
/// powers of numbers with more than a million bits, exponents above 1000, more than 100000 characters or operations.
/// @param field  name of the field, for messages
/// @throws InputError with the field, the column and a mark below it
GiNaC::ex parse_expression(const std::string& text, const ExpressionNames& names, const std::string& field);

/// The value of an expression whose names are all numbers. @throws InputError, also if it is not real and finite
double formula_value(const std::string& text, const ExpressionNames& names, const std::string& field);

/// The reserved words, which cannot be names: functions, if and pi.
std::set<std::string> words_of_formulas();

}  // namespace ricochet
