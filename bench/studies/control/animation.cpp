#include "bench/studies/control/animation.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "reports/markup.h"
#include "reports/table.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr double kWidth = 760, kHeight = 440;  // at most [pixels]

double rounded(double x) {
  return std::round(x * 100) / 100;
}

/// Instants, and in pixels the numbers of what moves: shapes as in picture.h, arrows as start and extent.
json data_of(const ControlRun& run, const PictureView& view) {
  const auto& frames = run.picture.frames;
  json t = json::array(), shapes = json::array(), arrows = json::array(), impacts = json::array();
  for (const auto& frame : frames) t.push_back(std::round(frame.t * 1e5) / 1e5);
  for (std::size_t k = 0; k < frames.front().shapes.size(); ++k) {
    json at = json::array();
    bool moves = false;
    for (const auto& frame : frames) {
      const Shape& shape = frame.shapes[k];
      const auto& [x, y, a, b] = shape.numbers;
      moves = moves || shape.numbers != frames.front().shapes[k].numbers;
      switch (shape.kind) {
        case Shape::Kind::circle:
          at.push_back({rounded(view.x(x)), rounded(view.y(y))});
          break;
        case Shape::Kind::box:
          at.push_back({rounded(view.x(x - a / 2)), rounded(view.y(y + b / 2))});
          break;
        case Shape::Kind::segment:
        case Shape::Kind::ground:
          at.push_back({rounded(view.x(x)), rounded(view.y(y)), rounded(view.x(a)), rounded(view.y(b))});
      }
    }
    if (moves) shapes.push_back({{"shape", k}, {"at", at}});
  }
  for (std::size_t k = 0; k < frames.front().arrows.size(); ++k) {
    json at = json::array();
    for (const auto& frame : frames) {
      const Arrow& arrow = frame.arrows[k];
      at.push_back({rounded(view.x(arrow.x)), rounded(view.y(arrow.y)), rounded(view.per_newton * arrow.F_x),
                    rounded(-view.per_newton * arrow.F_y)});
    }
    arrows.push_back({{"contact", frames.front().arrows[k].contact}, {"at", at}});
  }
  for (const auto& impact : run.impacts) impacts.push_back({{"t", impact.t}, {"contact", impact.contact}});
  return {{"T", run.T}, {"t", t}, {"shapes", shapes}, {"arrows", arrows}, {"impacts", impacts}};
}

/// Marks of the impacts above the slider, whose thumb is 16 pixels wide.
std::string marks(const ControlRun& run) {
  std::string text;
  for (const auto& impact : run.impacts)
    text += fmt::format("<i style=\"left:calc(8px + {:.4f} * (100% - 16px))\" title=\"{:.3f} s, {}: {:.3g} N s\"></i>",
                        impact.t / run.T, impact.t, escape_html(run.contacts[static_cast<std::size_t>(impact.contact)]),
                        impact.Lambda_n);
  return text;
}

// Places are linear between samples, forces those of the last sample.

}  // namespace

std::string animation_html(const ControlRun& run) {
  PictureView view = view_of(run.picture, kWidth);
  if (view.height > kHeight) view = view_of(run.picture, kWidth * kHeight / view.height);
  const std::string ring =
      "<circle class=\"impact\" fill=\"none\" stroke=\"#ae017e\" stroke-width=\"3\" visibility=\"hidden\"/>";
  return fmt::format(
      "<figure class=\"motion\" style=\"max-width: {0:.0f}px\" hidden>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
      "viewBox=\"0 0 {0:.1f} {1:.1f}\" "
      "role=\"img\" aria-label=\"{2}: the motion\">{3}{4}</svg>\n"
      "<div class=\"player\"><button type=\"button\">Play</button><div class=\"line\">{5}<input type=\"range\" "
      "aria-label=\"time\" min=\"0\" max=\"{6:.10g}\" step=\"any\" value=\"0\"></div><output>0.00 s</output>"
      "<select aria-label=\"speed\"><option value=\"1\">1 ×</option><option value=\"0.5\">½ ×</option>"
      "<option value=\"0.25\">¼ ×</option></select></div>\n"
      "<figcaption>{2}: the motion that {7} claims. Marks on the time line: impacts.</figcaption>\n"
      "<script type=\"application/json\">{8}</script></figure>\n",
      view.width, view.height, escape_html(run.title), svg_of(run.picture.frames.front(), view), ring, marks(run),
      run.T, escape_html(run.discretisation), data_of(run, view).dump());
}

}  // namespace ricochet
