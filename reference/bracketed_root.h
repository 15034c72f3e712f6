#pragma once

#include <functional>

namespace ricochet::reference {

/// Root of f, which has opposite signs at the ends, to rounding, by GSL's Brent-Dekker method. If rounding gives both
/// ends the same sign, the end at which |f| is smaller.
double bracketed_root(const std::function<double(double)>& f, double from, double to);

}  // namespace ricochet::reference
