#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/studies/control/control_run.h"
#include "reports/markup.h"

namespace ricochet {
namespace {

constexpr int kFrames = 12;
constexpr double kPageWidth = 1000, kBetween = 10, kCaption = 22;  // [pixels]

/// Equally spaced instants; the inner one next to an impact is at the impact.
std::vector<double> instants(const ControlRun& run) {
  const double spacing = run.T / (kFrames - 1);
  std::vector<double> t;
  for (int k = 0; k < kFrames; ++k) t.push_back(spacing * k);
  for (const auto& impact : run.impacts) {
    const auto k = static_cast<std::size_t>(std::clamp<long>(std::lround(impact.t / spacing), 1, kFrames - 2));
    const bool is_taken = t[k] != spacing * static_cast<double>(k);
    if (!is_taken) t[k] = impact.t;
  }
  return t;
}

/// As many columns as make a page of twelve frames neither long nor flat.
int columns(const MotionPicture& picture) {
  const PictureView view = view_of(picture, 1);
  return view.height < 0.4 ? 2 : view.height < 0.75 ? 3 : 4;
}

/// The rings of the impacts at this instant, and how the frame is called.
std::pair<std::string, std::string> impacts_at(const ControlRun& run, const MotionPicture::Frame& frame,
                                               const PictureView& view) {
  std::string rings, text;
  for (const auto& impact : run.impacts) {
    if (impact.t != frame.t) continue;
    rings += impact_ring(frame, view, impact.contact);
    text = ", impact";
  }
  return {rings, text};
}

}  // namespace

Figure draw_frames(const FigureFolder& folder, const ControlRun& run, const std::string& name) {
  const int n_columns = columns(run.picture), n_rows = (kFrames + n_columns - 1) / n_columns;
  const PictureView view = view_of(run.picture, (kPageWidth - kBetween * (n_columns - 1)) / n_columns);
  const double row_height = view.height + kCaption + kBetween;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "font-family=\"Helvetica, Arial, sans-serif\" font-size=\"13\" role=\"img\" aria-label=\"{2}: frames of the "
      "motion\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n",
      kPageWidth, row_height * n_rows, escape_html(run.title));
  const auto t = instants(run);
  for (std::size_t k = 0; k < t.size(); ++k) {
    const auto& frame = run.picture.at(t[k]);
    const auto [rings, text] = impacts_at(run, frame, view);
    const double x = static_cast<double>(static_cast<int>(k) % n_columns) * (view.width + kBetween);
    const double y = static_cast<double>(static_cast<int>(k) / n_columns) * row_height;
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" fill=\"#404040\">t = {:.2f} s{}</text>\n", x + 2, y + 15,
                       frame.t, text);
    svg += fmt::format("<svg x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\">{}{}", x, y + kCaption,
                       view.width, view.height, svg_of(frame, view), rings);
    svg += fmt::format(
        "<rect x=\"0.5\" y=\"0.5\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" stroke=\"#d0d0d0\"/></svg>\n",
        view.width - 1, view.height - 1);
  }
  folder.write(name + ".svg", svg + "</svg>\n");
  return {
      name + ".svg", run.problem + ": frames",
      fmt::format("{}, as {} claims it. Shaded: where the bodies have to go. Black arrows: controls; purple: forces "
                  "of contacts, on one scale, the longest {:.3g} N. Rings: impacts.",
                  run.title, run.discretisation, view.largest_force),
      run};
}

}  // namespace ricochet
