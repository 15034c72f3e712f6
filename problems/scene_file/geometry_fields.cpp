#include "problems/scene_file/geometry_fields.h"

#include <algorithm>
#include <cmath>

#include "problems/named_values.h"
#include "problems/names.h"
#include "problems/scene_file/expression_text.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using nlohmann::ordered_json;

const Names<BodyRotation>& rotation_names() {
  static const Names<BodyRotation> names = {{"none", BodyRotation::none},
                                            {"planar", BodyRotation::planar},
                                            {"cardan", BodyRotation::cardan},
                                            {"spin", BodyRotation::spin}};
  return names;
}

const Names<ShapeKind>& kind_names() {
  static const Names<ShapeKind> names = {{"sphere", ShapeKind::sphere},
                                         {"box", ShapeKind::box},
                                         {"capsule", ShapeKind::capsule},
                                         {"half_space", ShapeKind::half_space},
                                         {"polygon", ShapeKind::polygon}};
  return names;
}

template <class Value>
std::string name_in(const Names<Value>& names, Value value) {
  return std::ranges::find(names, value, &std::pair<std::string, Value>::second)->first;
}

/// Reads the angles of a body.
std::size_t n_angles(BodyRotation rotation) {
  switch (rotation) {
    case BodyRotation::none:
      return 0;
    case BodyRotation::planar:
      return 1;
    case BodyRotation::cardan:
    case BodyRotation::spin:
      return 3;
  }
  return 0;
}

std::size_t n_sizes(ShapeKind kind, bool in_space) {
  switch (kind) {
    case ShapeKind::sphere:
      return 1;
    case ShapeKind::box:
      return in_space ? 3 : 2;
    case ShapeKind::capsule:
      return 2;
    case ShapeKind::half_space:
    case ShapeKind::polygon:
      return 0;
  }
  return 0;
}

/// Reads the signs that select a corner or an end of a shape.
std::size_t n_signs(ShapeKind kind, bool in_space) {
  return kind == ShapeKind::box ? n_sizes(kind, in_space) : kind == ShapeKind::capsule ? 1 : 0;
}

class GeometryReader {
 public:
  GeometryReader(const Field& field, const SymbolicModel& model, const ExpressionNames& constants,
                 const ExpressionNames& in_q)
      : field_(field), model_(model), constants_(constants), in_q_(in_q) {}

  GeometryOf<ex> read() {
    if (field_.has("in_space")) geometry_.in_space = field_.at("in_space").value().get<bool>();
    dimension_ = geometry_.in_space ? 3 : 2;
    if (field_.has("gravity")) geometry_.gravity = vector(field_.at("gravity"), dimension_);
    const Field bodies = field_.at("bodies"), shapes = field_.at("shapes");
    for (std::size_t i = 0; i < bodies.size(); ++i) read_body(bodies.at(i));
    for (std::size_t i = 0; i < shapes.size(); ++i) read_shape(shapes.at(i));
    if (!field_.has("links")) return geometry_;
    const Field links = field_.at("links");
    for (std::size_t i = 0; i < links.size(); ++i) {
      const Field link = links.at(i);
      LinkOf<ex> read{body_number(link, "first"), body_number(link, "second")};
      if (link.has("first_point")) read.first_point = vector(link.at("first_point"), dimension_);
      if (link.has("second_point")) read.second_point = vector(link.at("second_point"), dimension_);
      geometry_.links.push_back(read);
    }
    return geometry_;
  }

 private:
  void read_body(const Field& field) {
    BodyOf<ex> body;
    body.name = field.at("name").text();
    for (const BodyOf<ex>& other : geometry_.bodies) {
      if (other.name == body.name)
        throw InputError(place_of(field.name(), "name"), body.name, "a name that no other body has is required");
    }
    body.mass = field.at("mass").expression(constants_);
    require_not_negative(field.at("mass"), body.mass);
    if (field.has("inertia")) {
      const Field inertia = field.at("inertia");
      const auto moments = inertia.expressions(geometry_.in_space ? 3 : 1, constants_);
      for (std::size_t k = 0; k < moments.size(); ++k) require_not_negative(inertia.at(k), moments[k]);
      std::ranges::copy(moments, geometry_.in_space ? body.inertia.begin() : body.inertia.begin() + 2);
    }
    body.parent = body_number(field, "parent");
    if (field.has("position")) body.position = pose(field.at("position"), dimension_);
    if (field.has("rotation")) body.rotation = *find(rotation_names(), field.at("rotation").text());
    if (const std::size_t n = n_angles(body.rotation); n > 0)
      body.angles = pose(field.at("angles"), n);
    else if (field.has("angles"))
      throw InputError(place_of(field.name(), "angles"), field.at("angles").value().dump(),
                       "a body with rotation none has no angles");
    if (field.has("centre_from_pivot")) body.centre_from_pivot = vector(field.at("centre_from_pivot"), dimension_);
    geometry_.add_body(std::move(body));
  }

  void read_shape(const Field& field) {
    BodyShapeOf<ex> shape;
    if (field.has("name")) shape.name = field.at("name").text();
    for (const BodyShapeOf<ex>& other : geometry_.shapes) {
      if (other.name == shape.name)
        throw InputError(place_of(field.name(), "name"), shape.name, "a name that no other shape has is required");
    }
    shape.kind = *find(kind_names(), field.at("kind").text());
    shape.body = body_number(field, "body");
    if (const std::size_t n = n_sizes(shape.kind, geometry_.in_space); n > 0) {
      const Field size = field.at("size");
      shape.size = vector(size, n);
      for (std::size_t k = 0; k < n; ++k) require_not_negative(size.at(k), shape.size[k]);
    }
    if (shape.kind == ShapeKind::polygon)
      read_corners(field, shape);
    else if (field.has("corners") || field.has("open"))
      throw InputError(place_of(field.name(), "kind"), field.at("kind").text(), "only a polygon has corners");
    if (field.has("position")) shape.position = vector(field.at("position"), dimension_);
    if (field.has("angles")) {
      const auto angles = field.at("angles").expressions(geometry_.in_space ? 3 : 1, constants_);
      std::ranges::copy(angles, geometry_.in_space ? shape.angles.begin() : shape.angles.begin() + 2);
    }
    if (shape.body >= 0 && geometry_.bodies[static_cast<std::size_t>(shape.body)].rotation == BodyRotation::spin &&
        (shape.kind != ShapeKind::sphere ||
         !std::ranges::all_of(shape.position, [](const ex& x) { return x.is_zero(); })))
      throw InputError(place_of(field.name(), "kind"), field.at("kind").text(),
                       "a body with rotation spin may carry only spheres about its centre");
    geometry_.add_shape(std::move(shape));
  }

  void read_corners(const Field& field, BodyShapeOf<ex>& shape) const {
    if (geometry_.in_space)
      throw InputError(place_of(field.name(), "kind"), "polygon", "a scene in the plane is required");
    const Field corners = field.at("corners");
    shape.is_open = field.has("open") && field.at("open").value().get<bool>();
    const std::size_t n = corners.size(), least = shape.is_open ? 2 : 3;
    if (n < least)
      throw InputError(corners.name() + ", number of entries", static_cast<double>(n),
                       fmt::format("at least {} are required", least));
    for (std::size_t i = 0; i < n; ++i) shape.corners.push_back(vector(corners.at(i), 2));
    const auto face = [&](std::size_t i) {
      const auto &a = shape.corners[i % n], &b = shape.corners[(i + 1) % n];
      return std::pair(model_.number(b[0] - a[0]), model_.number(b[1] - a[1]));
    };
    double turned = 0;  // in all [rad]
    int left = 0, right = 0;
    const std::size_t n_faces = shape.is_open ? n - 1 : n, n_turns = shape.is_open ? n - 2 : n;
    for (std::size_t i = 0; i < n_faces; ++i) {
      const auto [x, y] = face(i);
      if (!(std::hypot(x, y) > 0))
        throw InputError(corners.at((i + 1) % n).name(), corners.at((i + 1) % n).value().dump(),
                         "a corner other than the one before is required");
      if (i >= n_turns) continue;
      const auto [x_2, y_2] = face(i + 1);
      const double turn = std::atan2(x * y_2 - y * x_2, x * x_2 + y * y_2);
      ++(turn > 0 ? left : right);
      turned += turn;
    }
    const bool is_convex = right == 0 && turned < 7;  // once around is 2 pi
    if (!is_convex && !(shape.is_open && left == 0))
      throw InputError(corners.name(), corners.value().dump(),
                       shape.is_open ? "turns to one side only are required"
                                     : "the corners of a convex polygon, counter-clockwise, are required");
    shape.is_concave = !is_convex;
  }

  int body_number(const Field& field, const char* key) const {
    if (!field.has(key)) return -1;
    return number_of(geometry_.bodies, field.at(key), "body");
  }

 public:
  /// The index of the object whose name is in the `field`.
  static int number_of(const auto& list, const Field& field, const std::string& kind) {
    std::vector<std::string> known;
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (list[i].name == field.text()) return static_cast<int>(i);
      known.push_back(list[i].name);
    }
    throw_unknown_name(fmt::format("{} in {}", kind, field.name()), field.text(), known);
  }

 private:
  /// `n` formulas of the parameters.
  std::array<ex, 3> vector(const Field& field, std::size_t n) const {
    std::array<ex, 3> numbers{};
    std::ranges::copy(field.expressions(n, constants_), numbers.begin());
    return numbers;
  }

  std::array<PoseEntryOf<ex>, 3> pose(const Field& field, std::size_t n) const {
    std::array<PoseEntryOf<ex>, 3> entries;
    const auto formulas = field.expressions(n, in_q_);
    for (std::size_t i = 0; i < n; ++i) {
      entries[i].offset = formulas[i];
      for (std::size_t k = 0; k < model_.q.size(); ++k) {
        if (!formulas[i].has(model_.q[k])) continue;
        if (entries[i].coordinate < 0) {
          entries[i].coordinate = static_cast<int>(k);
          entries[i].offset = (formulas[i] - model_.q[k]).expand();
        }
        if (entries[i].offset.has(model_.q[k]))
          throw InputError(field.at(i).name(), field.at(i).text(),
                           "q[k], q[k] + a constant, or a constant is required");
      }
    }
    return entries;
  }

  void require_not_negative(const Field& field, const ex& value) const {
    if (const double number = model_.number(value); !(number >= 0))
      throw InputError(field.name(), number, "a number >= 0 is required");
  }

  Field field_;
  const SymbolicModel& model_;
  const ExpressionNames &constants_, &in_q_;
  GeometryOf<ex> geometry_;
  std::size_t dimension_ = 2;
};

}  // namespace

GeometryOf<ex> read_geometry(const Field& field, const SymbolicModel& model, const ExpressionNames& constants,
                             const ExpressionNames& in_q) {
  return GeometryReader(field, model, constants, in_q).read();
}

ShapePair read_pair(const Field& field, const GeometryOf<ex>& geometry, int contact) {
  const Field shapes = field.at("shapes");
  shapes.require_size(2);
  ShapePair pair{.contact = contact,
                 .first = GeometryReader::number_of(geometry.shapes, shapes.at(std::size_t{0}), "shape"),
                 .second = GeometryReader::number_of(geometry.shapes, shapes.at(1), "shape")};
  const auto& first = geometry.shapes[static_cast<std::size_t>(pair.first)];
  const auto& second = geometry.shapes[static_cast<std::size_t>(pair.second)];
  if (first.kind == ShapeKind::capsule)
    throw InputError(shapes.at(std::size_t{0}).name(), first.name,
                     "a sphere, a box or a half-space is required as the first");
  if (second.kind == ShapeKind::half_space)
    throw InputError(shapes.at(1).name(), second.name, "a half-space must be the first of two shapes");
  if (second.kind == ShapeKind::polygon) {
    const Field corner = field.at("corner");
    corner.require_size(1);
    pair.corner = corner.at(std::size_t{0}).value().get<int>();
    if (pair.corner < 0 || pair.corner >= std::ssize(second.corners))
      throw InputError(corner.name(), pair.corner,
                       fmt::format("the number of a corner, from 0 to {}, is required", second.corners.size() - 1));
    return pair;
  }
  const std::size_t n = n_signs(second.kind, geometry.in_space);
  if (field.has("corner")) {
    const Field corner = field.at("corner");
    corner.require_size(n);
    pair.corner = 0;
    for (std::size_t k = 0; k < n; ++k) {
      const int sign = corner.at(k).value().get<int>();
      if (sign != 1 && sign != -1) throw InputError(corner.at(k).name(), sign, "-1 or 1 is required");
      pair.corner |= (sign > 0 ? 1 : 0) << k;
    }
    return pair;
  }
  const auto turns = [&](const BodyShapeOf<ex>& shape) {
    return shape.body >= 0 && geometry.bodies[static_cast<std::size_t>(shape.body)].rotation != BodyRotation::none;
  };
  if (n > 0 && (first.kind == ShapeKind::sphere || first.kind == ShapeKind::polygon || turns(first) || turns(second)))
    throw InputError(
        place_of(field.name(), "corner") +
        ": this field is missing; without it, a box or a capsule must not turn relative to the plane that it touches");
  return pair;
}

ordered_json geometry_json(const SymbolicModel& model) {
  const GeometryOf<ex>& geometry = *model.geometry;
  const std::size_t dimension = geometry.in_space ? 3 : 2;
  const auto texts = [](const std::array<ex, 3>& numbers, std::size_t n) {
    ordered_json list = ordered_json::array();
    for (std::size_t k = 0; k < n; ++k) list.push_back(expression_text(numbers[k]));
    return list;
  };
  const auto pose = [&](const std::array<PoseEntryOf<ex>, 3>& entries, std::size_t n) {
    std::array<ex, 3> sums;
    for (std::size_t k = 0; k < n; ++k)
      sums[k] = entries[k].coordinate < 0
                    ? entries[k].offset
                    : ex(model.q[static_cast<std::size_t>(entries[k].coordinate)] + entries[k].offset);
    return texts(sums, n);
  };
  const auto are_zero = [](const std::array<ex, 3>& numbers) {
    return std::ranges::all_of(numbers, [](const ex& x) { return x.is_zero(); });
  };
  const auto put = [&](ordered_json& entry, const char* key, const std::array<ex, 3>& numbers) {
    if (!are_zero(numbers)) entry[key] = texts(numbers, dimension);
  };
  const auto put_body = [&](ordered_json& entry, const char* key, int body) {
    if (body >= 0) entry[key] = geometry.bodies[static_cast<std::size_t>(body)].name;
  };
  // About z in the plane.
  const auto put_turn = [&](ordered_json& entry, const char* key, const std::array<ex, 3>& numbers) {
    if (are_zero(numbers)) return;
    entry[key] = geometry.in_space ? texts(numbers, 3) : texts({numbers[2], 0, 0}, 1);
  };

  ordered_json json;
  if (geometry.in_space) json["in_space"] = true;
  put(json, "gravity", geometry.gravity);
  json["bodies"] = json["shapes"] = ordered_json::array();
  for (const auto& body : geometry.bodies) {
    ordered_json entry = {{"name", body.name}, {"mass", expression_text(body.mass)}};
    put_turn(entry, "inertia", body.inertia);
    put_body(entry, "parent", body.parent);
    entry["position"] = pose(body.position, dimension);
    if (body.rotation != BodyRotation::none) {
      entry["rotation"] = name_in(rotation_names(), body.rotation);
      entry["angles"] = pose(body.angles, n_angles(body.rotation));
    }
    put(entry, "centre_from_pivot", body.centre_from_pivot);
    json["bodies"].push_back(entry);
  }
  for (const auto& shape : geometry.shapes) {
    ordered_json entry = {{"name", shape.name}, {"kind", name_in(kind_names(), shape.kind)}};
    put_body(entry, "body", shape.body);
    if (const std::size_t n = n_sizes(shape.kind, geometry.in_space); n > 0) entry["size"] = texts(shape.size, n);
    for (const auto& corner : shape.corners) entry["corners"].push_back(texts(corner, 2));
    if (shape.is_open) entry["open"] = true;
    put(entry, "position", shape.position);
    put_turn(entry, "angles", shape.angles);
    json["shapes"].push_back(entry);
  }
  for (const auto& link : geometry.links) {
    ordered_json entry = ordered_json::object();
    put_body(entry, "first", link.first);
    put_body(entry, "second", link.second);
    put(entry, "first_point", link.first_point);
    put(entry, "second_point", link.second_point);
    json["links"].push_back(entry);
  }
  return json;
}

void add_pair(ordered_json& contact, const ShapePair& pair, const GeometryOf<ex>& geometry) {
  const auto& first = geometry.shapes[static_cast<std::size_t>(pair.first)];
  const auto& second = geometry.shapes[static_cast<std::size_t>(pair.second)];
  contact["shapes"] = {first.name, second.name};
  if (pair.corner < 0) return;
  if (second.kind == ShapeKind::polygon) {
    contact["corner"] = {pair.corner};
    return;
  }
  for (std::size_t k = 0; k < n_signs(second.kind, geometry.in_space); ++k)
    contact["corner"].push_back((pair.corner >> k & 1) != 0 ? 1 : -1);
}

std::optional<std::pair<double, double>> difference_near_start(const SymbolicModel& model, const ex& a, const ex& b,
                                                               double rate) {
  for (const double shift : {0.0, 0.137, -0.0731}) {
    std::vector<StraightLineProgram::Constant> values = model.constants();
    values.push_back({model.t, rate * shift});
    for (std::size_t k = 0; k < model.q.size(); ++k)
      values.push_back({model.q[k], model.number(model.q0[k]) + shift * (1 + 0.3 * static_cast<double>(k))});
    double pair[2];
    StraightLineProgram({a, b}, {}, values).evaluate({}, pair);
    // rounding of two forms of one formula; a gap at q0 is a difference of lengths of about a metre
    const double allowed = 1e-10 * (std::abs(pair[0]) + std::abs(pair[1])) + (rate == 0 ? 1e-12 : 0);
    if (!(std::abs(pair[0] - pair[1]) <= allowed)) return std::pair(pair[0], pair[1]);
  }
  return std::nullopt;
}

}  // namespace ricochet
