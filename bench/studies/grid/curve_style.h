#pragma once

#include <string>
#include <vector>

#include "bench/studies/grid/grid_results.h"
#include "reports/curve_look.h"

namespace ricochet {

// How the methods of some results are called and drawn: a family of methods reads as one.

/// Of all methods of some results, in their order: a method looks the same in all figures of its results. The members of a
/// family with several tableaus have its colour and differ by symbol; the others have what colours are left, and dashes.
/// Variants of a method, which differ in options alone, are dashed.
std::vector<CurveLook> curve_looks(const GridResults& results);
/// Of one of them.
CurveLook curve_look(const GridResults& results, const std::string& method);

/// An error beyond it says nothing: it is drawn on the edge, so that it does not squeeze the others.
constexpr double kLargestError = 10;
/// Smaller errors are drawn here: zero has no logarithm.
constexpr double kLeastDrawn = 1e-16;

/// "FESD-J Gauss 4", or the title that the method gives itself.
std::string curve_label(const GridResults& results, const Run& record);

/// "fesd:gauss" of "fesd:gauss:4"; "event-driven"; the others without a tableau are one family, "time stepping".
std::string curve_family(const std::string& method);
/// "FESD-J Gauss"
std::string family_title(const std::string& family);

}  // namespace ricochet
