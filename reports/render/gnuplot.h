#pragma once

#include <string>
#include <vector>

#include "reports/chart.h"
#include "reports/figures.h"

namespace ricochet {

/// Whether gnuplot can be run (Debian: gnuplot-nox).
bool can_draw();

/// Draws a chart with gnuplot: FILE.svg, and FILE.pdf if the folder wants it; a panel with a file of its own is a picture of
/// its own. The script stays beside the picture, FILE.gp. @throws InputError if gnuplot fails
std::vector<Figure> draw_chart(const FigureFolder& folder, const Chart& chart);

/// The script that writes FILE.svg, or FILE.pdf of the same proportions.
std::string gnuplot_script(const Chart& chart, bool is_pdf = false);

}  // namespace ricochet
