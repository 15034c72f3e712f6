#pragma once

#include <cstdlib>

/// Whether the fault with this number is planted: the one that the environment variable RICOCHET_FAULT names, or none.
inline bool is_planted(int fault) {
  static const char* text = std::getenv("RICOCHET_FAULT");
  static const int planted = text ? std::atoi(text) : 0;
  return fault == planted;
}
