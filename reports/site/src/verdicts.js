// The matrix of hard cases, for a reader who chooses cases, methods and verdicts. A cell says what decided it.
import { element, menu } from "./dom.js";

const ALL = "all";
const PAPER_COLUMNS = 8;  // as many as A4 takes with words that can be read

/// A name that goes on in another line behind a comma, rather than anywhere.
const breakable = (name) => name.split(/(?<=,)/).flatMap((part) => [part, element("wbr")]);

export function drawVerdicts(place, data) {
  const state = { group: ALL, verdict: ALL, name: "", chosen: null };
  const groups = [...new Set(data.cases.map((c) => c.group))];
  const words = Object.keys(data.meanings);
  const hint = element("p", { class: "hint" }, "Choose a cell for what decided it, and the command that repeats it.");
  const said = element("div", { class: "said", "aria-live": "polite" }, hint);
  const scroll = element("div", { class: "scroll matrix", tabindex: "0", role: "region", "aria-label": "Verdicts, methods by cases" });
  const count = element("output", { class: "count" });
  const search = element("input", { type: "search", oninput: () => { state.name = search.value.trim(); draw(); } });
  const chosen = (values) => [[ALL, ALL], ...values.map((value) => [value, value])];
  place.append(
    element("div", { class: "menus" },
      menu("cases", chosen(groups), (group) => { state.group = group; draw(); }),
      menu("verdict", [[ALL, ALL], ...words.map((word) => [word, `${word}: ${data.meanings[word]}`])],
        (verdict) => { state.verdict = verdict; draw(); }),
      element("label", { class: "menu" }, element("span", {}, "method contains"), search), count),
    scroll, said);

  // A second click on the chosen cell gives back the room that the text takes.
  function choose(button, method, hardCase, cell) {
    scroll.querySelector("[aria-pressed=true]")?.setAttribute("aria-pressed", "false");
    state.chosen = cell === state.chosen ? null : cell;
    button.setAttribute("aria-pressed", state.chosen !== null);
    if (!state.chosen) {
      said.replaceChildren(hint);
      return;
    }
    said.replaceChildren(element("div", {},
      element("p", { class: "title" }, `${method} on ${hardCase.id}, ${cell.setting}: ${cell.verdict}`),
      element("p", {}, `${hardCase.title}. ${data.meanings[cell.verdict]}: ${cell.number}`),
      element("p", {}, element("code", {}, cell.command))));
    const covered = button.getBoundingClientRect().bottom + 8 - said.getBoundingClientRect().top;
    if (covered > 0) scrollBy({ top: covered });
  }

  /// @param most  columns of a table: on paper nobody scrolls, so that the matrix becomes several
  function draw(most = data.cases.length) {
    const columns = data.cases.flatMap((c, k) => (state.group === ALL || c.group === state.group ? [k] : []));
    const fits = (cell) => cell && (state.verdict === ALL || cell.verdict === state.verdict);
    const rows = data.methods.filter((row) => row.method.includes(state.name) && columns.some((k) => fits(row.cells[k])));
    const tables = [];
    for (let k = 0; k === 0 || k < columns.length; k += most) tables.push(tableOf(columns.slice(k, k + most), rows, fits));
    scroll.replaceChildren(...tables);
    const shown = rows.reduce((sum, row) => sum + columns.filter((k) => fits(row.cells[k])).length, 0);
    count.textContent = `${shown} cells, ${rows.length} methods`;
  }

  function tableOf(columns, rows, fits) {
    const head = element("tr", {}, element("th", { scope: "col", class: "text" }, "method"));
    for (const k of columns)
      head.append(element("th", { scope: "col", class: "turned", title: data.cases[k].title }, element("span", {}, data.cases[k].id)));
    const body = element("tbody");
    for (const row of rows) {
      const line = element("tr", {}, element("th", { scope: "row", class: "text" }, ...breakable(row.method)));
      for (const k of columns) {
        const cell = row.cells[k], place = element("td");
        if (fits(cell)) place.append(buttonOf(row.method, data.cases[k], cell));
        line.append(place);
      }
      body.append(line);
    }
    return element("table", { class: "verdicts" }, element("thead", {}, head), body);
  }

  function buttonOf(method, hardCase, cell) {
    const button = element("button", {
      type: "button", class: `verdict ${cell.grade} v-${cell.verdict.replace(/\W+/g, "-")}`,
      title: `${method} on ${hardCase.id}: ${cell.number}`, "aria-pressed": String(cell === state.chosen),
      onclick: () => choose(button, method, hardCase, cell),
    }, cell.verdict);
    return button;
  }

  addEventListener("beforeprint", () => draw(PAPER_COLUMNS));
  addEventListener("afterprint", () => draw());
  draw();
}
