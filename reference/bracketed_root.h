#pragma once

#include <functional>

namespace ricochet::reference {

/// Where f, of opposite signs at the ends, is zero: GSL's Brent-Dekker method, to rounding.
double bracketed_root(const std::function<double(double)>& f, double from, double to);

}  // namespace ricochet::reference
