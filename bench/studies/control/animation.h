#pragma once

#include <string>

#include "bench/studies/control/control_run.h"

namespace ricochet {

/// The claimed motion of a run with a picture as an HTML figure, for Section::animation: to be played, stopped and moved by hand, with the
/// impacts marked on the time line. Without scripts it is hidden; the frames of the motion (draw_frames) say
/// the same.
std::string animation_html(const ControlRun& run);

}  // namespace ricochet
