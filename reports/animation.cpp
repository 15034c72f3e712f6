#include "reports/animation.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

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

const char* const kStyle = R"(
figure.motion[hidden] { display: none; }
figure.motion svg { display: block; border: 1px solid #d0d0d0; box-sizing: border-box; }
figure.motion .player { display: grid; grid-template-columns: auto 1fr auto auto; gap: .7rem; align-items: end; margin-top: .4rem; }
figure.motion button { width: 4.2rem; }
figure.motion .line { position: relative; padding-top: 10px; }
figure.motion .line input { width: 100%; margin: 0; display: block; }
figure.motion .line i { position: absolute; top: 0; width: 2px; margin-left: -1px; height: 10px; background: #ae017e; }
figure.motion output { font-variant-numeric: tabular-nums; min-width: 4rem; text-align: right; }
)";

// Places are linear between samples, forces those of the last sample.
const char* const kScript = R"js(
for (const figure of document.querySelectorAll("figure.motion")) {
  const data = JSON.parse(figure.querySelector("script").textContent);
  const svg = figure.querySelector("svg"), button = figure.querySelector("button");
  const slider = figure.querySelector("input"), clock = figure.querySelector("output");
  const speed = figure.querySelector("select"), ring = figure.querySelector(".impact");
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const FLASH = 0.25;  // seconds
  const names = { circle: ["cx", "cy"], rect: ["x", "y"], line: ["x1", "y1", "x2", "y2"] };
  for (const s of data.shapes) s.element = svg.querySelector(`[data-shape="${s.shape}"]`);
  data.arrows.forEach((a, k) => { a.element = svg.querySelector(`[data-arrow="${k}"]`); });

  function sampleBefore(t) {
    let low = 0, high = data.t.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (data.t[middle] <= t) low = middle; else high = middle;
    }
    return low;
  }
  const between = (a, b, part) => a.map((x, k) => x + part * (b[k] - x));
  function arrowPath(x, y, dx, dy) {
    const length = Math.hypot(dx, dy);
    if (length < 1.5) return "";
    const head = Math.min(7, length), nx = dx / length, ny = dy / length, half = 0.45 * head;
    const tx = x + dx, ty = y + dy, bx = tx - head * nx, by = ty - head * ny;
    return `M${x},${y}L${bx},${by}M${tx},${ty}L${bx - half * ny},${by + half * nx}` +
           `L${bx + half * ny},${by - half * nx}Z`;
  }
  function flash(t, k, part) {
    ring.setAttribute("visibility", "hidden");
    if (still.matches) return;
    for (const impact of data.impacts) {
      const arrow = data.arrows.find(a => a.contact === impact.contact), age = (t - impact.t) / FLASH;
      if (!arrow || age < 0 || age > 1) continue;
      const [cx, cy] = between(arrow.at[k], arrow.at[k + 1], part);
      const look = { cx, cy, r: 6 + 16 * age, opacity: 1 - age, visibility: "visible" };
      for (const name in look) ring.setAttribute(name, look[name]);
    }
  }
  function show(t) {
    const k = sampleBefore(t);
    const part = Math.min(1, Math.max(0, (t - data.t[k]) / (data.t[k + 1] - data.t[k])));
    for (const s of data.shapes) {
      const place = between(s.at[k], s.at[k + 1], part);
      names[s.element.tagName].forEach((name, i) => s.element.setAttribute(name, place[i]));
    }
    for (const a of data.arrows) {
      const [x, y] = between(a.at[k], a.at[k + 1], part), force = a.at[part === 1 ? k + 1 : k];
      a.element.setAttribute("d", arrowPath(x, y, force[2], force[3]));
    }
    flash(t, k, part);
    slider.value = t;
    clock.textContent = t.toFixed(2) + " s";
  }

  let t = 0, last = null;  // last: when the picture before this one was shown, while it plays
  function stop() { last = null; button.textContent = "Play"; }
  function play(now) {
    if (last === null) return;
    t = Math.min(data.T, t + Math.max(0, now - last) / 1000 * Number(speed.value));
    last = now;
    show(t);
    if (t < data.T) requestAnimationFrame(play); else stop();
  }
  button.addEventListener("click", () => {
    if (last !== null) return stop();
    if (t >= data.T) t = 0;
    button.textContent = "Pause";
    last = performance.now();
    requestAnimationFrame(play);
  });
  slider.addEventListener("input", () => { stop(); t = Number(slider.value); show(t); });
  figure.hidden = false;
  show(0);
}
)js";

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

std::string animation_style() {
  return kStyle;
}

std::string animation_script() {
  return fmt::format("<script>{}</script>\n", kScript);
}

}  // namespace ricochet
