// Panels of curves, side by side where there is room: error over step length, growth with size, what changed from commit to commit.
// Axes are logarithmic where the data name no others. Curves of one name look the same in all panels and have one place in the key;
// one without a name belongs to that before it.
import { line } from "d3-shape";
import { element } from "./dom.js";
import { legend } from "./legend.js";
import { lookedAt } from "./looked_at.js";
import { axes, drawAtWidth, logDomain, lookOf, symbolPath } from "./plot.js";

const NEAR = 24;  // pixels around the pointer
const TWO = 760, GAP = 16;  // pixels from which two panels stand side by side, and between them

/// The names of the key, and each curve with its place among them.
function named(panels) {
  const names = new Map();
  let isShared = false;
  for (const { title, curves } of panels) {
    let owner = "";
    for (const curve of curves) {
      if (curve.label) owner = curve.label;
      isShared ||= curve.label && names.has(owner);
      if (!names.has(owner)) names.set(owner, { label: owner, group: title, ...curve, ...lookOf(curve) });
      curve.name = [...names.keys()].indexOf(owner);
    }
  }
  const key = [...names.values()];
  // Panels are groups of the key where each has names of its own.
  return key.map((entry) => ({ ...entry, group: isShared || panels.length === 1 ? undefined : entry.group }));
}

/// Zero has no place on a logarithmic axis.
const isDrawn = (panel, [x, y]) => (panel.x_names || x > 0) && (panel.is_log_y === false || y > 0);
/// Pieces of a curve: over named places it ends where it has no point.
function pieces(panel, points) {
  const found = [];
  points.forEach((point, k) => {
    if (k && (!panel.x_names || point[0] === points[k - 1][0] + 1)) found.at(-1).push(point);
    else found.push([point]);
  });
  return found;
}
/// An interval a little longer than that of the values.
function around(values, margin) {
  if (!values.length) return [0, 1];
  const low = Math.min(...values), high = Math.max(...values), beside = margin ?? (0.05 * (high - low) || 0.1);
  return [low - beside, high + beside];
}
/// Step lengths and sizes range over decades, what changed from one place to the next may not.
function heightsOf({ x_names, is_log_y }, values) {
  if (is_log_y === false) return around(values);
  return x_names && values.length ? around(values.map(Math.log)).map(Math.exp) : logDomain(values);
}
const digits = (x) => Number(x.toPrecision(4));

function addPanel(panel, names) {
  const picture = element("div", { class: "picture" });
  const looked = lookedAt(({ curve, x, y }) => element("div", {},
    element("p", { class: "title" }, names[curve.name].label),
    element("p", {}, `${panel.y_label}: ${digits(y)}`),
    element("p", {}, `${panel.x_label}: `, panel.x_links ? element("a", { href: panel.x_links[x] }, panel.x_names[x]) : `${digits(x)}`)),
  "");  // the hint stands once, above all panels
  const box = element("div", { class: "panel" }, element("p", { class: "title" }, panel.title), picture, looked.said);

  function draw(width, shown) {
    const curves = panel.curves.filter((curve) => shown.has(curve.name));
    const drawnPoints = (curve) => curve.points.filter((point) => isDrawn(panel, point));
    const all = (curves.length ? curves : panel.curves).flatMap(drawnPoints), heights = all.map(([, at]) => at);
    const { svg, area, x, y } = axes({
      width, height: Math.round(Math.max(260, Math.min(400, 0.75 * width))), xLabel: panel.x_label, yLabel: panel.y_label,
      xNames: panel.x_names, isLogY: panel.is_log_y !== false,
      xDomain: (panel.x_names ? (values) => around(values, 0.3) : logDomain)(all.map(([at]) => at)),
      yDomain: heightsOf(panel, heights),
      label: `${panel.title}: ${panel.y_label} over ${panel.x_label}`,
    });
    const path = line().x(([at]) => x(at)).y(([, at]) => y(at));
    const items = [];
    for (const curve of curves) {
      const points = drawnPoints(curve);
      if (curve.drawn !== "marks") {
        area.append("path").attr("class", `curve c${curve.colour}`).attr("d", pieces(panel, points).map((piece) => path(piece)).join(""))
          .style("stroke-dasharray", lookOf(curve).dash || null);
      }
      if (curve.drawn === "lines") continue;
      for (const [px, py] of points) {
        area.append("path").attr("class", `mark c${curve.colour}`).attr("d", symbolPath(curve.symbol))
          .attr("transform", `translate(${x(px)},${y(py)})`);
        items.push({ curve, x: px, y: py });
      }
    }
    looked.attach({ svg, area, width }, {
      items,
      at: (item) => [x(item.x), y(item.y)],
      find: (px, py) => {
        const distance = (item) => Math.hypot(x(item.x) - px, y(item.y) - py);
        const near = items.reduce((best, item) => (!best || distance(item) < distance(best) ? item : best), null);
        return near && distance(near) < NEAR ? near : null;
      },
    });
    picture.replaceChildren(svg.node());
  }
  return { box, draw };
}

export function drawCurves(place, data) {
  const names = named(data.panels), panels = data.panels.map((panel) => addPanel(panel, names));
  const boxes = element("div", { class: "panels" }, ...panels.map(({ box }) => box));
  const hint = element("p", { class: "hint" }, "Point at a mark, or move with the arrow keys, for its numbers; a click, or Enter, keeps it.");
  const lost = data.panels.flatMap((panel) => panel.curves.flatMap((curve) => curve.points.filter((point) => !isDrawn(panel, point)))).length;
  let width = 0;
  const key = legend(names, () => draw());
  place.append(element("div", { class: "chart-columns" }, element("div", { class: "drawn" }, hint, boxes), key.element));
  if (lost) place.append(element("p", { class: "hint" }, `${lost} points at zero have no place on logarithmic axes.`));
  function draw() {
    const columns = panels.length > 1 && width >= TWO ? 2 : 1;
    boxes.style.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
    for (const panel of panels) panel.draw(Math.floor((width - GAP * (columns - 1)) / columns), key.shown);
  }
  drawAtWidth(boxes, (w) => { width = w; draw(); });
}
