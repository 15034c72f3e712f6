#pragma once

#include <array>
#include <string>

#include "problems/problem.h"

namespace ricochet {

// Drawing of a scene: shapes at a configuration q, and arrows for forces. Units are metres and newtons, x is to the
// right, y upwards. The number and the kinds of shapes and arrows do not depend on q.

/// A shape of a picture, in the colour of a body.
struct Shape {
  enum class Kind {
    circle,   ///< x, y of the centre, radius
    box,      ///< x, y of the centre, width, height
    segment,  ///< x, y of both ends
    ground    ///< 0, y: the half space below, over the whole width
  };

  Kind kind = Kind::circle;
  int body = 0;          ///< number of the body, from 1; 0: fixed
  bool is_goal = false;  ///< target of the body
  std::array<double, 4> numbers{};

  static Shape circle(int body, double x, double y, double radius) {
    return {Kind::circle, body, false, {x, y, radius}};
  }
  static Shape box(int body, double x, double y, double width, double height) {
    return {Kind::box, body, false, {x, y, width, height}};
  }
  static Shape segment(int body, double x, double y, double to_x, double to_y) {
    return {Kind::segment, body, false, {x, y, to_x, to_y}};
  }
  static Shape ground(double y) { return {Kind::ground, 0, false, {0, y}}; }

  Shape as_goal() const { return {kind, body, true, numbers}; }
};

/// Controls and contact forces at an instant.
struct Forces {
  Vector u, lambda_n;  ///< n_u, n_c
  Vector friction;     ///< n_c: the first component of lambda_t, 0 for a contact without friction
};

/// A force, drawn from the point where it acts.
struct Arrow {
  int contact = -1;  ///< contact of the force; -1 for a control
  double x = 0, y = 0;
  double F_x = 0, F_y = 0;  ///< [N]
};

}  // namespace ricochet
