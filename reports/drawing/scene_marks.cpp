#include "reports/drawing/scene_marks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "reports/curve_look.h"

namespace ricochet {
namespace {

/// The least turn that makes gravity point down: I + [w] + [w]^2 / (1 + c) with w = g x d, c = g'd.
Matrix3<double> upright(const Geometry& geometry) {
  const Matrix3<double> I = identity<double>();
  const double size = std::sqrt(dot(geometry.gravity, geometry.gravity));
  if (size == 0) return I;
  const Vector3<double> g = scaled(1 / size, geometry.gravity), d = scaled(-1.0, I[geometry.in_space ? 2 : 1]);
  const double c = dot(g, d);
  if (c <= -1 + 1e-12) return I;  // straight up: no turn is the least
  const Vector3<double> w = cross(g, d);
  Matrix3<double> R;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3<double> once = cross(w, I[k]), twice = cross(w, once),
                          column = sum(sum(I[k], once), scaled(1 / (1 + c), twice));
    for (std::size_t row = 0; row < 3; ++row) R[row][k] = column[row];
  }
  return R;
}

}  // namespace

Projection::Projection(const Geometry& geometry) {
  if (geometry.in_space) {
    const double s_a = std::sin(kAzimuth), c_a = std::cos(kAzimuth), s_e = std::sin(kElevation),
                 c_e = std::cos(kElevation);
    axes_ = {{{-s_a, c_a, 0}, {-s_e * c_a, -s_e * s_a, c_e}, {c_e * c_a, c_e * s_a, s_e}}};
  }
  upright_ = upright(geometry);
}

Point Projection::operator()(const Vector3<double>& x) const {
  const Vector3<double> seen = times(axes_, times(upright_, x));
  return {seen[0], seen[1]};
}

void PaperBox::add(const Point& x, double radius) {
  left = std::min(left, x[0] - radius);
  right = std::max(right, x[0] + radius);
  bottom = std::min(bottom, x[1] - radius);
  top = std::max(top, x[1] + radius);
}

SceneMarks::SceneMarks(const Problem& problem, const std::vector<Vector>& states)
    : problem_(problem), geometry_(*problem.info().geometry), project_(geometry_) {
  for (const Vector& q : states) {
    for (int i = 0; i < static_cast<int>(geometry_.bodies.size()); ++i) {
      const Vector3<double> centre = motion_of<double>(geometry_, i, {q.begin(), q.end()}).centre;
      if (geometry_.in_space) places_.push_back(centre);
    }
  }
  for (const BodyShape& shape : geometry_.shapes) {
    if (shape.body < 0) continue;
    extent_ = std::max({extent_, shape.size[0], shape.size[1], shape.size[2]});
    for (const auto& corner : shape.corners) extent_ = std::max(extent_, std::hypot(corner[0], corner[1]));
  }
}

std::vector<Mark> SceneMarks::at(const Vector& q) const {
  const std::vector<double> x(q.begin(), q.end());
  std::vector<Mark> solids, marks;
  for (int i = 0; i < static_cast<int>(geometry_.shapes.size()); ++i) {
    const BodyShape& shape = geometry_.shapes[static_cast<std::size_t>(i)];
    if (shape.kind == ShapeKind::half_space && shape.body < 0)  // that of a body is a face of it
      add_half_space(i, q, solids);
    else
      add_shape(shape, x, marks);
  }
  for (const Link& link : geometry_.links) {
    const Point a = project_(motion_of(geometry_, link.first, x).point(link.first_point));
    const Point b = project_(motion_of(geometry_, link.second, x).point(link.second_point));
    solids.push_back(
        {Mark::Kind::line, {a, b}, 0, "fill=\"none\" stroke=\"#909090\" stroke-dasharray=\"5 3\"", false, true});
  }
  add_shadows(x, solids);
  solids.insert(solids.end(), marks.begin(), marks.end());
  return solids;
}

std::vector<ForceArrow> SceneMarks::arrows(const Vector& q, const SceneForces& forces) const {
  const ProblemInfo& info = problem_.info();
  const auto force_on = [&](const Body& body, const Vector& load) {
    Vector3<double> force{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (const int k = body.position[axis].coordinate; k >= 0) force[axis] = load[k];
    }
    return project_(force);
  };
  std::vector<ForceArrow> arrows;
  if (info.n_u > 0) {
    const Vector at_rest = Vector::Zero(info.n_q), no_control = Vector::Zero(info.n_u);
    Vector load(info.n_q), other(info.n_q);
    problem_.force(q.data(), at_rest.data(), forces.u.data(), load.data());
    problem_.force(q.data(), at_rest.data(), no_control.data(), other.data());
    const auto places = centres(q);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Body& body = geometry_.bodies[i];
      if (has_own_coordinates(body)) arrows.push_back({-1, places[i], force_on(body, load - other)});
    }
  }
  const Matrix J_n = problem_.normal_jacobian(q), J_t = problem_.tangent_jacobian(q);
  for (const ShapePair& pair : geometry_.pairs) {
    const int body = geometry_.shapes[static_cast<std::size_t>(pair.second)].body;
    if (body < 0 || !has_own_coordinates(geometry_.bodies[static_cast<std::size_t>(body)])) continue;
    const ContactInfo& contact = info.contacts[static_cast<std::size_t>(pair.contact)];
    Vector load = J_n.col(pair.contact) * forces.lambda_n[pair.contact];
    if (contact.n_t > 0)
      load += J_t.middleCols(contact.tangent_index, contact.n_t) *
              forces.lambda_t.segment(contact.tangent_index, contact.n_t);
    arrows.push_back(
        {pair.contact, place_of(pair.contact, q), force_on(geometry_.bodies[static_cast<std::size_t>(body)], load)});
  }
  return arrows;
}

Point SceneMarks::place_of(int contact, const Vector& q) const {
  const auto pair = std::ranges::find(geometry_.pairs, contact, &ShapePair::contact);
  if (pair == geometry_.pairs.end()) return centres(q).front();
  return project_(contact_of<double>(geometry_, *pair, {q.begin(), q.end()}).point);
}

void SceneMarks::add_to(PaperBox& box, const Vector& q, bool is_first) const {
  for (const Mark& mark : at(q)) {
    if (mark.kind == Mark::Kind::solid) continue;
    for (const Point& x : mark.points) box.add(x, mark.radius);
  }
  if (!is_first) return;
  const std::vector<double> x(q.begin(), q.end());
  for (const ShapePair& pair : geometry_.pairs) {
    const ShapeContact<double> contact = contact_of<double>(geometry_, pair, x);
    box.add(project_(difference(contact.point, scaled(contact.gap, contact.normal))));
  }
  for (int i = 0; i < static_cast<int>(geometry_.shapes.size()); ++i) {
    if (is_surface(i) && !is_paired(i)) add_nearest_to(i, x, box);
  }
}

std::vector<Point> SceneMarks::centres(const Vector& q) const {
  std::vector<Point> points;
  for (int i = 0; i < static_cast<int>(geometry_.bodies.size()); ++i)
    points.push_back(project_(motion_of<double>(geometry_, i, {q.begin(), q.end()}).centre));
  return points;
}

bool SceneMarks::is_surface(int shape) const {
  const BodyShape& s = geometry_.shapes[static_cast<std::size_t>(shape)];
  return s.kind == ShapeKind::half_space && s.body < 0;
}

bool SceneMarks::is_paired(int shape) const {
  return std::ranges::any_of(geometry_.pairs,
                             [&](const ShapePair& pair) { return pair.first == shape || pair.second == shape; });
}

void SceneMarks::add_nearest_to(int surface, const std::vector<double>& x, PaperBox& box) const {
  double least = std::numeric_limits<double>::infinity();
  Point nearest{};
  for (int i = 0; i < static_cast<int>(geometry_.shapes.size()); ++i) {
    if (const BodyShape& shape = geometry_.shapes[static_cast<std::size_t>(i)]; shape.body < 0) continue;
    const ShapeContact<double> contact = contact_of<double>(geometry_, {.first = surface, .second = i}, x);
    if (!(contact.gap < least)) continue;
    least = contact.gap;
    nearest = project_(difference(contact.point, scaled(contact.gap, contact.normal)));
  }
  if (std::isfinite(least)) box.add(nearest);
}

void SceneMarks::add_shape(const BodyShape& shape, const std::vector<double>& x, std::vector<Mark>& marks) const {
  const BodyMotion<double> motion = motion_of(geometry_, shape.body, x);
  const Matrix3<double> R = times(motion.R, geometry_detail::cardan(shape.angles));
  const Vector3<double> centre = motion.point(shape.position);
  const std::string color = shape.body < 0 ? "#808080" : curve_color(static_cast<std::size_t>(shape.body));
  const std::string filled = fmt::format("fill=\"{0}\" fill-opacity=\"0.85\" stroke=\"{0}\"", color);
  const auto place = [&](double a, double b, double c) {
    return project_(sum(centre, times(R, Vector3<double>{a, b, c})));
  };
  const auto& [a, b, c] = shape.size;
  const bool is_body = shape.body >= 0;
  switch (shape.kind) {
    case ShapeKind::sphere: {
      marks.push_back({Mark::Kind::disc, {project_(centre)}, a, filled, false, is_body});
      const bool shows_turn = shape.body >= 0 && shape.position == Vector3<double>{} &&
                              geometry_.bodies[static_cast<std::size_t>(shape.body)].rotation == BodyRotation::planar;
      if (shows_turn && a > 0)
        marks.push_back({Mark::Kind::line, {place(0, 0, 0), place(a, 0, 0)}, 0, "stroke=\"#ffffff\"", false, true});
      return;
    }
    case ShapeKind::capsule:
      marks.push_back({Mark::Kind::line,
                       {place(-b, 0, 0), place(b, 0, 0)},
                       std::max(a, 1e-9),
                       fmt::format("stroke=\"{}\" stroke-opacity=\"0.85\" stroke-linecap=\"round\"", color),
                       false,
                       is_body});
      return;
    case ShapeKind::box:
      if (!geometry_.in_space) {
        marks.push_back({Mark::Kind::polygon,
                         {place(-a, -b, 0), place(a, -b, 0), place(a, b, 0), place(-a, b, 0)},
                         0,
                         filled,
                         false,
                         is_body});
        return;
      }
      for (int axis = 0; axis < 3; ++axis) {  // faces
        for (const double side : {-1.0, 1.0}) {
          std::vector<Point> corners;
          for (const auto& [s, t] : {Point{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
            Vector3<double> corner{s, s, s};
            corner[static_cast<std::size_t>((axis + 1) % 3)] = t;
            corner[static_cast<std::size_t>(axis)] = side;
            corners.push_back(place(a * corner[0], b * corner[1], c * corner[2]));
          }
          marks.push_back(
              {Mark::Kind::polygon, corners, 0,
               fmt::format("fill=\"{0}\" fill-opacity=\"0.3\" stroke=\"{0}\" stroke-linejoin=\"round\"", color), false,
               is_body});
        }
      }
      return;
    case ShapeKind::polygon: {
      std::vector<Point> corners;
      for (const auto& corner : shape.corners) corners.push_back(place(corner[0], corner[1], 0));
      if (!shape.is_open) {
        marks.push_back({Mark::Kind::polygon, corners, 0, filled, false, is_body});
        return;
      }
      for (std::size_t i = 0; i + 1 < corners.size(); ++i)
        marks.push_back({Mark::Kind::line,
                         {corners[i], corners[i + 1]},
                         0,
                         fmt::format("fill=\"none\" stroke=\"{}\"", color),
                         false,
                         is_body});
      return;
    }
    case ShapeKind::half_space:
      return;
  }
}

double SceneMarks::shift_of(int shape, const Vector& q) const {
  if (problem_.info().clock < 0) return 0;
  for (const ShapePair& pair : geometry_.pairs) {
    if (pair.first != shape || !problem_.info().contacts[static_cast<std::size_t>(pair.contact)].is_moving) continue;
    return contact_of<double>(geometry_, pair, {q.begin(), q.end()}).gap - problem_.gap(q)[pair.contact];
  }
  return 0;
}

void SceneMarks::add_half_space(int number, const Vector& q, std::vector<Mark>& marks) const {
  const BodyShape& shape = geometry_.shapes[static_cast<std::size_t>(number)];
  const BodyMotion<double> motion = motion_of<double>(geometry_, shape.body, {q.begin(), q.end()});
  const Matrix3<double> R = times(motion.R, geometry_detail::cardan(shape.angles));
  const Vector3<double> normal = column_of(R, geometry_.in_space ? 2 : 1);
  const Vector3<double> origin = sum(motion.point(shape.position), scaled(shift_of(number, q), normal));
  if (!geometry_.in_space) {
    const Point p = project_(origin), along = project_(column_of(R, 0)), inwards = project_(scaled(-1.0, normal));
    marks.push_back({Mark::Kind::solid, {p, along, inwards}, 0, "fill=\"#e9e9e9\" stroke=\"#808080\"", true});
    return;
  }
  // A patch below the ways of the bodies.
  const Vector3<double> e_1 = column_of(R, 0), e_2 = column_of(R, 1);
  PaperBox patch;
  for (const auto& place : places_) {
    const Vector3<double> d = difference(place, origin);
    patch.add({dot(d, e_1), dot(d, e_2)}, 2 * extent_);
  }
  const auto corner = [&](double s, double t) { return project_(sum(origin, sum(scaled(s, e_1), scaled(t, e_2)))); };
  marks.push_back({Mark::Kind::polygon,
                   {corner(patch.left, patch.bottom), corner(patch.right, patch.bottom), corner(patch.right, patch.top),
                    corner(patch.left, patch.top)},
                   0,
                   "fill=\"#ececec\" stroke=\"#808080\"",
                   true});
}

void SceneMarks::add_shadows(const std::vector<double>& x, std::vector<Mark>& marks) const {
  if (!geometry_.in_space) return;
  for (const BodyShape& floor : geometry_.shapes) {
    if (floor.kind != ShapeKind::half_space || floor.body >= 0) continue;
    const Vector3<double> normal = column_of(geometry_detail::cardan(floor.angles), 2);
    if (project_.turned(normal)[2] < 1 - 1e-12) continue;
    for (const BodyShape& shape : geometry_.shapes) {
      if (shape.kind != ShapeKind::sphere || shape.body < 0) continue;
      const Vector3<double> c = motion_of(geometry_, shape.body, x).point(shape.position);
      const Vector3<double> below = difference(c, scaled(dot(difference(c, floor.position), normal), normal));
      marks.push_back({Mark::Kind::shadow, {project_(below)}, shape.size[0], "fill=\"#000000\" fill-opacity=\"0.15\""});
    }
    return;
  }
}

}  // namespace ricochet
