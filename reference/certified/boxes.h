#pragma once

#include <vector>

#include "reference/certified/ball.h"

/// @file
/// Boxes that a map takes into themselves, for windows of time.

namespace ricochet::reference::certified {

/// Doubles the radii of a box, and adds what rounding may need.
void inflate(std::vector<Ball>& box, slong bits);

/// Whether every member of `inner` is one of `outer`.
bool contains(const std::vector<Ball>& outer, const std::vector<Ball>& inner);

constexpr int kMostInflations = 20;

/// Inflates the box and the length w of a window until map(window) takes both into themselves.
/// @returns false if it does not within kMostInflations
template <class Window, class Map>
bool enclose(Window& window, const Precision& a, Map map) {
  for (int k = 0; k < kMostInflations; ++k) {
    inflate(window.box, a.bits);
    window.w = a.mul(Ball(2.0), window.w);
    const std::vector<Ball> box = window.box;
    const Ball w = window.w;
    map(window);
    if (arb_le(window.w.get(), w.get()) != 0 && contains(box, window.box)) return true;
  }
  return false;
}

}  // namespace ricochet::reference::certified
