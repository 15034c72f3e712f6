// The matrix of hard cases, for a reader who chooses cases, methods and verdicts. A cell says what decided it.
import { breakable, commandLine, element, menu } from "./dom.js";
import { pagesByName } from "./links.js";

const ALL = "all";
const PAPER_COLUMNS = 8;  // as many as A4 takes with words that can be read

/// The page of the problem that a case runs, as a command of the case names it; undefined where the site has none.
function problemPages(data) {
  const pages = pagesByName();
  return data.cases.map((_, k) => {
    const command = data.methods.find((row) => row.cells[k])?.cells[k].command ?? "";
    const [, name] = /--problem (\S+)/.exec(command) ?? /--scene (?:\S*\/)?(\S+?)\.json/.exec(command) ?? [];
    return pages.get(name);
  });
}

export function drawVerdicts(place, data) {
  const state = { group: ALL, verdict: ALL, name: "", chosen: null };
  const groups = [...new Set(data.cases.map((c) => c.group))];
  const words = Object.keys(data.meanings);
  const pages = problemPages(data);
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
    const page = pages[data.cases.indexOf(hardCase)];
    const links = [element("a", { href: `#${cell.row}` }, "its row in the table"), page && element("a", { href: page }, "the problem")];
    said.replaceChildren(element("div", {},
      element("p", { class: "title" }, `${method} on ${hardCase.id}, ${cell.setting}: ${cell.verdict}`),
      element("p", {}, `${hardCase.title}. ${data.meanings[cell.verdict]}: ${cell.number}`),
      element("p", {}, commandLine(cell.command)),
      element("p", { class: "links" }, ...links.filter(Boolean))));
    const covered = button.getBoundingClientRect().bottom + 8 - said.getBoundingClientRect().top;
    if (covered > 0) scrollBy({ top: covered });
  }

  /// @param most  columns of a table: on paper nobody scrolls, so that the matrix becomes several
  function draw(most = data.cases.length) {
    const fits = (cell) => cell && (state.verdict === ALL || cell.verdict === state.verdict);
    const ofGroup = data.cases.flatMap((c, k) => (state.group === ALL || c.group === state.group ? [k] : []));
    const rows = data.methods.filter((row) => row.method.includes(state.name) && ofGroup.some((k) => fits(row.cells[k])));
    const columns = ofGroup.filter((k) => rows.some((row) => fits(row.cells[k])));
    const tables = [];
    for (let k = 0; k === 0 || k < columns.length; k += most) tables.push(tableOf(columns.slice(k, k + most), rows, fits));
    scroll.replaceChildren(...tables);
    const shown = rows.reduce((sum, row) => sum + columns.filter((k) => fits(row.cells[k])).length, 0);
    const hidden = ofGroup.length - columns.length;
    count.textContent = `${shown} cells, ${rows.length} methods` +
      (hidden ? `; ${hidden} ${hidden > 1 ? "cases without such a cell are" : "case without such a cell is"} hidden` : "");
  }

  function tableOf(columns, rows, fits) {
    const head = element("tr", {}, element("th", { scope: "col", class: "text" }, "method"));
    for (const k of columns) {
      const name = pages[k] ? element("a", { href: pages[k] }, data.cases[k].id) : data.cases[k].id;
      head.append(element("th", { scope: "col", class: "turned", title: data.cases[k].title }, element("span", {}, name)));
    }
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
