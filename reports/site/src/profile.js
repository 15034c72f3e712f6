// Performance profiles: the share of problems within tau times the best, a step per problem (Dolan, Moré 2002).
import { curveStepAfter, line } from "d3-shape";
import { element } from "./dom.js";
import { legend } from "./legend.js";
import { axes, COLOURS, drawAtWidth } from "./plot.js";

/// Points of (tau, share); failures, which `ratios` leaves out, keep the curve below 1.
export function stepsOf(ratios, problems, last) {
  const points = [[1, 0]];
  ratios.forEach((ratio, k) => points.push([ratio, (k + 1) / problems]));
  points.push([last, ratios.length / problems]);
  return points;
}

export function drawProfile(place, data) {
  const curves = data.solvers.map((solver, k) => ({ label: solver.name, colour: k % COLOURS, dashed: k >= COLOURS }));
  const largest = Math.max(10, ...data.solvers.flatMap((solver) => solver.ratios));
  const picture = element("div", { class: "picture" });
  let width = 0;
  const key = legend(curves, () => draw());
  place.append(element("div", { class: "chart-columns" }, picture, key.element));
  function draw() {
    const { svg, area, x, y } = axes({
      width, height: Math.round(Math.max(260, Math.min(400, 0.6 * width))), isLogY: false, yDomain: [0, 1.02],
      xDomain: [1, 1.2 * largest], xLabel: "tau: time over that of the best", yLabel: `share of ${data.problems} scenes`,
      label: `Share of ${data.problems} scenes over tau`,
    });
    const path = line().x(([tau]) => x(tau)).y(([, share]) => y(share)).curve(curveStepAfter);
    for (const k of key.shown) {
      area.append("path").attr("class", `curve c${curves[k].colour}${curves[k].dashed ? " dashed" : ""}`)
        .attr("d", path(stepsOf(data.solvers[k].ratios, data.problems, 1.2 * largest)))
        .append("title").text(`${curves[k].label}: ${data.solvers[k].ratios.length} of ${data.problems} solved`);
    }
    picture.replaceChildren(svg.node());
  }
  drawAtWidth(picture, (w) => { width = w; draw(); });
}
