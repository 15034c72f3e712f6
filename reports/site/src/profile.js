// Performance profiles: the share of problems within tau times the best, a step per problem (Dolan, Moré 2002).
import { curveStepAfter, line } from "d3-shape";
import { element } from "./dom.js";
import { legend } from "./legend.js";
import { lookedAt } from "./looked_at.js";
import { axes, COLOURS, drawAtWidth } from "./plot.js";

/// Points of (tau, share); failures, which `ratios` leaves out, keep the curve below 1.
function stepsOf(ratios, problems, last) {
  const points = [[1, 0]];
  ratios.forEach((ratio, k) => points.push([ratio, (k + 1) / problems]));
  points.push([last, ratios.length / problems]);
  return points;
}

/// The steps of a curve: { curve, tau, solved }, one for equal ratios.
function cornersOf(ratios, curve) {
  return ratios.flatMap((tau, k) => (tau === ratios[k + 1] ? [] : [{ curve, tau, solved: k + 1 }]));
}

const BESIDE = 4;  // pixels around the pointer in which a riser counts as near
const NEAR = 40;

export function drawProfile(place, data) {
  const curves = data.solvers.map((solver, k) => ({ label: solver.name, colour: k % COLOURS, dashed: k >= COLOURS }));
  const largest = Math.max(10, ...data.solvers.flatMap((solver) => solver.ratios));
  const picture = element("div", { class: "picture" });
  const corners = data.solvers.map((solver, k) => cornersOf(solver.ratios, k));
  const percent = (solved) => `${solved} of ${data.problems} problems (${Math.round((100 * solved) / data.problems)} %)`;
  const looked = lookedAt(({ curve, tau, solved }) => element("div", {},
    element("p", { class: "title" }, curves[curve].label),
    element("p", {}, `${percent(solved)} in at most ${Number(tau.toPrecision(3))} times the time of the best`),
    element("p", {}, `It solves ${percent(data.solvers[curve].ratios.length)}.`)),
  "Point at a curve, or move with the arrow keys, for its share; a click, or Enter, keeps it.");
  let width = 0;
  const key = legend(curves, () => draw());
  place.append(element("div", { class: "chart-columns" }, element("div", { class: "drawn" }, picture, looked.said), key.element));
  function draw() {
    const { svg, area, x, y } = axes({
      width, height: Math.round(Math.max(260, Math.min(400, 0.6 * width))), isLogY: false, yDomain: [0, 1.02],
      xDomain: [1, 1.2 * largest], xLabel: "tau: time over that of the best", yLabel: `share of ${data.problems} problems`,
      label: `Share of ${data.problems} problems over tau`,
    });
    const path = line().x(([tau]) => x(tau)).y(([, share]) => y(share)).curve(curveStepAfter);
    const drawn = new Map();
    for (const k of key.shown) {
      drawn.set(k, area.append("path").attr("class", `curve c${curves[k].colour}${curves[k].dashed ? " dashed" : ""}`)
        .attr("d", path(stepsOf(data.solvers[k].ratios, data.problems, 1.2 * largest))));
    }
    const reached = (k, px) => corners[k].findLast(({ tau }) => x(tau) <= px);
    // How far the curve is above or below the pointer, and the step that it has taken there.
    const beside = (k, px, py) => {
      const before = reached(k, px - BESIDE), behind = reached(k, px + BESIDE);
      if (!behind) return { distance: Infinity };
      const top = y(behind.solved / data.problems), bottom = y((before?.solved ?? 0) / data.problems);
      return { distance: Math.max(top - py, py - bottom, 0), item: py < (top + bottom) / 2 || !before ? behind : before };
    };
    looked.attach({ svg, area, width }, {
      items: [...key.shown].sort((a, b) => a - b).flatMap((k) => corners[k]),
      at: ({ tau, solved }) => [x(tau), y(solved / data.problems)],
      find: (px, py) => {
        const near = [...key.shown].map((k) => beside(k, px, py)).sort((a, b) => a.distance - b.distance)[0];
        return near && near.distance < NEAR ? near.item : null;
      },
      mark: (item) => { for (const [k, curve] of drawn) curve.classed("near", k === item.curve); },
    });
    picture.replaceChildren(svg.node());
  }
  drawAtWidth(picture, (w) => { width = w; draw(); });
}
