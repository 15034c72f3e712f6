#include "reports/drawing/scene_drawing.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "problems/input_error.h"
#include "reports/curve_look.h"
#include "reports/drawing/scene_marks.h"
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
constexpr double kLongestArrow = 0.16;          // of the width
constexpr double kNoArrow = 1.5;                // shorter ones are not drawn [pixels]
constexpr double kFlash = 0.12;                 // part of the motion for which the ring of an impact is seen

/// Metres on paper to pixels.
struct View {
  double left, top, scale, width, height;

  View(const PaperBox& box, double most_width, double most_height, double least_width) {
    double w = box.right - box.left, h = box.top - box.bottom;
    const double room = std::max({w, h, 1e-9});
    w = std::max(w, kNarrowest * room) + 2 * kSceneMargin * room;
    h = std::max(h, kNarrowest * room / 2) + 2 * kSceneMargin * room;
    scale = std::min(most_width / w, most_height / h);
    w = std::max(w, least_width / scale);
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

/// Attributes of a mark that change with its position.
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

/// Attributes of a mark that stay constant.
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

/// Polygon of an arrow, of no size for a force too small to be seen.
std::string arrow_points(const ForceArrow& arrow, const View& view, double per_newton) {
  const auto [x, y] = view(arrow.from);
  const double dx = per_newton * arrow.force[0], dy = -per_newton * arrow.force[1], length = std::hypot(dx, dy);
  const bool is_seen = length >= kNoArrow;
  const double head = is_seen ? std::min(7.0, length) : 0, along_x = is_seen ? dx / length : 0,
               along_y = is_seen ? dy / length : 0;
  std::string text;
  const auto add = [&, &x = x, &y = y](double along, double beside) {
    text += fmt::format("{}{:.2f},{:.2f}", text.empty() ? "" : " ", x + along * along_x - beside * along_y,
                        y + along * along_y + beside * along_x);
  };
  const double neck = is_seen ? length - head : 0, thin = is_seen ? 0.8 : 0;
  add(0, thin);
  add(neck, thin);
  add(neck, 0.5 * head);
  add(neck + head, 0);
  add(neck, -0.5 * head);
  add(neck, -thin);
  add(0, -thin);
  return text;
}

std::string time_line(const DrawnMotion& motion, double slower, const View& view, const Animation& animation,
                      const std::vector<double>& times) {
  const double y = view.height + 12, from = 14, to = view.width - 14;
  const auto at = [&](double t) { return from + (to - from) * (t - motion.begin) / (motion.end - motion.begin); };
  std::string svg = fmt::format("<path stroke=\"#808080\" d=\"M{0:.2f},{2:.2f}H{1:.2f}\"/>\n", from, to, y);
  std::string marks;
  for (const auto& impact : motion.impacts) marks += fmt::format("M{:.2f},{:.2f}v8", at(impact.t), y - 4);
  if (!marks.empty()) svg += fmt::format("<path stroke=\"#ae017e\" stroke-width=\"1.2\" d=\"{}\"/>\n", marks);
  std::vector<Attributes> frames;
  for (const double t : times) frames.push_back({{"cx", fmt::format("{:.2f}", at(t))}});
  svg += animation.element("circle", fmt::format("fill=\"#202020\" r=\"3.5\" cy=\"{:.2f}\"", y), frames);
  const std::string speed = slower > 1.05   ? fmt::format(", played {:.3g} times slower", slower)
                            : slower < 0.95 ? fmt::format(", played {:.3g} times faster", 1 / slower)
                                            : std::string();
  svg += fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" font-family=\"sans-serif\" font-size=\"11\" fill=\"#404040\">{:.4g} s{}{}</text>\n",
      from, y + 17, motion.end - motion.begin, speed, marks.empty() ? "" : "; marks: impacts");
  return svg;
}

/// A scene at some instants of its motion.
class Film {
 public:
  Film(const Problem& problem, const DrawnMotion& motion, const std::vector<double>& times)
      : motion_(motion), times_(times), states_(states_at(problem, motion, times)), scene_(problem, states_) {
    for (std::size_t k = 0; k < states_.size(); ++k) scene_.add_to(box_, states_[k], k == 0);
    for (const Mark& mark : goal()) {
      for (const Point& x : mark.points) box_.add(x, mark.radius);
    }
    if (!motion.forces) return;
    for (std::size_t k = 0; k < times.size(); ++k) {
      arrows_.push_back(scene_.arrows(states_[k], motion.forces(times[k])));
      for (const ForceArrow& arrow : arrows_.back())
        longest_force_ = std::max(longest_force_, std::hypot(arrow.force[0], arrow.force[1]));
    }
  }

  const PaperBox& box() const { return box_; }
  double longest_force() const { return longest_force_; }

  /// Everything at the chosen instants, one after the other.
  std::string svg(const View& view, const Animation& animation, const std::vector<std::size_t>& chosen,
                  bool with_ways) const {
    std::string svg;
    std::vector<std::vector<Mark>> frames;
    for (const std::size_t k : chosen) frames.push_back(scene_.at(states_[k]));
    const auto add_mark = [&](const std::vector<std::vector<Mark>>& list, std::size_t i) {
      std::vector<Attributes> places;
      for (const auto& frame : list) places.push_back(places_of(frame[i], view));
      const Mark& mark = list.front()[i];
      svg += animation.element(tag_of(mark), mark.style + " " + constants_of(mark, view), places);
    };
    std::size_t i = 0;
    for (; i < frames.front().size() && frames.front()[i].is_ground; ++i) add_mark(frames, i);
    if (const auto faint = goal(); !faint.empty()) {
      svg += "<g opacity=\"0.2\">\n";
      for (std::size_t k = 0; k < faint.size(); ++k) add_mark({faint}, k);
      svg += "</g>\n";
    }
    if (with_ways) add_ways(view, svg);
    for (; i < frames.front().size(); ++i) add_mark(frames, i);
    if (longest_force_ > 0) add_arrows(view, animation, chosen, svg);
    return svg;
  }

  /// Rings where contacts are struck, which fade in an animation.
  std::string rings(const View& view, const Animation& animation, const std::vector<std::size_t>& chosen) const {
    std::string svg;
    for (const auto& impact : motion_.impacts) {
      const Point place = view(scene_.place_of(impact.contact, motion_.q(impact.t)));
      std::vector<Attributes> looks;
      bool is_seen = false;
      for (const std::size_t k : chosen) {
        const double age = (times_[k] - impact.t) / (kFlash * (motion_.end - motion_.begin));
        const bool here = age >= 0 && age <= 1;
        is_seen = is_seen || here;
        looks.push_back({{"r", fmt::format("{:.1f}", 9 + (here ? 9 * age : 0))},
                         {"opacity", fmt::format("{:.2f}", here ? 1 - age : 0.0)}});
      }
      const std::string constants = fmt::format(
          "class=\"impact\" fill=\"none\" stroke=\"#ae017e\" stroke-width=\"2\" cx=\"{:.2f}\" cy=\"{:.2f}\"", place[0],
          place[1]);
      if (is_seen) svg += animation.element("circle", constants, looks);
    }
    return svg;
  }

 private:
  static std::vector<Vector> states_at(const Problem& problem, const DrawnMotion& motion,
                                       const std::vector<double>& times) {
    if (!motion.q) return {problem.info().q0};
    std::vector<Vector> states;
    for (const double t : times) states.push_back(motion.q(std::min(t, motion.end)));
    return states;
  }
  std::vector<Mark> goal() const {
    std::vector<Mark> marks;
    if (motion_.goal.size() > 0) marks = scene_.at(motion_.goal);
    std::erase_if(marks, [](const Mark& mark) { return !mark.is_body; });
    return marks;
  }
  void add_ways(const View& view, std::string& svg) const {
    std::vector<std::vector<Point>> ways(scene_.centres(states_.front()).size());
    for (const Vector& q : states_) {
      const auto centres = scene_.centres(q);
      for (std::size_t body = 0; body < ways.size(); ++body) ways[body].push_back(centres[body]);
    }
    for (std::size_t body = 0; body < ways.size(); ++body)
      svg += fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-opacity=\"0.45\" points=\"{}\"/>\n",
                         curve_color(body), view.list(ways[body]));
  }
  void add_arrows(const View& view, const Animation& animation, const std::vector<std::size_t>& chosen,
                  std::string& svg) const {
    const double per_newton = kLongestArrow * view.width / longest_force_;
    for (std::size_t i = 0; i < arrows_.front().size(); ++i) {
      std::vector<Attributes> places;
      for (const std::size_t k : chosen) places.push_back({{"points", arrow_points(arrows_[k][i], view, per_newton)}});
      const char* color = arrows_.front()[i].contact < 0 ? "#000000" : "#ae017e";
      svg += animation.element("polygon", fmt::format("class=\"force\" fill=\"{}\"", color), places);
    }
  }

  const DrawnMotion& motion_;
  const std::vector<double>& times_;
  std::vector<Vector> states_;
  SceneMarks scene_;
  PaperBox box_;
  std::vector<std::vector<ForceArrow>> arrows_;  ///< per instant
  double longest_force_ = 0;
};

void require_geometry(const ProblemInfo& info) {
  if (!info.geometry) throw InputError(fmt::format("problem {} states no geometry: there is nothing to draw", info.id));
}

std::vector<std::size_t> count_up_to(std::size_t n) {
  std::vector<std::size_t> numbers;
  for (std::size_t k = 0; k < n; ++k) numbers.push_back(k);
  return numbers;
}

}  // namespace

std::string scene_svg(const Problem& problem, const DrawnMotion& motion) {
  const ProblemInfo& info = problem.info();
  require_geometry(info);

  // Frames at equal distances, the last one held.
  std::vector<double> times;
  double seconds = 0;
  if (motion.q) {
    const double length = motion.end - motion.begin;
    seconds = std::clamp(length, kShortest, kLongest);
    const int n = static_cast<int>(std::lround(kFramesPerSecond * seconds));
    const int held = static_cast<int>(std::lround(kFramesPerSecond * kPause));
    for (int k = 0; k <= n + held; ++k) times.push_back(motion.begin + length * std::min(k, n) / n);
    seconds += kPause;
  }
  const Film film(problem, motion, times);
  const View view(film.box(), kWidth, kHeight, kTextWidth);
  const Animation animation(seconds);
  const auto all = count_up_to(std::max<std::size_t>(times.size(), 1));
  const double height = view.height + (motion.q ? kTimeLine : 0);
  // Sizes stand in styles, too: a page has one for all figures.
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.1f} {1:.1f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "style=\"max-width: {0:.0f}px\" role=\"img\">\n<title>{2}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n"
      "<svg width=\"{0:.1f}\" height=\"{3:.1f}\" style=\"width: {0:.1f}px; height: {3:.1f}px\">\n",
      view.width, height, escape_xml(info.title), view.height);
  svg += film.svg(view, animation, all, static_cast<bool>(motion.q));
  if (motion.forces) svg += film.rings(view, animation, all);
  svg += "</svg>\n";
  if (motion.q) svg += time_line(motion, (seconds - kPause) / (motion.end - motion.begin), view, animation, times);
  return svg + "</svg>\n";
}

std::string scene_svg(const Problem& problem, const Solution& solution) {
  const Motion& motion = solution.motion;
  if (motion.empty()) return scene_svg(problem, DrawnMotion{});
  DrawnMotion drawn{.begin = motion.begin(), .end = motion.end()};
  drawn.q = [&motion](double t) {
    Vector q, v;
    motion.at(t, q, v, Motion::Side::before);
    return q;
  };
  for (const Event& event : solution.events) {
    if (event.kind == EventKind::impact) drawn.impacts.push_back({event.t, event.contact});
  }
  return scene_svg(problem, drawn);
}

SceneFrames scene_frames(const Problem& problem, const DrawnMotion& motion) {
  constexpr int kFrames = 12;
  constexpr double kPageWidth = 1000, kBetween = 10, kCaption = 22, kAnyHeight = 1e9;  // [pixels]
  require_geometry(problem.info());
  const double spacing = (motion.end - motion.begin) / (kFrames - 1);
  std::vector<double> t;
  for (int k = 0; k < kFrames; ++k) t.push_back(motion.begin + spacing * k);
  for (const auto& impact : motion.impacts) {
    const long k = std::clamp<long>(std::lround((impact.t - motion.begin) / spacing), 1, kFrames - 2);
    double& nearest = t[static_cast<std::size_t>(k)];
    if (nearest == motion.begin + spacing * static_cast<double>(k)) nearest = impact.t;
  }
  const Film film(problem, motion, t);
  const double aspect = View(film.box(), 1, kAnyHeight, 0).height;
  const int n_columns = aspect < 0.4 ? 2 : aspect < 0.75 ? 3 : 4, n_rows = (kFrames + n_columns - 1) / n_columns;
  const View view(film.box(), (kPageWidth - kBetween * (n_columns - 1)) / n_columns, kAnyHeight, 0);
  const double row_height = view.height + kCaption + kBetween;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "font-family=\"Helvetica, Arial, sans-serif\" font-size=\"13\" role=\"img\">\n<title>{2}: frames of the motion</title>\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n",
      kPageWidth, row_height * n_rows, escape_xml(problem.info().title));
  for (std::size_t k = 0; k < t.size(); ++k) {
    const bool is_impact = std::ranges::find(motion.impacts, t[k], &DrawnMotion::Impact::t) != motion.impacts.end();
    const double x = static_cast<double>(static_cast<int>(k) % n_columns) * (view.width + kBetween);
    const double y = static_cast<double>(static_cast<int>(k) / n_columns) * row_height;
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" fill=\"#404040\">t = {:.2f} s{}</text>\n", x + 2, y + 15, t[k],
                       is_impact ? ", impact" : "");
    svg += fmt::format("<svg x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\">{}{}", x, y + kCaption,
                       view.width, view.height, film.svg(view, Animation(0), {k}, false),
                       is_impact ? film.rings(view, Animation(0), {k}) : "");
    svg += fmt::format(
        "<rect x=\"0.5\" y=\"0.5\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" stroke=\"#d0d0d0\"/></svg>\n",
        view.width - 1, view.height - 1);
  }
  return {svg + "</svg>\n", film.longest_force()};
}

}  // namespace ricochet
