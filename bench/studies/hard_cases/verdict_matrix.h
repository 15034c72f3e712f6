#pragma once

#include <string>
#include <vector>

#include "bench/studies/hard_cases/hard_cell.h"
#include "reports/figures.h"
#include "reports/section.h"

namespace ricochet {

/// The matrix of verdicts as SVG: every cell has a colour that colour-blind readers can tell apart, the verdict as a
/// word, and, where the pointer rests on it, its number and the command that repeats it.
std::string verdict_matrix_svg(const std::vector<HardCell>& cells);

/// Writes it into the folder as NAME.svg. @throws InputError when it cannot be written
Figure draw_verdict_matrix(const FigureFolder& folder, const std::vector<HardCell>& cells, const std::string& name);

/// The same for a reader who chooses methods, groups of cases and verdicts.
Section::Chart verdict_matrix_chart(const std::vector<HardCell>& cells, const std::string& experiment);

}  // namespace ricochet
