#pragma once

#include <string>

#include "reports/control_results.h"

namespace ricochet {

/// The claimed motion of a run with a picture as an HTML figure: to be played, stopped and moved by hand, with the
/// impacts marked on the time line. Without scripts it is hidden; the frames of the motion (FigureFolder::frames) say
/// the same.
std::string animation_html(const ControlRun& run);

/// Styles, and the script that all animations of a page share: once, behind the last of them.
std::string animation_style();
std::string animation_script();

}  // namespace ricochet
