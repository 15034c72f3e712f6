#pragma once

#include <string>

#include "reports/chart.h"

namespace ricochet {

/// The points of a chart as CSV: their panel, the labels of its axes, the curve, how it is drawn, the number of its piece, and
/// the value of a cell.
std::string chart_csv(const Chart& chart);

}  // namespace ricochet
