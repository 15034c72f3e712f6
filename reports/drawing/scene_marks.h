#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "problems/geometry_kinematics.h"
#include "problems/problem.h"
#include "reports/drawing/scene_drawing.h"

namespace ricochet {

// Marks of the drawing of a scene, in metres on paper.

constexpr double kAzimuth = -1.05, kElevation = 0.35;  // where space is seen from [rad]

using Point = std::array<double, 2>;

/// From space onto paper.
class Projection {
 public:
  explicit Projection(const Geometry& geometry);

  Point operator()(const Vector3<double>& x) const;
  /// A direction after the turn that makes gravity point down.
  Vector3<double> turned(const Vector3<double>& direction) const { return times(upright_, direction); }

 private:
  Matrix3<double> axes_ = identity<double>(), upright_;
};

/// An element of a drawing.
struct Mark {
  enum class Kind {
    disc,     ///< points[0], radius
    shadow,   ///< of a ball on a floor: an ellipse
    polygon,  ///< points
    line,     ///< points, radius half its width
    solid     ///< the half plane: a point of its edge, the direction of the edge, the one into it
  };

  Kind kind = Kind::disc;
  std::vector<Point> points;
  double radius = 0;
  std::string style;
  bool is_ground = false;  ///< below everything else
  bool is_body = false;    ///< moves with the coordinates
};

/// A force that acts on a body.
struct ForceArrow {
  int contact = -1;  ///< whose force it is; -1 for a control
  Point from{}, force{};
};

struct PaperBox {
  double left = std::numeric_limits<double>::infinity(), right = -left, bottom = left, top = -left;

  void add(const Point& x, double radius = 0);
};

/// The marks of a scene at any q: their number, kinds and styles do not depend on it.
class SceneMarks {
 public:
  SceneMarks(const Problem& problem, const std::vector<Vector>& states);

  std::vector<Mark> at(const Vector& q) const;
  /// One arrow for each contact with a pair of shapes, where they touch, on the second of them; one for the control of
  /// each body. Bodies have their arrows where their coordinates are their own.
  std::vector<ForceArrow> arrows(const Vector& q, const SceneForces& forces) const;
  /// Point at which a contact acts; the centre of the first body for a contact without a pair of shapes.
  Point place_of(int contact, const Vector& q) const;
  /// Adds room for the bodies, and for where they start from each surface.
  void add_to(PaperBox& box, const Vector& q, bool is_first) const;
  /// Centres of the bodies.
  std::vector<Point> centres(const Vector& q) const;

 private:
  bool is_surface(int shape) const;
  bool is_paired(int shape) const;
  /// A geometry for drawings alone has no pairs: of a surface, the point that a body is nearest to.
  void add_nearest_to(int surface, const std::vector<double>& x, PaperBox& box) const;
  void add_shape(const BodyShape& shape, const std::vector<double>& x, std::vector<Mark>& marks) const;
  /// Distance that a surface with a prescribed motion has moved along its normal: the excess of the gap of the geometry.
  double shift_of(int shape, const Vector& q) const;
  void add_half_space(int number, const Vector& q, std::vector<Mark>& marks) const;
  /// Adds shadows of balls on the first horizontal floor, which show their positions in space.
  void add_shadows(const std::vector<double>& x, std::vector<Mark>& marks) const;

  const Problem& problem_;
  const Geometry& geometry_;
  Projection project_;
  std::vector<Vector3<double>> places_;
  double extent_ = 0;
};

}  // namespace ricochet
