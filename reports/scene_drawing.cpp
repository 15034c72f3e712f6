#include "reports/scene_drawing.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "problems/geometry_kinematics.h"
#include "problems/input_error.h"
#include "reports/gnuplot.h"
#include "reports/markup.h"

namespace ricochet {
namespace {

constexpr double kWidth = 720, kHeight = 460;   // at most, without the time line [pixels]
constexpr double kTimeLine = 34;                // its height [pixels]
constexpr double kSceneMargin = 0.06;           // of the larger side of what is drawn
constexpr double kTextWidth = 330;              // room for the words below the time line [pixels]
constexpr double kNarrowest = 0.5;              // of the height
constexpr double kDot = 4;                      // radius of a body without size, half width of a thin one [pixels]
constexpr double kFramesPerSecond = 30;         // of the animation
constexpr double kShortest = 3, kLongest = 12;  // seconds that an animation takes
constexpr double kPause = 0.8;                  // seconds that it rests at the end
constexpr double kAzimuth = -1.05, kElevation = 0.35;  // where space is seen from [rad]

using Point = std::array<double, 2>;

/// From space onto paper, in metres.
class Projection {
 public:
  Projection(const Geometry& geometry) {
    if (geometry.in_space) {
      const double s_a = std::sin(kAzimuth), c_a = std::cos(kAzimuth), s_e = std::sin(kElevation),
                   c_e = std::cos(kElevation);
      axes_ = {{{-s_a, c_a, 0}, {-s_e * c_a, -s_e * s_a, c_e}, {c_e * c_a, c_e * s_a, s_e}}};
    }
    upright_ = upright(geometry);
  }

  Point operator()(const Vector3<double>& x) const {
    const Vector3<double> seen = times(axes_, times(upright_, x));
    return {seen[0], seen[1]};
  }
  /// Of a direction, after down has become down.
  Vector3<double> turned(const Vector3<double>& direction) const { return times(upright_, direction); }

 private:
  /// The least turn that makes gravity point down: I + [w] + [w]^2 / (1 + c) with w = g x d, c = g'd.
  static Matrix3<double> upright(const Geometry& geometry) {
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

  Matrix3<double> axes_ = identity<double>(), upright_;
};

/// What is drawn, in metres on paper.
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
};

struct PaperBox {
  double left = std::numeric_limits<double>::infinity(), right = -left, bottom = left, top = -left;

  void add(const Point& x, double radius = 0) {
    left = std::min(left, x[0] - radius);
    right = std::max(right, x[0] + radius);
    bottom = std::min(bottom, x[1] - radius);
    top = std::max(top, x[1] + radius);
  }
};

/// The marks of a scene at any q: their number, kinds and styles do not depend on it.
class SceneMarks {
 public:
  SceneMarks(const Problem& problem, const std::vector<Vector>& states)
      : problem_(problem), geometry_(*problem.info().geometry), project_(geometry_) {
    for (const Vector& q : states) {
      for (int i = 0; i < static_cast<int>(geometry_.bodies.size()); ++i) {
        const Vector3<double> centre = motion_of<double>(geometry_, i, {q.begin(), q.end()}).centre;
        if (geometry_.in_space) places_.push_back(centre);
      }
    }
    for (const BodyShape& shape : geometry_.shapes) {
      if (shape.body >= 0) extent_ = std::max({extent_, shape.size[0], shape.size[1], shape.size[2]});
    }
  }

  std::vector<Mark> at(const Vector& q) const {
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
      solids.push_back({Mark::Kind::line, {a, b}, 0, "fill=\"none\" stroke=\"#909090\" stroke-dasharray=\"5 3\""});
    }
    add_shadows(x, solids);
    solids.insert(solids.end(), marks.begin(), marks.end());
    return solids;
  }

  /// Room for the bodies, and for where they start from each surface.
  void add_to(PaperBox& box, const Vector& q, bool is_first) const {
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

  /// Where the centres of the bodies are.
  std::vector<Point> centres(const Vector& q) const {
    std::vector<Point> points;
    for (int i = 0; i < static_cast<int>(geometry_.bodies.size()); ++i)
      points.push_back(project_(motion_of<double>(geometry_, i, {q.begin(), q.end()}).centre));
    return points;
  }

 private:
  bool is_surface(int shape) const {
    const BodyShape& s = geometry_.shapes[static_cast<std::size_t>(shape)];
    return s.kind == ShapeKind::half_space && s.body < 0;
  }
  bool is_paired(int shape) const {
    return std::ranges::any_of(geometry_.pairs,
                               [&](const ShapePair& pair) { return pair.first == shape || pair.second == shape; });
  }
  /// A geometry for drawings alone has no pairs: of a surface, the point that a body is nearest to.
  void add_nearest_to(int surface, const std::vector<double>& x, PaperBox& box) const {
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

  std::string color_of(const BodyShape& shape) const {
    return shape.body < 0 ? "#808080" : curve_color(static_cast<std::size_t>(shape.body));
  }

  void add_shape(const BodyShape& shape, const std::vector<double>& x, std::vector<Mark>& marks) const {
    const BodyMotion<double> motion = motion_of(geometry_, shape.body, x);
    const Matrix3<double> R = times(motion.R, geometry_detail::cardan(shape.angles));
    const Vector3<double> centre = motion.point(shape.position);
    const std::string color = color_of(shape);
    const std::string filled = fmt::format("fill=\"{0}\" fill-opacity=\"0.85\" stroke=\"{0}\"", color);
    const auto place = [&](double a, double b, double c) {
      return project_(sum(centre, times(R, Vector3<double>{a, b, c})));
    };
    const auto& [a, b, c] = shape.size;
    switch (shape.kind) {
      case ShapeKind::sphere: {
        marks.push_back({Mark::Kind::disc, {project_(centre)}, a, filled});
        const bool shows_turn = shape.body >= 0 && shape.position == Vector3<double>{} &&
                                geometry_.bodies[static_cast<std::size_t>(shape.body)].rotation == BodyRotation::planar;
        if (shows_turn && a > 0)
          marks.push_back({Mark::Kind::line, {place(0, 0, 0), place(a, 0, 0)}, 0, "stroke=\"#ffffff\""});
        return;
      }
      case ShapeKind::capsule:
        marks.push_back({Mark::Kind::line,
                         {place(-b, 0, 0), place(b, 0, 0)},
                         std::max(a, 1e-9),
                         fmt::format("stroke=\"{}\" stroke-opacity=\"0.85\" stroke-linecap=\"round\"", color)});
        return;
      case ShapeKind::box:
        if (!geometry_.in_space) {
          marks.push_back(
              {Mark::Kind::polygon, {place(-a, -b, 0), place(a, -b, 0), place(a, b, 0), place(-a, b, 0)}, 0, filled});
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
                 fmt::format("fill=\"{0}\" fill-opacity=\"0.3\" stroke=\"{0}\" stroke-linejoin=\"round\"", color)});
          }
        }
        return;
      case ShapeKind::half_space:
        return;
    }
  }

  /// How far a surface that moves by itself has moved along its normal: what the gap of the geometry has too much.
  double shift_of(int shape, const Vector& q) const {
    if (problem_.info().clock < 0) return 0;
    for (const ShapePair& pair : geometry_.pairs) {
      if (pair.first != shape || !problem_.info().contacts[static_cast<std::size_t>(pair.contact)].is_moving) continue;
      return contact_of<double>(geometry_, pair, {q.begin(), q.end()}).gap - problem_.gap(q)[pair.contact];
    }
    return 0;
  }

  void add_half_space(int number, const Vector& q, std::vector<Mark>& marks) const {
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
                     {corner(patch.left, patch.bottom), corner(patch.right, patch.bottom),
                      corner(patch.right, patch.top), corner(patch.left, patch.top)},
                     0,
                     "fill=\"#ececec\" stroke=\"#808080\"",
                     true});
  }

  /// Of balls on the first horizontal floor: where they are in space.
  void add_shadows(const std::vector<double>& x, std::vector<Mark>& marks) const {
    if (!geometry_.in_space) return;
    for (const BodyShape& floor : geometry_.shapes) {
      if (floor.kind != ShapeKind::half_space || floor.body >= 0) continue;
      const Vector3<double> normal = column_of(geometry_detail::cardan(floor.angles), 2);
      if (project_.turned(normal)[2] < 1 - 1e-12) continue;
      for (const BodyShape& shape : geometry_.shapes) {
        if (shape.kind != ShapeKind::sphere || shape.body < 0) continue;
        const Vector3<double> c = motion_of(geometry_, shape.body, x).point(shape.position);
        const Vector3<double> below = difference(c, scaled(dot(difference(c, floor.position), normal), normal));
        marks.push_back(
            {Mark::Kind::shadow, {project_(below)}, shape.size[0], "fill=\"#000000\" fill-opacity=\"0.15\""});
      }
      return;
    }
  }

  const Problem& problem_;
  const Geometry& geometry_;
  Projection project_;
  std::vector<Vector3<double>> places_;
  double extent_ = 0;
};

/// Metres on paper to pixels.
struct View {
  double left, top, scale, width, height;

  View(const PaperBox& box) {
    double w = box.right - box.left, h = box.top - box.bottom;
    const double room = std::max({w, h, 1e-9});
    w = std::max(w, kNarrowest * room) + 2 * kSceneMargin * room;
    h = std::max(h, kNarrowest * room / 2) + 2 * kSceneMargin * room;
    scale = std::min(kWidth / w, kHeight / h);
    w = std::max(w, kTextWidth / scale);
    left = (box.left + box.right - w) / 2;
    top = (box.bottom + box.top + h) / 2;
    width = scale * w;
    height = scale * h;
  }
  Point operator()(const Point& x) const { return {scale * (x[0] - left), scale * (top - x[1])}; }
  std::string list(const std::vector<Point>& points) const {
    std::string text;
    for (const Point& point : points) {
      const auto [x, y] = (*this)(point);
      text += fmt::format("{}{:.2f},{:.2f}", text.empty() ? "" : " ", x, y);
    }
    return text;
  }
};

using Attributes = std::vector<std::pair<const char*, std::string>>;

const char* tag_of(const Mark& mark) {
  switch (mark.kind) {
    case Mark::Kind::disc:
      return "circle";
    case Mark::Kind::shadow:
      return "ellipse";
    case Mark::Kind::polygon:
    case Mark::Kind::solid:
      return "polygon";
    case Mark::Kind::line:
      return "line";
  }
  return "";
}

/// What says where a mark is.
Attributes places_of(const Mark& mark, const View& view) {
  const auto number = [](double x) { return fmt::format("{:.2f}", x); };
  const Point a = view(mark.points[0]);
  switch (mark.kind) {
    case Mark::Kind::disc:
    case Mark::Kind::shadow:
      return {{"cx", number(a[0])}, {"cy", number(a[1])}};
    case Mark::Kind::polygon:
      return {{"points", view.list(mark.points)}};
    case Mark::Kind::line: {
      const Point b = view(mark.points[1]);
      return {{"x1", number(a[0])}, {"y1", number(a[1])}, {"x2", number(b[0])}, {"y2", number(b[1])}};
    }
    case Mark::Kind::solid: {
      const double far = 2 * (view.width + view.height) / view.scale;
      const auto& [p, along, inwards] = std::tie(mark.points[0], mark.points[1], mark.points[2]);
      const auto corner = [&, &p = p, &along = along, &inwards = inwards](double s, double t) {
        return Point{p[0] + far * (s * along[0] + t * inwards[0]), p[1] + far * (s * along[1] + t * inwards[1])};
      };
      return {{"points", view.list({corner(-1, 0), corner(1, 0), corner(1, 1), corner(-1, 1)})}};
    }
  }
  return {};
}

/// What does not move.
std::string constants_of(const Mark& mark, const View& view) {
  const double radius = std::max(view.scale * mark.radius, kDot);
  switch (mark.kind) {
    case Mark::Kind::disc:
      return fmt::format("r=\"{:.2f}\"", radius);
    case Mark::Kind::shadow:
      return fmt::format("rx=\"{:.2f}\" ry=\"{:.2f}\"", radius, radius * std::sin(kElevation));
    case Mark::Kind::line:
      return fmt::format("stroke-width=\"{:.2f}\"",
                         mark.radius == 0 ? 1.6 : 2 * std::max(view.scale * mark.radius, kDot / 2));
    case Mark::Kind::polygon:
    case Mark::Kind::solid:
      return "";
  }
  return "";
}

/// An element whose attributes go through lists of values.
class Animation {
 public:
  Animation(double seconds) : seconds_(seconds) {}

  std::string element(const char* tag, const std::string& constants, const std::vector<Attributes>& frames) const {
    std::string first, changes;
    for (std::size_t k = 0; k < frames.front().size(); ++k) {
      const auto& [name, value] = frames.front()[k];
      first += fmt::format(" {}=\"{}\"", name, value);
      std::vector<std::string> values;
      for (const Attributes& frame : frames) values.push_back(frame[k].second);
      if (std::ranges::all_of(values, [&, &value = value](const auto& other) { return other == value; })) continue;
      changes += fmt::format("<animate attributeName=\"{}\" dur=\"{:.2f}s\" repeatCount=\"indefinite\" values=\"{}\"/>",
                             name, seconds_, fmt::join(values, ";"));
    }
    return fmt::format("<{0} {1}{2}>{3}</{0}>\n", tag, constants, first, changes);
  }

 private:
  double seconds_;
};

std::string time_line(const Solution& solution, double slower, const View& view, const Animation& animation,
                      const std::vector<double>& times) {
  const Motion& motion = solution.motion;
  const double y = view.height + 12, from = 14, to = view.width - 14;
  const auto at = [&](double t) { return from + (to - from) * (t - motion.begin()) / (motion.end() - motion.begin()); };
  std::string svg = fmt::format("<path stroke=\"#808080\" d=\"M{0:.2f},{2:.2f}H{1:.2f}\"/>\n", from, to, y);
  std::string marks;
  for (const Event& event : solution.events) {
    if (event.kind == EventKind::impact) marks += fmt::format("M{:.2f},{:.2f}v8", at(event.t), y - 4);
  }
  if (!marks.empty()) svg += fmt::format("<path stroke=\"#ae017e\" stroke-width=\"1.2\" d=\"{}\"/>\n", marks);
  std::vector<Attributes> frames;
  for (const double t : times) frames.push_back({{"cx", fmt::format("{:.2f}", at(t))}});
  svg += animation.element("circle", fmt::format("fill=\"#202020\" r=\"3.5\" cy=\"{:.2f}\"", y), frames);
  const std::string speed = slower > 1.05   ? fmt::format(", played {:.3g} times slower", slower)
                            : slower < 0.95 ? fmt::format(", played {:.3g} times faster", 1 / slower)
                                            : std::string();
  svg += fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" font-family=\"sans-serif\" font-size=\"11\" fill=\"#404040\">{:.4g} s{}{}</text>\n",
      from, y + 17, motion.end() - motion.begin(), speed, marks.empty() ? "" : "; marks: impacts");
  return svg;
}

}  // namespace

std::string scene_svg(const Problem& problem, const Solution& solution) {
  const ProblemInfo& info = problem.info();
  const Motion& motion = solution.motion;
  if (!info.geometry) throw InputError(fmt::format("problem {} states no geometry: there is nothing to draw", info.id));

  // Frames at equal distances, the last one held.
  std::vector<double> times;
  std::vector<Vector> states;
  double seconds = 0;
  if (motion.empty()) {
    states.push_back(info.q0);
  } else {
    const double length = motion.end() - motion.begin();
    seconds = std::clamp(length, kShortest, kLongest);
    const int n = static_cast<int>(std::lround(kFramesPerSecond * seconds));
    const int held = static_cast<int>(std::lround(kFramesPerSecond * kPause));
    Vector q, v;
    for (int k = 0; k <= n + held; ++k) {
      times.push_back(motion.begin() + length * std::min(k, n) / n);
      motion.at(std::min(times.back(), motion.end()), q, v, Motion::Side::before);
      states.push_back(q);
    }
    seconds += kPause;
  }

  const SceneMarks scene(problem, states);
  PaperBox box;
  for (std::size_t k = 0; k < states.size(); ++k) scene.add_to(box, states[k], k == 0);
  const View view(box);
  const Animation animation(seconds);
  const double height = view.height + (motion.empty() ? 0 : kTimeLine);
  // Sizes stand in styles, too: a page has one for all figures.
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.1f} {1:.1f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "style=\"max-width: {0:.0f}px\" role=\"img\">\n<title>{2}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n"
      "<svg width=\"{0:.1f}\" height=\"{3:.1f}\" style=\"width: {0:.1f}px; height: {3:.1f}px\">\n",
      view.width, height, escape_xml(info.title), view.height);

  std::vector<std::vector<Mark>> frames;
  for (const Vector& q : states) frames.push_back(scene.at(q));
  const auto add_mark = [&](std::size_t i) {
    std::vector<Attributes> places;
    for (const auto& frame : frames) places.push_back(places_of(frame[i], view));
    const Mark& mark = frames.front()[i];
    svg += animation.element(tag_of(mark), mark.style + " " + constants_of(mark, view), places);
  };
  std::size_t i = 0;
  for (; i < frames.front().size() && frames.front()[i].is_ground; ++i) add_mark(i);
  std::vector<std::vector<Point>> ways(info.geometry->bodies.size());
  for (const Vector& q : states) {
    const auto centres = scene.centres(q);
    for (std::size_t body = 0; body < ways.size(); ++body) ways[body].push_back(centres[body]);
  }
  for (std::size_t body = 0; body < ways.size() && !motion.empty(); ++body)
    svg += fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-opacity=\"0.45\" points=\"{}\"/>\n",
                       curve_color(body), view.list(ways[body]));
  for (; i < frames.front().size(); ++i) add_mark(i);
  svg += "</svg>\n";
  if (!motion.empty())
    svg += time_line(solution, (seconds - kPause) / (motion.end() - motion.begin()), view, animation, times);
  return svg + "</svg>\n";
}

}  // namespace ricochet
