// Tables that are wider than the page: what is beyond an edge is announced by a shadow and a button, the first column stays,
// and so do the buttons that copy commands. A table first gives up the words of its commands, then breadth of its texts,
// then the ends of long ones, so that no row is high for a cell that nobody sees.
import { breakable, commandLine, element } from "./dom.js";
import { isCommand } from "./copy.js";

const SHORT = 18, LONG = 60;  // letters: such a text stays in one line; from there on the program calls a cell long
const NARROW = matchMedia("(max-width: 48rem)");
const OWN_LAYOUT = ".choices, .verdicts";

/// Letters that a column of text has room for at least: three lines are read at a glance, and six where all then fits.
function lettersOf(longest, isTight) {
  if (longest <= SHORT) return longest;
  if (longest <= LONG) return Math.max(SHORT, Math.ceil(longest / (isTight ? 3 : 2)));
  if (NARROW.matches) return 24;
  return isTight ? Math.min(40, Math.max(28, Math.ceil(longest / 6))) : Math.min(60, Math.max(32, Math.ceil(longest / 3)));
}

/// Columns of commands get their buttons, columns of text their widths. Tables have thousands of cells: it is done when one is seen.
function prepare(table) {
  const rows = [...table.tBodies[0].rows];
  [...table.tHead.rows[0].cells].forEach((head, k) => {
    if (!head.classList.contains("text")) return;
    const cells = rows.map((row) => row.cells[k]), texts = cells.map((cell) => cell.textContent);
    if (texts.some(isCommand)) {
      head.classList.add("command");
      cells.forEach((cell, r) => {
        cell.classList.add("command");
        if (isCommand(texts[r])) cell.replaceChildren(commandLine(texts[r]));
      });
      return;
    }
    const longest = Math.max(0, ...texts.map((text) => text.length));
    head.dataset.letters = longest;
    head.classList.toggle("holds-long", longest > LONG);
    if (longest <= SHORT || longest > 2 * LONG) return;
    cells.forEach((cell, r) => {
      const place = cell.querySelector("a") ?? cell;
      if (!texts[r].includes(" ") && place.textContent === texts[r]) place.replaceChildren(...breakable(texts[r], true));
    });
  });
  table.classList.add("sized");
}

function setWidths(table) {
  const isTight = table.classList.contains("tight");
  for (const head of table.tHead.rows[0].cells) {
    if (head.dataset.letters) head.style.setProperty("--letters", lettersOf(Number(head.dataset.letters), isTight));
  }
}

/// A box that scrolls, what says so, and, around a table of the program, what the table gives up to fit.
class Edge {
  constructor(scroll) {
    this.scroll = scroll;
    this.table = scroll.querySelector(":scope > table");
    this.isSized = this.table !== null && this.table.tHead !== null && !this.table.matches(OWN_LAYOUT);
    this.box = element("div", { class: "edge" });
    this.more = element("button", { type: "button", onclick: () => this.go() });
    this.whole = element("button", { type: "button", "aria-pressed": "false", onclick: () => this.showWhole() }, "Whole texts");
    this.tools = element("div", { class: "table-tools", hidden: true }, this.more, this.whole);
    scroll.before(this.tools, this.box);
    this.box.append(scroll);
    this.width = 0;
    scroll.addEventListener("scroll", () => this.update(), { passive: true });
    if (this.isSized) {
      this.table.addEventListener("click", (event) => this.showRow(event));
      this.table.addEventListener("pointerover", ({ target }) => { if (isClipped(target)) target.title = target.textContent; });
    }
    new ResizeObserver(() => this.resized()).observe(scroll);
  }

  overflows() { return this.scroll.scrollWidth > this.scroll.clientWidth + 1; }

  resized() {
    const width = this.scroll.clientWidth;
    if (!width) return;  // in what is closed
    if (width !== this.width && this.isSized) {
      if (!this.table.classList.contains("sized")) prepare(this.table);
      this.width = width;
      this.table.classList.remove("compact", "tight", "crowded");
      setWidths(this.table);
      for (const step of ["compact", "tight", "crowded"]) {
        if (!this.overflows()) break;
        this.table.classList.add(step);
        setWidths(this.table);
      }
      this.whole.hidden = !this.table.matches(".crowded:has(td.long)");
    } else if (!this.isSized) this.whole.hidden = true;
    this.update();
  }

  update() {
    const { scroll, box } = this, isWide = this.overflows();
    this.more.hidden = !isWide;
    this.tools.hidden = !isWide && this.whole.hidden;
    box.classList.toggle("more-left", isWide && scroll.scrollLeft > 1);
    box.classList.toggle("more-right", isWide && scroll.scrollLeft < scroll.scrollWidth - scroll.clientWidth - 1);
    if (!isWide) return;
    const heads = this.table?.tHead ? [...this.table.tHead.rows[0].cells] : [];
    const last = heads.at(-1)?.classList.contains("command") ? heads.at(-1).offsetWidth : 0;
    const isStuck = heads.length && getComputedStyle(heads[0]).left === "0px";
    box.style.setProperty("--first", `${isStuck ? heads[0].offsetWidth : 0}px`);
    box.style.setProperty("--last", `${last}px`);
    const edge = scroll.scrollLeft + scroll.clientWidth - last + 1;
    const beyond = heads.filter((head) => !head.classList.contains("command") && head.offsetLeft + head.offsetWidth > edge).length;
    this.isAtEnd = !box.classList.contains("more-right");
    this.more.textContent = this.isAtEnd ? "← back to the first" : beyond ? `${beyond} more ${beyond > 1 ? "columns" : "column"} →` : "more →";
  }

  go() {
    const first = parseFloat(this.box.style.getPropertyValue("--first"));
    if (this.isAtEnd) this.scroll.scrollLeft = 0;
    else this.scroll.scrollLeft += 0.9 * (this.scroll.clientWidth - first);
  }

  showWhole() {
    const isWhole = this.table.classList.toggle("whole");
    this.whole.setAttribute("aria-pressed", isWhole);
    this.update();
  }

  /// A tap on what is cut opens its row; the button above does so for all, by the keyboard too.
  showRow({ target }) {
    const cell = target.closest("td.long"), row = cell?.parentElement;
    if (!cell || target.closest("a, button")) return;
    if (row.classList.contains("whole") || isClipped(cell)) row.classList.toggle("whole");
  }
}

const isClipped = (cell) => cell.matches?.("td.long") && cell.scrollWidth > cell.clientWidth;

export function markEdges() {
  for (const scroll of document.querySelectorAll("main .scroll")) new Edge(scroll);
}
