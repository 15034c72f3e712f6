// Work over error: a curve per method, a mark per run. What a run is stands beside the pointer, or the keyboard's focus.
// Runs without a solution have no error: they are crosses in a column beside the axes.
import { Delaunay } from "d3-delaunay";
import { line } from "d3-shape";
import { element, menu } from "./dom.js";
import { legend } from "./legend.js";
import { lookedAt } from "./looked_at.js";
import { axes, COLOURS, drawAtWidth, logDomain, symbolPath } from "./plot.js";

const number = (x) => (x === 0 || (x >= 0.01 && x < 1e5) ? String(Number(x.toPrecision(3))) : x.toExponential(2));
const NEAR = 40;  // pixels
const BESIDE = 44;  // the column of runs without a solution
const CROSS = "M-4,-4L4,4M4,-4L-4,4";
const LARGEST_ERROR = 10;  // beyond it a run says nothing: it is drawn on the edge, so that it does not squeeze the others

/// Families have a colour, their members a symbol; from the second round of symbols on curves are dashed.
function styled(methods) {
  const families = [...new Set(methods.map((m) => m.family))];
  const members = new Map();
  let loners = 0;  // of families of one
  const sizes = new Map(families.map((f) => [f, methods.filter((m) => m.family === f).length]));
  return methods.map((m) => {
    const member = members.get(m.family) ?? 0;
    members.set(m.family, member + 1);
    const isOdd = m.family === "Time stepping" || sizes.get(m.family) === 1;
    const k = isOdd ? loners++ : member;
    return {
      label: m.label, id: m.id, group: m.family,
      colour: isOdd ? k % COLOURS : families.indexOf(m.family) % COLOURS,
      symbol: isOdd ? Math.floor(k / COLOURS) + 1 : k,
      dashed: isOdd,
    };
  });
}

function outcome(run) {
  if (run.status !== undefined) return `no solution: ${run.status}${run.reason ? `: ${run.reason}` : ""}`;
  return `error ${number(run.error)} (relative ${number(run.relative)}); CPU time ${number(run.time)} ms, ` +
    `quartiles ${number(run.quartiles[0])} to ${number(run.quartiles[1])}`;
}

function describe(run, curve, data) {
  const counters = data.works.filter((w) => w.field !== "time").map((w) => `${w.label} ${run[w.field]}`);
  return element("div", {},
    element("p", { class: "title" }, `${curve.label}, ${run.setting}`),
    element("p", {}, outcome(run)),
    element("p", {}, `${counters.join(", ")}, events ${run.events}`),
    element("p", {}, element("code", {}, run.command)),
    element("p", {}, element("a", { href: `#${run.row}` }, "its row in the table")));
}

export function drawWorkPrecision(place, data) {
  const curves = styled(data.methods);
  const state = { error: data.errors[0].field, work: data.works[0].field, width: 0 };
  const picture = element("div", { class: "picture" });
  const looked = lookedAt((run) => describe(run, curves[run.method], data),
    "Point at a run, or move with the arrow keys, for what it is; a click, or Enter, keeps it.");
  const edge = element("p", { class: "hint" }, `Errors above ${LARGEST_ERROR} lie on the right edge.`);
  const choices = (list) => list.map(({ field, label }) => [field, label]);
  const key = legend(curves, () => draw());
  place.append(
    element("div", { class: "menus" },
      menu("error", choices(data.errors), (field) => { state.error = field; draw(); }),
      menu("work", choices(data.works), (field) => { state.work = field; draw(); })),
    element("div", { class: "chart-columns" }, element("div", { class: "drawn" }, picture, edge, looked.said), key.element));

  function draw() {
    const runs = data.runs.filter((run) => key.shown.has(run.method) && run[state.error] > 0 && run[state.work] > 0);
    const xLabel = data.errors.find((e) => e.field === state.error).label;
    const yLabel = data.works.find((w) => w.field === state.work).label;
    const height = Math.round(Math.max(320, Math.min(560, 0.7 * state.width)));
    const failures = data.failures.filter((run) => key.shown.has(run.method));
    const beside = failures.length ? BESIDE : 0;
    const [least, most] = logDomain(runs.map((r) => r[state.error]));
    const isOnEdge = most > 1.6 * LARGEST_ERROR && least < LARGEST_ERROR;
    const { svg, area, x, y } = axes({
      width: state.width, height, xLabel, yLabel, beside,
      label: `${yLabel} over ${xLabel}, ${runs.length} runs${failures.length ? `, ${failures.length} without a solution` : ""}`,
      xDomain: [least, isOnEdge ? LARGEST_ERROR : most], yDomain: logDomain(runs.map((r) => r[state.work])),
    });
    x.clamp(true);
    edge.hidden = !isOnEdge;
    const [bottom, top] = y.range();
    const column = new Map(failures.map((run, k) => [run, top + ((bottom - top) * (k + 1)) / (failures.length + 1)]));
    const at = (run) => (column.has(run) ? [x.range()[1] + beside / 2, column.get(run)] : [x(run[state.error]), y(run[state.work])]);
    const path = line();
    for (const k of key.shown) {
      const own = runs.filter((run) => run.method === k);
      if (!own.length) continue;
      const group = area.append("g").attr("class", `c${curves[k].colour}`).attr("data-method", curves[k].id);
      group.append("path").attr("class", curves[k].dashed ? "curve dashed" : "curve").attr("d", path(own.map(at)));
      for (const run of own) {
        group.append("path").attr("class", "mark").attr("d", symbolPath(curves[k].symbol))
          .attr("transform", `translate(${at(run)})`);
      }
    }
    if (failures.length) {
      area.append("text").attr("class", "label beside").attr("text-anchor", "middle")
        .attr("transform", `translate(${state.width - 6},${(top + bottom) / 2}) rotate(-90)`)
        .text(`no solution: ${failures.length} ${failures.length === 1 ? "run" : "runs"}`);
    }
    for (const run of failures) {
      area.append("path").attr("class", `cross c${curves[run.method].colour}`).attr("d", CROSS)
        .attr("transform", `translate(${at(run)})`);
    }
    const items = [...runs, ...failures];
    const near = items.length ? Delaunay.from(items.map(at)) : null;
    looked.attach({ svg, area, width: state.width }, {
      items, at,
      find: (px, py) => {
        const run = near && items[near.find(px, py)];
        return run && Math.hypot(at(run)[0] - px, at(run)[1] - py) < NEAR ? run : null;
      },
    });
    picture.replaceChildren(svg.node());
  }
  drawAtWidth(picture, (width) => { state.width = width; draw(); });
}
