#pragma once

#include <ginac/ginac.h>

#include <map>
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
/// @param field  where the text stands, for messages
/// @throws InputError with the field, the column and a picture of the place
GiNaC::ex parse_expression(const std::string& text, const ExpressionNames& names, const std::string& field);

}  // namespace ricochet
