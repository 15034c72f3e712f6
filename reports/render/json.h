#pragma once

#include <nlohmann/json.hpp>

#include "reports/chart.h"

namespace ricochet {

/// The panels of a chart as the site's scripts read them (reports/site/src/curves.js). Points without a place on the axes are
/// left out.
nlohmann::json chart_json(const Chart& chart);

/// Whether these scripts can draw it: one key for all panels, and no cells.
bool is_interactive(const Chart& chart);

}  // namespace ricochet
