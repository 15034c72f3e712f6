#pragma once

#include <string>
#include <vector>

#include "bench/studies/grid/grid_results.h"
#include "reports/curve_look.h"

namespace ricochet {

// Names and looks of methods in figures: a family of methods reads as one.

/// Looks of all methods of the results, in their order: a method looks the same in all figures of its results. Members of
/// a family with several tableaus share a colour and differ by symbol; the others have the remaining colours, and dashes.
/// Variants of a method, which differ in options alone, are dashed.
std::vector<CurveLook> curve_looks(const GridResults& results);
/// Look of one method.
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
