#pragma once

#include <ginac/ginac.h>

#include <string>

namespace ricochet {

/// An expression as parse_expression() reads it. Terms and factors are sorted by their text and sums lead with a plus
/// where a sign can be moved: GiNaC's own order follows memory addresses and would change from run to run.
/// @throws InputError for what the grammar has no word for
std::string expression_text(const GiNaC::ex& expression);

}  // namespace ricochet
