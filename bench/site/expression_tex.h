#pragma once

#include <ginac/ginac.h>

#include <string>

namespace ricochet {

/// An expression in TeX. Terms and factors are sorted by their text, as expression_text() does: GiNaC's own order
/// changes from run to run. @throws InputError for what is no formula of a scene
std::string expression_tex(const GiNaC::ex& expression);

/// A name of a symbol in TeX: "q[0]" and "theta0" have subscripts, Greek letters are letters, words stand upright.
std::string symbol_tex(const std::string& name);

}  // namespace ricochet
