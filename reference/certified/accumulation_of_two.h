#pragma once

#include <array>

#include "reference/certified/hybrid_motion.h"

/// @file
/// Two frictionless contacts whose impacts accumulate, see accumulation_of_two.cpp and plastic_accumulation.cpp.

namespace ricochet::reference::certified {

/// The two contacts, the one that was hit last first, and boxes that contain the motion.
struct HybridMotion::PairCollapse {
  std::array<int, 2> contacts;
  std::vector<int> group;                  ///< the two, and those of C
  ModeMotion open, closed;                 ///< of the two, while C is closed
  std::array<Node, 2> rates;               ///< gap accelerations while both are open
  std::array<Ball, 2> w0, g0;              ///< rates w and upper bounds of the gaps g at the beginning
  std::vector<Ball> start;                 ///< q, v at the beginning
  std::array<std::vector<Ball>, 2> moved;  ///< M^-1 J~_k'
  BallMatrix G, inverse;                   ///< G and G^-1
  std::vector<Ball> box;                   ///< Q, V: contains the motion within the window
  std::vector<Ball> end;                   ///< Q, and v at the end
  Ball w;                                  ///< length of the window: upper bound, exact
  std::array<Ball, 2> c, push;             ///< gap accelerations in the box, and -G^-1 c
};

/// The two contacts after some impacts.
struct HybridMotion::PairImpacts {
  std::array<Ball, 2> w, g;  ///< rates, and upper bounds of gaps
  std::array<Ball, 2> sums;  ///< impulses
  Ball duration;             ///< upper bound
  int last = 0;              ///< which one was hit last
};

}  // namespace ricochet::reference::certified
