#include "reports/motion_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/input_error.h"
#include "problems/named_values.h"
#include "reports/gnuplot.h"

namespace ricochet {
namespace {

using nlohmann::json;

// Parts of the width of a picture.
constexpr double kLongestArrow = 0.16;
constexpr double kMargin = 0.04;
constexpr double kNoArrow = 1.5;  // shorter ones are not drawn [pixels]

const Names<Shape::Kind>& kind_names() {
  static const Names<Shape::Kind> names = {{"circle", Shape::Kind::circle},
                                           {"box", Shape::Kind::box},
                                           {"segment", Shape::Kind::segment},
                                           {"ground", Shape::Kind::ground}};
  return names;
}

std::string name_of(Shape::Kind kind) {
  return std::ranges::find(kind_names(), kind, &std::pair<std::string, Shape::Kind>::second)->first;
}

struct Box {
  double left = std::numeric_limits<double>::infinity(), right = -left, bottom = left, top = -left;

  void add(double x, double y) {
    left = std::min(left, x);
    right = std::max(right, x);
    bottom = std::min(bottom, y);
    top = std::max(top, y);
  }
  void add(const Shape& shape) {
    const auto& [x, y, a, b] = shape.numbers;
    if (shape.kind == Shape::Kind::ground) {
      bottom = std::min(bottom, y);
      return;
    }
    const bool is_segment = shape.kind == Shape::Kind::segment, is_circle = shape.kind == Shape::Kind::circle;
    const double half_width = is_segment ? 0 : is_circle ? a : a / 2;
    const double half_height = is_segment ? 0 : is_circle ? a : b / 2;
    add(x - half_width, y - half_height);
    add(x + half_width, y + half_height);
    if (is_segment) add(a, b);
  }
};

std::string style_of(const Shape& shape) {
  const std::string color = shape.body == 0 ? "#404040" : curve_color(static_cast<std::size_t>(shape.body - 1));
  if (shape.kind == Shape::Kind::segment)
    return fmt::format("stroke=\"{}\" stroke-width=\"3\" stroke-linecap=\"round\"{}", color,
                       shape.is_goal ? " stroke-opacity=\"0.2\"" : "");
  if (shape.is_goal) return fmt::format("fill=\"{}\" fill-opacity=\"0.16\"", color);
  return fmt::format("fill=\"{0}\" fill-opacity=\"0.9\" stroke=\"{0}\" stroke-width=\"1.2\"", color);
}

std::string svg_of(const Shape& shape, const PictureView& view, const std::string& id) {
  const auto& [x, y, a, b] = shape.numbers;
  const std::string style = style_of(shape);
  switch (shape.kind) {
    case Shape::Kind::circle:
      return fmt::format("<circle {} {} cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\"/>", id, style, view.x(x), view.y(y),
                         view.scale * a);
    case Shape::Kind::box:
      return fmt::format("<rect {} {} x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\"/>", id, style,
                         view.x(x - a / 2), view.y(y + b / 2), view.scale * a, view.scale * b);
    case Shape::Kind::segment:
      return fmt::format("<line {} {} x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\"/>", id, style, view.x(x),
                         view.y(y), view.x(a), view.y(b));
    case Shape::Kind::ground:
      return fmt::format(
          "<path {3} fill=\"#e9e9e9\" d=\"M0,{0:.2f}H{1:.2f}V{2:.2f}H0Z\"/>"
          "<path stroke=\"#808080\" d=\"M0,{0:.2f}H{1:.2f}\"/>",
          view.y(y), view.width, view.height, id);
  }
  return "";
}

/// A shaft and a head.
std::string path_of(const Arrow& arrow, const PictureView& view) {
  const double dx = view.per_newton * arrow.F_x, dy = -view.per_newton * arrow.F_y, length = std::hypot(dx, dy);
  if (!(length >= kNoArrow)) return "";
  const double head = std::min(7.0, length), n_x = dx / length, n_y = dy / length;
  const double x = view.x(arrow.x), y = view.y(arrow.y), tip_x = x + dx, tip_y = y + dy;
  const double neck_x = tip_x - head * n_x, neck_y = tip_y - head * n_y, half = 0.45 * head;
  return fmt::format("M{:.2f},{:.2f}L{:.2f},{:.2f}M{:.2f},{:.2f}L{:.2f},{:.2f}L{:.2f},{:.2f}Z", x, y, neck_x, neck_y,
                     tip_x, tip_y, neck_x - half * n_y, neck_y + half * n_x, neck_x + half * n_y, neck_y - half * n_x);
}

}  // namespace

const MotionPicture::Frame& MotionPicture::at(double t) const {
  return *std::ranges::min_element(frames, {}, [t](const Frame& frame) { return std::abs(frame.t - t); });
}

void to_json(json& j, const MotionPicture& picture) {
  json shapes = json::array(), arrows = json::array(), frames = json::array();
  if (!picture.empty()) {
    for (const auto& shape : picture.frames.front().shapes)
      shapes.push_back({{"kind", name_of(shape.kind)}, {"body", shape.body}, {"is_goal", shape.is_goal}});
    for (const auto& arrow : picture.frames.front().arrows) arrows.push_back({{"contact", arrow.contact}});
  }
  for (const auto& frame : picture.frames) {
    json places = json::array(), forces = json::array();
    for (const auto& shape : frame.shapes) places.push_back(shape.numbers);
    for (const auto& arrow : frame.arrows) forces.push_back({arrow.x, arrow.y, arrow.F_x, arrow.F_y});
    frames.push_back({{"t", frame.t}, {"shapes", places}, {"arrows", forces}});
  }
  j = {{"shapes", shapes}, {"arrows", arrows}, {"frames", frames}};
}

void from_json(const json& j, MotionPicture& picture) {
  picture = {};
  const json &shapes = j.at("shapes"), &arrows = j.at("arrows");
  for (const auto& entry : j.at("frames")) {
    MotionPicture::Frame frame;
    entry.at("t").get_to(frame.t);
    for (std::size_t k = 0; k < shapes.size(); ++k) {
      const Shape::Kind* kind = find(kind_names(), shapes[k].at("kind").get<std::string>());
      if (!kind) throw InputError("kind of a shape", shapes[k]["kind"].dump(), "circle, box, segment or ground");
      frame.shapes.push_back({*kind, shapes[k].at("body"), shapes[k].at("is_goal"), entry.at("shapes").at(k)});
    }
    for (std::size_t k = 0; k < arrows.size(); ++k) {
      const json& at = entry.at("arrows").at(k);
      frame.arrows.push_back({arrows[k].at("contact"), at.at(0), at.at(1), at.at(2), at.at(3)});
    }
    picture.frames.push_back(std::move(frame));
  }
}

PictureView view_of(const MotionPicture& picture, double width) {
  Box box;
  PictureView view;
  for (const auto& frame : picture.frames) {
    for (const auto& shape : frame.shapes) box.add(shape);
    for (const auto& arrow : frame.arrows)
      view.largest_force = std::max(view.largest_force, std::hypot(arrow.F_x, arrow.F_y));
  }
  const double margin = kMargin * (box.right - box.left);
  view.left = box.left - margin;
  view.top = box.top + margin;
  view.width = width;
  view.scale = width / (box.right - box.left + 2 * margin);
  view.height = view.scale * (box.top - box.bottom + 2 * margin);
  if (view.largest_force > 0) view.per_newton = kLongestArrow * width / view.largest_force;
  return view;
}

std::string svg_of(const MotionPicture::Frame& frame, const PictureView& view) {
  std::string svg;
  for (std::size_t k = 0; k < frame.shapes.size(); ++k)
    svg += svg_of(frame.shapes[k], view, fmt::format("data-shape=\"{}\"", k));
  for (std::size_t k = 0; k < frame.arrows.size(); ++k) {
    const std::string color = frame.arrows[k].contact < 0 ? "#000000" : "#ae017e";
    svg += fmt::format("<path data-arrow=\"{0}\" fill=\"{1}\" stroke=\"{1}\" stroke-width=\"1.6\" d=\"{2}\"/>", k,
                       color, path_of(frame.arrows[k], view));
  }
  return svg;
}

std::string impact_ring(const MotionPicture::Frame& frame, const PictureView& view, int contact) {
  const auto arrow = std::ranges::find(frame.arrows, contact, &Arrow::contact);
  if (arrow == frame.arrows.end()) return "";
  return fmt::format(
      "<circle class=\"impact\" fill=\"none\" stroke=\"#ae017e\" stroke-width=\"2\" cx=\"{:.2f}\" cy=\"{:.2f}\" "
      "r=\"9\"/>",
      view.x(arrow->x), view.y(arrow->y));
}

}  // namespace ricochet
