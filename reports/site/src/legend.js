// Names of curves that switch them on and off; with a double click, or Shift and Enter, one stays alone.
import { element } from "./dom.js";
import { markClass, symbolPath } from "./plot.js";

const SVG = "http://www.w3.org/2000/svg";

function sample({ colour, symbol, dash, isOpen }) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "-13 -7 26 14");
  svg.setAttribute("aria-hidden", "true");
  svg.classList.add(`c${colour}`);
  const line = document.createElementNS(SVG, "path");
  line.setAttribute("d", "M-12,0H12");
  line.setAttribute("class", "curve");
  if (dash) line.style.strokeDasharray = dash;
  svg.append(line);
  if (symbol !== undefined) {
    const mark = document.createElementNS(SVG, "path");
    mark.setAttribute("d", symbolPath(symbol));
    mark.setAttribute("class", markClass({ isOpen }));
    svg.append(mark);
  }
  return svg;
}

const NARROW = matchMedia("(max-width: 64rem)");  // there the legend stands below its chart
const MANY = 12;  // names, which are more than a third of a phone's screen

/// @param curves  [{ label, group, colour, symbol, dash }]  @param onchange  of the set of those that are shown
/// @param first  those that are shown at the start  @param why  what they are
/// @returns { element, shown, add }: `add` shows one more
export function legend(curves, onchange, { noun = "curves", first = [...curves.keys()], why = "" } = {}) {
  const shown = new Set(first);
  const buttons = [];
  const count = element("output", { class: "count" });
  const update = () => {
    buttons.forEach((button, k) => button.setAttribute("aria-pressed", shown.has(k)));
    count.textContent = `${shown.size} of ${curves.length} ${noun} shown`;
    onchange(shown);
  };
  const choose = (keys) => { shown.clear(); for (const k of keys) shown.add(k); update(); };
  const isolate = (k) => choose(shown.size === 1 && shown.has(k) ? curves.keys() : [k]);
  const toggle = (k) => { if (!shown.delete(k)) shown.add(k); update(); };
  const list = element("div", { class: "legend", role: "group", "aria-label": "Curves" });
  const all = element("button", { type: "button", onclick: () => choose(curves.keys()) }, `all ${noun}`);
  const few = why && element("button", { type: "button", onclick: () => choose(first) }, why);
  const none = element("button", { type: "button", onclick: () => choose([]) }, "none");
  list.append(element("p", { class: "hint" }, all, few, none, count));
  if (curves.length > MANY) {
    const names = element("button", { type: "button", class: "names", "aria-expanded": !NARROW.matches, onclick: () => {
      names.setAttribute("aria-expanded", !list.classList.toggle("brief"));
    } }, `names of all ${noun}`);
    list.classList.toggle("brief", NARROW.matches);
    list.firstChild.append(names);
  }
  list.append(element("p", { class: "hint" }, "Click: on and off; double click, or Shift and Enter: alone."));
  let group, box;
  curves.forEach((curve, k) => {
    if (curve.group !== group || !box) {
      group = curve.group;
      box = element("div", { class: "curves" });
      if (group) {
        const keys = curves.flatMap((other, j) => (other.group === group ? [j] : []));
        if (keys.length > 1) box.append(element("button", { type: "button", class: "group", onclick: () => choose(keys) }, `only ${group}`));
      }
      list.append(box);
    }
    const button = element("button", {
      type: "button", "aria-pressed": String(shown.has(k)),
      onclick: (event) => (event.shiftKey ? isolate(k) : toggle(k)),
      ondblclick: () => isolate(k),
    }, sample(curve), element("span", {}, curve.label));
    buttons.push(button);
    box.append(button);
  });
  count.textContent = `${shown.size} of ${curves.length} ${noun} shown`;
  return { element: list, shown, add: (k) => { if (!shown.has(k)) toggle(k); } };
}
