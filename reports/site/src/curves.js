// Panels of curves, side by side where there is room, with the axes and the ranges that the chart states. Curves of one name look the
// same in all panels and have one place in the key; one without a name belongs to that before it.
import { curveStepAfter, line } from "d3-shape";
import { element } from "./dom.js";
import { legend } from "./legend.js";
import { lookedAt } from "./looked_at.js";
import { axes, drawAtWidth, lookOf, markClass, symbolPath } from "./plot.js";

const NEAR = 24, ROW = 22;  // pixels around the pointer, and of a named place
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

/// Pieces of a curve: over named places it ends where it has no point.
function pieces(panel, points) {
  const found = [];
  points.forEach((point, k) => {
    if (k && (!panel.x_names || point[0] === points[k - 1][0] + 1)) found.at(-1).push(point);
    else found.push([point]);
  });
  return found;
}
const digits = (x) => Number(x.toPrecision(4));

function addPanel(panel, names) {
  const picture = element("div", { class: "picture" });
  const looked = lookedAt(({ curve, x, y }) => element("div", {},
    element("p", { class: "title" }, names[curve.name].label),
    element("p", {}, panel.y_names ? panel.y_names[y] : `${panel.y_label}: ${digits(y)}`),
    element("p", {}, `${panel.x_label}: `, panel.x_links ? element("a", { href: panel.x_links[x] }, panel.x_names[x]) : `${digits(x)}`)),
  "");  // the hint stands once, above all panels
  const box = element("div", { class: "panel" }, element("p", { class: "title" }, panel.title), picture, looked.said);

  function draw(width, shown) {
    const curves = panel.curves.filter((curve) => shown.has(curve.name)), rows = panel.y_names?.length ?? 0;
    const { svg, area, x, y } = axes({
      width, height: Math.round(Math.max(260, ROW * rows, Math.min(400, 0.75 * width))), xLabel: panel.x_label, yLabel: panel.y_label,
      xNames: panel.x_names, yNames: panel.y_names, isLogX: panel.is_log_x, isLogY: panel.is_log_y,
      xDomain: panel.x_range, yDomain: panel.y_range,
      label: `${panel.title}: ${panel.y_label} over ${panel.x_label}`,
    });
    const items = [];
    for (const curve of curves) {
      const { points } = curve, path = line().x(([at]) => x(at)).y(([, at]) => y(at));
      if (curve.drawn === "steps") path.curve(curveStepAfter);
      if (curve.drawn !== "marks") {
        area.append("path").attr("class", `curve c${curve.colour}`).attr("d", pieces(panel, points).map((piece) => path(piece)).join(""))
          .style("stroke-dasharray", lookOf(curve).dash || null);
      }
      if (curve.drawn === "lines" || curve.drawn === "steps") continue;
      for (const [px, py] of points) {
        area.append("path").attr("class", `${markClass(lookOf(curve))} c${curve.colour}`).attr("d", symbolPath(curve.symbol))
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
  let width = 0;
  const key = legend(names, () => draw());
  place.append(element("div", { class: "chart-columns" }, element("div", { class: "drawn" }, hint, boxes), key.element));
  function draw() {
    const columns = panels.length > 1 && width >= TWO ? 2 : 1;
    boxes.style.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
    for (const panel of panels) panel.draw(Math.floor((width - GAP * (columns - 1)) / columns), key.shown);
  }
  drawAtWidth(boxes, (w) => { width = w; draw(); });
}
