#pragma once

#include <ginac/ginac.h>

#include <string>

namespace ricochet {

/// Writes an expression for parse_expression(). Terms and factors are sorted by their text, and a sum starts with a
/// positive term if possible, because GiNaC's own order depends on memory addresses and would change from run to run.
/// @throws InputError for an expression that the grammar does not contain
std::string expression_text(const GiNaC::ex& expression);

}  // namespace ricochet
