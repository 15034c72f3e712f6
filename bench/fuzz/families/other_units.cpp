#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// A scene of another family, all of whose coordinates are lengths, in other units of length, mass and time: powers of
// ten between 1e-9 and 1e9.
void draw_other_units(SceneDraw& draw) {
  switch (draw.integer(0, 3)) {
    case 0:
      draw_drop(draw);
      break;
    case 1:
      draw_column(draw);
      break;
    case 2:
      draw_turning_loads(draw);
      break;
    default:
      draw_changing_loads(draw);
  }
  const int mass = draw.integer(-9, 9), length = draw.integer(-9, 9), time = draw.integer(-3, 3);
  draw.change_units(mass, length, time);
}

}  // namespace ricochet
