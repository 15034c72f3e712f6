// Performance profiles: the share of problems within tau times the best, a step per problem (Dolan, Moré 2002). Curves differ by
// dashes and marks as well as by colours, and where there is room their names stand at their ends.
import { curveStepAfter, line } from "d3-shape";
import { element } from "./dom.js";
import { legend } from "./legend.js";
import { lookedAt } from "./looked_at.js";
import { axes, DASHES, drawAtWidth, lookOf, symbolPath } from "./plot.js";

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
const MOST = 10, FEW = 8;  // curves that can be told from each other; more start with the few that solve most
const MARKS = 72;  // pixels between the marks of a curve; those of the others stand between them
const SAMPLES = 8, TOUCH = 2;  // pixels between places where curves are compared, and within which they hide each other
const LETTER = 6.6, LINE = 14, ROOM = 620;  // pixels of names, and of a chart that has room for them

/// Curves that are the same, or nearly, hide each other: they take turns, each with a dash where the others have gaps.
/// @param heights  of a curve, at the same places for all
function taken(shown, heights) {
  const same = (a, b) => a.filter((y, n) => Math.abs(y - b[n]) <= TOUCH).length >= 0.8 * a.length;
  const alike = [], turns = new Map();
  for (const k of shown) {
    const list = alike.find(([first]) => same(heights.get(first), heights.get(k)));
    if (list) list.push(k);
    else alike.push([k]);
  }
  for (const list of alike) {
    if (list.length > 1) list.forEach((k, turn) => turns.set(k, { array: `8 ${8 * (list.length - 1)}`, offset: -8 * turn }));
  }
  return turns;
}

function mostSolved(solvers) {
  const all = [...solvers.keys()];
  if (solvers.length <= MOST) return all;
  return all.sort((a, b) => solvers[b].ratios.length - solvers[a].ratios.length).slice(0, FEW);
}

/// Heights of names at the ends of curves, in the order of the curves, moved until they do not touch.
function spread(heights, top, bottom) {
  const order = [...heights.keys()].sort((a, b) => heights[a] - heights[b]), at = [];
  for (const k of order) at[k] = Math.max(heights[k], top + LINE / 2, ...order.slice(0, order.indexOf(k)).map((j) => at[j] + LINE));
  let limit = bottom;
  for (const k of order.reverse()) {
    at[k] = Math.min(at[k], limit);
    limit = at[k] - LINE;
  }
  return at;
}

export function drawProfile(place, data) {
  // Steps of the chart begin at (1, 0), and end at the edge of its axis.
  const solvers = data.panels[0].curves.map((curve) => ({ ...curve, ratios: curve.points.slice(1, -1).map(([tau]) => tau) }));
  const curves = solvers.map((solver) => ({ label: solver.label, ...lookOf(solver) })), first = mostSolved(solvers);
  const largest = Math.max(10, ...solvers.flatMap((solver) => solver.ratios));
  const picture = element("div", { class: "picture" });
  const corners = solvers.map((solver, k) => cornersOf(solver.ratios, k));
  const percent = (solved) => `${solved} of ${data.problems} problems (${Math.round((100 * solved) / data.problems)} %)`;
  const looked = lookedAt(({ curve, tau, solved }) => element("div", {},
    element("p", { class: "title" }, curves[curve].label),
    element("p", {}, `${percent(solved)} in at most ${Number(tau.toPrecision(3))} times the time of the best`),
    element("p", {}, `It solves ${percent(solvers[curve].ratios.length)}.`)),
  "Point at a curve, or move with the arrow keys, for its share; a click, or Enter, keeps it.");
  let width = 0;
  const key = legend(curves, () => draw(), { noun: "solvers", first, why: first.length < curves.length ? "those that solve most" : "" });
  place.append(element("div", { class: "chart-columns" }, element("div", { class: "drawn" }, picture, looked.said), key.element));
  function draw() {
    const names = [...key.shown].sort((a, b) => a - b).map((k) => curves[k].label);
    const height = Math.round(Math.max(260, Math.min(400, 0.6 * width)));
    const isNamed = width >= ROOM && names.length > 0 && names.length * LINE < height - 70;
    const beside = isNamed ? Math.min(0.3 * width, Math.max(...names.map((name) => LETTER * name.length)) + 16) : 0;
    const { svg, area, x, y } = axes({
      width, beside, height, isLogY: false, yDomain: [0, 1.02],
      xDomain: [1, 1.2 * largest], xLabel: "tau: time over that of the best", yLabel: `share of ${data.problems} problems`,
      label: `Share of ${data.problems} problems over tau`,
    });
    const path = line().x(([tau]) => x(tau)).y(([, share]) => y(share)).curve(curveStepAfter);
    const drawn = new Map();
    const [left, right] = x.range(), shareAt = (k, px) => solvers[k].ratios.filter((tau) => x(tau) <= px).length / data.problems;
    const places = Array.from({ length: Math.floor((right - left) / SAMPLES) }, (_, n) => left + n * SAMPLES);
    const turns = taken(key.shown, new Map([...key.shown].map((k) => [k, places.map((px) => y(shareAt(k, px)))])));
    // Those with longer dashes below those with shorter ones: where they go together, the gaps show what is below.
    const order = [...key.shown].sort((a, b) => DASHES.indexOf(curves[a].dash) - DASHES.indexOf(curves[b].dash) || a - b);
    for (const k of order) {
      const curve = area.append("path").attr("class", `curve c${curves[k].colour}`)
        .attr("d", path(stepsOf(solvers[k].ratios, data.problems, 1.2 * largest)));
      const turn = turns.get(k);
      if (turn) curve.style("stroke-dasharray", turn.array).style("stroke-dashoffset", turn.offset);
      else if (curves[k].dash) curve.style("stroke-dasharray", curves[k].dash);
      else curve.classed("below", true);
      drawn.set(k, curve);
    }
    order.forEach((k, n) => {
      for (let px = left + 8 + (n * MARKS) / order.length; px < right; px += MARKS) {
        area.append("path").attr("class", `mark c${curves[k].colour}`).attr("d", symbolPath(curves[k].symbol))
          .attr("transform", `translate(${px},${y(shareAt(k, px))})`);
      }
    });
    if (isNamed) {
      const ends = order.map((k) => y(solvers[k].ratios.length / data.problems));
      const at = spread(ends, y.range()[1], y.range()[0]);
      order.forEach((k, n) => {
        area.append("path").attr("class", `leader c${curves[k].colour}`).attr("d", `M${right},${ends[n]}l8,${at[n] - ends[n]}`);
        area.append("text").attr("class", `end c${curves[k].colour}`).attr("x", right + 11).attr("y", at[n]).attr("dy", "0.32em")
          .text(curves[k].label);
      });
    }
    const reached = (k, px) => corners[k].findLast(({ tau }) => x(tau) <= px);
    // How far the curve is above or below the pointer, and the step that it has taken there.
    const distanceOf = (k, px, py) => {
      const before = reached(k, px - BESIDE), behind = reached(k, px + BESIDE);
      if (!behind) return { distance: Infinity };
      const top = y(behind.solved / data.problems), bottom = y((before?.solved ?? 0) / data.problems);
      return { distance: Math.max(top - py, py - bottom, 0), item: py < (top + bottom) / 2 || !before ? behind : before };
    };
    looked.attach({ svg, area, width }, {
      items: [...key.shown].sort((a, b) => a - b).flatMap((k) => corners[k]),
      at: ({ tau, solved }) => [x(tau), y(solved / data.problems)],
      find: (px, py) => {
        const near = [...key.shown].map((k) => distanceOf(k, px, py)).sort((a, b) => a.distance - b.distance)[0];
        return near && near.distance < NEAR ? near.item : null;
      },
      mark: (item) => { for (const [k, curve] of drawn) curve.classed("near", k === item.curve); },
    });
    picture.replaceChildren(svg.node());
  }
  drawAtWidth(picture, (w) => { width = w; draw(); });
}
