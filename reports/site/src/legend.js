// Names of curves that switch them on and off; with a double click, or Shift and Enter, one stays alone.
import { element } from "./dom.js";
import { symbolPath } from "./plot.js";

const SVG = "http://www.w3.org/2000/svg";

function sample({ colour, symbol, dashed }) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "-13 -7 26 14");
  svg.setAttribute("aria-hidden", "true");
  svg.classList.add(`c${colour}`);
  const line = document.createElementNS(SVG, "path");
  line.setAttribute("d", "M-12,0H12");
  line.setAttribute("class", dashed ? "curve dashed" : "curve");
  svg.append(line);
  if (symbol !== undefined) {
    const mark = document.createElementNS(SVG, "path");
    mark.setAttribute("d", symbolPath(symbol));
    mark.setAttribute("class", "mark");
    svg.append(mark);
  }
  return svg;
}

/// @param curves  [{ label, group, colour, symbol, dashed }]  @param onchange  of the set of those that are shown
export function legend(curves, onchange) {
  const shown = new Set(curves.keys());
  const buttons = [];
  const update = () => {
    buttons.forEach((button, k) => button.setAttribute("aria-pressed", shown.has(k)));
    onchange(shown);
  };
  const choose = (keys) => { shown.clear(); for (const k of keys) shown.add(k); update(); };
  const isolate = (k) => choose(shown.size === 1 && shown.has(k) ? curves.keys() : [k]);
  const toggle = (k) => { if (!shown.delete(k)) shown.add(k); update(); };
  const list = element("div", { class: "legend", role: "group", "aria-label": "Curves" });
  const all = element("button", { type: "button", onclick: () => choose(curves.keys()) }, "all");
  const none = element("button", { type: "button", onclick: () => choose([]) }, "none");
  list.append(element("p", { class: "hint" }, all, none,
    ` ${curves.length} curves; click: on and off; double click, or Shift and Enter: alone`));
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
      type: "button", "aria-pressed": "true",
      onclick: (event) => (event.shiftKey ? isolate(k) : toggle(k)),
      ondblclick: () => isolate(k),
    }, sample(curve), element("span", {}, curve.label));
    buttons.push(button);
    box.append(button);
  });
  return { element: list, shown };
}
