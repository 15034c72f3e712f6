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

/// Reads an expression in Python's syntax: + - * / **, parentheses, numbers, names, q[i], and the functions sin, cos,
/// tan, asin, acos, atan, atan2, sinh, cosh, tanh, exp, log, sqrt, abs, sign, min, max; `pi` is known. Decimal numbers
/// are kept exact. if(a < b, x, y), with <, <=, > or >=, is x where the condition holds, else y. Derivatives of
/// functions that bend or jump are those of real_functions.h.
///
/// Since numbers are exact, a short text can mean one that fills the memory: refused are numbers beyond 1e-400 to 1e400,
/// powers of numbers with more than a million bits, exponents above 1000, more than 100000 characters or operations.
/// @param field  where the text stands, for messages
/// @throws InputError with the field, the column and a picture of the place
GiNaC::ex parse_expression(const std::string& text, const ExpressionNames& names, const std::string& field);

/// The value of an expression whose names are all numbers. @throws InputError, also for one that is not real and finite
double formula_value(const std::string& text, const ExpressionNames& names, const std::string& field);

/// What no name may be: functions, if and pi.
std::set<std::string> words_of_formulas();

}  // namespace ricochet
