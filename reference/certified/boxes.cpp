#include "reference/certified/boxes.h"

#include <algorithm>

namespace ricochet::reference::certified {

void inflate(std::vector<Ball>& box, slong bits) {
  for (Ball& x : box) {
    Magnitude extra(x);
    mag_mul_2exp_si(extra.get(), extra.get(), -bits + 8);
    mag_add(extra.get(), extra.get(), arb_radref(x.get()));
    x.widen(extra.get());
  }
}

bool contains(const std::vector<Ball>& outer, const std::vector<Ball>& inner) {
  return std::ranges::equal(outer, inner,
                            [](const Ball& a, const Ball& b) { return arb_contains(a.get(), b.get()) != 0; });
}

}  // namespace ricochet::reference::certified
