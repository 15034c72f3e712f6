// Work over error: a curve per method, a mark per run. What a run is stands beside the pointer, or the keyboard's focus.
// Runs without a solution have no error: they are crosses in a column beside the axes. Zero has no place on a logarithmic axis,
// and is the best of errors: it has a band before the axis. A line below says how many runs lack what is asked for.
import { Delaunay } from "d3-delaunay";
import { line } from "d3-shape";
import { commandLine, element, menu } from "./dom.js";
import { legend } from "./legend.js";
import { lookedAt } from "./looked_at.js";
import { axes, drawAtWidth, logDomain, lookOf, symbolPath } from "./plot.js";

const number = (x) => (x === 0 || (x >= 0.01 && x < 1e5) ? String(Number(x.toPrecision(3))) : x.toExponential(2));
const NEAR = 40;  // pixels
const BESIDE = 44;  // the column of runs without a solution
const CROSS = "M-4,-4L4,4M4,-4L-4,4";
const LARGEST_ERROR = 10;  // beyond it a run says nothing: it is drawn on the edge, so that it does not squeeze the others
const ROUNDING = 1e-16;  // below it an error is rounding, which stands with the zeros where other errors are larger

/// Where a measure does not exist it is null.
const has = (run, field) => Number.isFinite(run[field]) && run[field] >= 0;
const counted = (n) => `${n} ${n === 1 ? "run" : "runs"}`;

function outcome(run) {
  if (run.status !== undefined) return ["no solution", run.status, run.reason, run.answer].filter(Boolean).join(": ");
  return `error ${number(run.error)} (relative ${number(run.relative)}); CPU time ${number(run.time)} ms, ` +
    `quartiles ${number(run.quartiles[0])} to ${number(run.quartiles[1])}`;
}

/// What is said of an error that is chosen, where `outcome` does not say it anyway.
function chosenError(run, { field, label }) {
  if (run.status !== undefined || field === "error" || field === "relative") return "";
  return element("p", {}, `${label}: ${number(run[field])}`);
}

function describe(run, curve, data, error) {
  const counters = data.works.filter((w) => w.field !== "time" && has(run, w.field)).map((w) => `${w.label} ${run[w.field]}`);
  return element("div", {},
    element("p", { class: "title" }, `${curve.label}, ${run.setting}`),
    element("p", {}, outcome(run)),
    chosenError(run, error),
    element("p", {}, `${counters.join(", ")}, events ${run.events}`),
    element("p", {}, commandLine(run.command)),
    element("p", {}, element("a", { href: `#${run.row}` }, "its row in the table")));
}

/// "deepest penetration [m]: 330 runs at zero, 172 without this number", or nothing where each run has its place on the axis.
function exceptions({ field, label }, drawn, all, isLow) {
  const zeros = drawn.filter((run) => run[field] === 0).length, tiny = drawn.filter(isLow).length - zeros;
  const missing = all.filter((run) => !has(run, field)).length;
  const kinds = [[zeros, "at zero"], [tiny, `below ${ROUNDING}`], [missing, "without this number"]];
  const parts = kinds.filter(([n]) => n).map(([n, what], k) => `${k ? n : counted(n)} ${what}`);
  return parts.length ? `${label}: ${parts.join(", ")}` : "";
}

/// Which runs are in the bands, on the left and below, and what the axes range over.
/// @param runs  that are shown  @param every  where all that is shown is zero, the axis is theirs: it says what zero is left of
function bandsOf(runs, every, error, work) {
  const positive = (field) => (runs.some((run) => run[field] > 0) ? runs : every).map((run) => run[field]).filter((x) => x > 0);
  const errors = positive(error), large = errors.filter((x) => x >= ROUNDING);
  return {
    isLeft: (run) => run[error] === 0 || (large.length > 0 && run[error] < ROUNDING),
    isBelow: (run) => run[work] === 0,
    xDomain: logDomain(large.length ? large : errors),
    yDomain: logDomain(positive(work)),
  };
}

/// Methods have a lane each in a band, so that they do not hide each other: method to share of the band's breadth.
function lanesOf(runs) {
  const methods = [...new Set(runs.map((run) => run.method))].sort((a, b) => a - b);
  return new Map(methods.map((method, k) => [method, (k + 0.5) / methods.length]));
}

/// Neighbours that a line may connect. A slope is read as an order, and a line from the axes into a band, whose breadth means
/// nothing, would have one: lines end there, and go on inside. They end as well where a run between has no place.
function pieces(runs, hasPlace, isLeft, isBelow) {
  const found = [];
  let last = null;
  for (const run of runs) {
    const place = hasPlace(run) ? `${isLeft(run)} ${isBelow(run)}` : null;
    if (place !== null && place === last) found.at(-1).push(run);
    else if (place !== null) found.push([run]);
    last = place;
  }
  return found.filter((piece) => piece.length > 1);
}

/// The measures that a run has; the first stays where no run has a solution.
function measured(list, isMeasured) {
  const found = list.filter(({ field }) => isMeasured(field));
  return found.length ? found : list.slice(0, 1);
}

const FEW = 8;  // curves that can be told from each other without a choice

/// Of each family the method that is first at the smallest error that the family reaches, to a power of ten; of a family without
/// a solution its first one, so that its failures are seen.
function bestOfFamilies({ methods, runs }) {
  if (methods.length <= FEW) return [...methods.keys()];
  const solved = runs.filter((run) => has(run, "error") && has(run, "time"));
  const decade = (run) => Math.ceil(Math.log10(Math.max(run.error, ROUNDING)) - 1e-9);
  return [...new Set(methods.map((m) => m.family))].map((family) => {
    const own = solved.filter((run) => methods[run.method].family === family);
    const least = Math.min(...own.map(decade));
    const [best] = own.filter((run) => decade(run) === least).sort((a, b) => a.time - b.time);
    return best?.method ?? methods.findIndex((m) => m.family === family);
  });
}

/// A link to a row of a run, or "#curve=METHOD", shows the curve.
function followLinks(data, place, key) {
  const follow = () => {
    const hash = decodeURIComponent(location.hash.slice(1));
    const run = [...data.runs, ...data.failures].find(({ row }) => row === hash);
    const k = run ? run.method : data.methods.findIndex((m) => `curve=${m.id}` === hash);
    if (k < 0) return;
    key.add(k);
    if (!run) place.scrollIntoView({ block: "start" });
  };
  addEventListener("hashchange", follow);
  follow();
}

export function drawWorkPrecision(place, data) {
  const curves = data.methods.map((m) => ({ label: m.label, id: m.id, group: m.family, ...lookOf(m) }));
  const errors = measured(data.errors, (field) => data.runs.some((run) => has(run, field)));
  const works = measured(data.works, (field) => data.runs.some((run) => has(run, field)));
  const state = { error: errors[0].field, work: works[0].field, width: 0 };
  const of = (list, field) => list.find((measure) => measure.field === field);
  const picture = element("div", { class: "picture" });
  const looked = lookedAt((run) => describe(run, curves[run.method], data, of(errors, state.error)),
    "Point at a run, or move with the arrow keys, for what it is; a click, or Enter, keeps it.");
  const notes = element("p", { class: "hint" });
  const choices = (list) => list.map(({ field, label }) => [field, label]);
  const first = bestOfFamilies(data);
  const key = legend(curves, () => draw(), { noun: "methods", first, why: first.length < curves.length ? "best of each family" : "" });
  place.append(
    element("div", { class: "menus" },
      menu("error", choices(errors), (field) => { state.error = field; draw(); }),
      menu("work", choices(works), (field) => { state.work = field; draw(); })),
    element("div", { class: "chart-columns" }, element("div", { class: "drawn" }, picture, notes, looked.said), key.element));

  function draw() {
    const { error, work } = state;
    const xMeasure = of(errors, error), yMeasure = of(works, work);
    const hasPlace = (run) => has(run, error) && has(run, work);
    const all = data.runs.filter((run) => key.shown.has(run.method)), runs = all.filter(hasPlace);
    const failures = data.failures.filter((run) => key.shown.has(run.method));
    const { isLeft, isBelow, xDomain: [least, most], yDomain } = bandsOf(runs, data.runs, error, work);
    const left = runs.filter(isLeft), below = runs.filter(isBelow), lanesX = lanesOf(left), lanesY = lanesOf(below);
    const isOnEdge = most > 1.6 * LARGEST_ERROR && least < LARGEST_ERROR;
    const said = [exceptions(xMeasure, runs, all, isLeft), exceptions(yMeasure, runs, all, isBelow)].filter(Boolean);
    const name = [`${yMeasure.label} over ${xMeasure.label}, ${counted(runs.length)}`, ...said];
    if (failures.length) name.push(`${failures.length} without a solution`);
    if (left.length) said.push("The band on the left has a column for each method");
    if (below.length) said.push("The band below has a line for each method");
    if (isOnEdge) said.push(`Errors above ${LARGEST_ERROR} lie on the right edge`);
    notes.textContent = said.map((sentence) => `${sentence}.`).join(" ");
    notes.hidden = !said.length;

    const height = Math.round(Math.max(320, Math.min(560, 0.7 * state.width)));
    const beside = failures.length ? BESIDE : 0;
    const { svg, area, x, y, zeroX, zeroY } = axes({
      width: state.width, height, xLabel: xMeasure.label, yLabel: yMeasure.label, beside, label: name.join("; "),
      xDomain: [least, isOnEdge ? LARGEST_ERROR : most], yDomain,
      zerosX: left.length && { lanes: lanesX.size, label: left.some((run) => run[error] > 0) ? `<${ROUNDING}` : "0" },
      zerosY: below.length && { lanes: lanesY.size, label: "0" },
    });
    x.clamp(true);
    const at = new Map();
    for (const run of runs) {
      at.set(run, [isLeft(run) ? zeroX(lanesX.get(run.method)) : x(run[error]),
        isBelow(run) ? zeroY(lanesY.get(run.method)) : y(run[work])]);
    }
    // Runs of a method in both bands would be one point: in the corner they stand in a row.
    for (const method of lanesY.keys()) {
      const row = below.filter((run) => run.method === method && isLeft(run));
      row.forEach((run, k) => { at.get(run)[0] = zeroX((k + 0.5) / row.length); });
    }
    const [bottom, top] = y.range();
    failures.forEach((run, k) => {
      at.set(run, [x.range()[1] + beside / 2, top + ((bottom - top) * (k + 1)) / (failures.length + 1)]);
    });
    const path = line();
    for (const k of key.shown) {
      const own = all.filter((run) => run.method === k);
      if (!own.some(hasPlace)) continue;
      const group = area.append("g").attr("class", `c${curves[k].colour}`).attr("data-method", curves[k].id);
      const d = pieces(own, hasPlace, isLeft, isBelow).map((piece) => path(piece.map((run) => at.get(run)))).join("");
      group.append("path").attr("class", "curve").style("stroke-dasharray", curves[k].dash || null).attr("d", d);
      for (const run of own.filter(hasPlace)) {
        group.append("path").attr("class", "mark").attr("d", symbolPath(curves[k].symbol))
          .attr("transform", `translate(${at.get(run)})`);
      }
    }
    if (failures.length) {
      area.append("text").attr("class", "label beside").attr("text-anchor", "middle")
        .attr("transform", `translate(${state.width - 6},${(top + bottom) / 2}) rotate(-90)`)
        .text(`no solution: ${counted(failures.length)}`);
    }
    for (const run of failures) {
      area.append("path").attr("class", `cross c${curves[run.method].colour}`).attr("d", CROSS)
        .attr("transform", `translate(${at.get(run)})`);
    }
    const items = [...runs, ...failures];
    const near = items.length ? Delaunay.from(items.map((run) => at.get(run))) : null;
    looked.attach({ svg, area, width: state.width }, {
      items, at: (run) => at.get(run),
      find: (px, py) => {
        const run = near && items[near.find(px, py)];
        return run && Math.hypot(at.get(run)[0] - px, at.get(run)[1] - py) < NEAR ? run : null;
      },
    });
    picture.replaceChildren(svg.node());
  }
  drawAtWidth(picture, (width) => { state.width = width; draw(); });
  followLinks(data, place, key);
}
