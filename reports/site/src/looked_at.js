// The thing of a chart that is looked at: the nearest to the pointer, or the one that keys choose. A click, Enter or Space
// pins it, so that the links beside the chart can be reached; the same again, or another key, lets go.
import { element } from "./dom.js";

const STEPS = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 };

/// @param describe  the element that says what an item is  @param hint  what stands there before
/// @returns { said, attach }: the text, and what gives it a drawing; a chart is drawn anew often, its items stay the same
export function lookedAt(describe, hint) {
  const nothing = element("p", { class: "hint" }, hint);
  const said = element("div", { class: "said", "aria-live": "polite" }, nothing);
  let shown = null, pinned = null;

  /// @param items  in the order of the keys  @param at  the pixels of an item  @param find  the item near pixels, or null
  /// @param mark  is told of the item that is shown
  function attach({ svg, area, width }, { items, at, find, mark = () => {} }) {
    const ring = area.append("circle").attr("class", "ring").attr("r", 8).attr("visibility", "hidden");
    const show = (item) => {
      shown = item;
      ring.attr("visibility", "visible").attr("cx", at(item)[0]).attr("cy", at(item)[1]);
      said.replaceChildren(describe(item));
      mark(item);
    };
    const pin = (item) => {
      pinned = item;
      ring.classed("pinned", pinned !== null);
      said.classList.toggle("pinned", pinned !== null);
    };
    pin(items.includes(pinned) ? pinned : null);
    if (items.includes(shown)) show(shown);
    else if (shown !== null) {
      shown = null;
      said.replaceChildren(nothing);
    }
    const under = (event) => {
      const box = svg.node().getBoundingClientRect(), scale = width / box.width;
      return find((event.clientX - box.left) * scale, (event.clientY - box.top) * scale);
    };
    svg.on("pointermove", (event) => {
      const item = pinned === null ? under(event) : null;
      if (item !== null && item !== shown) show(item);
    });
    svg.on("click", (event) => {
      const item = under(event);
      pin(item === pinned ? null : item);
      if (item !== null) show(item);
    });
    const next = (key) => {
      if (key === "Home") return items[0];
      if (key === "End") return items.at(-1);
      const step = STEPS[key], k = items.indexOf(shown);
      if (!step) return null;
      return items.at(k < 0 ? Math.min(0, step) : (k + step) % items.length);
    };
    svg.attr("tabindex", 0).on("keydown", (event) => {
      if (!items.length || event.ctrlKey || event.altKey || event.metaKey) return;
      const isPin = event.key === "Enter" || event.key === " ";
      const item = isPin ? shown ?? items[0] : next(event.key);
      if (item === null) return;
      event.preventDefault();
      pin(isPin && item !== pinned ? item : null);
      show(item);
      svg.node().scrollIntoView({ block: "nearest" });
    });
  }
  return { said, attach };
}
