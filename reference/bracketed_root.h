#pragma once

#include <functional>

namespace ricochet::reference {

/// Where f, of opposite signs at the ends, is zero: GSL's Brent-Dekker method, to rounding. Where rounding gives both ends
/// one sign, the end at which f is nearer to zero.
double bracketed_root(const std::function<double(double)>& f, double from, double to);

}  // namespace ricochet::reference
