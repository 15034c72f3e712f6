// The matrix of hard cases, for a reader who chooses cases, methods and verdicts. A cell says what decided it.
import { element, menu } from "./dom.js";

const ALL = "all";

export function drawVerdicts(place, data, id) {
  const state = { group: ALL, verdict: ALL, name: "" };
  const groups = [...new Set(data.cases.map((c) => c.group))];
  const words = Object.keys(data.meanings);
  const said = element("div", { class: "said", "aria-live": "polite" },
    element("p", { class: "hint" }, "Choose a cell for what decided it, and the command that repeats it."));
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

  function say(method, hardCase, cell) {
    said.replaceChildren(element("div", {},
      element("p", { class: "title" }, `${method} on ${hardCase.id}, ${cell.setting}: ${cell.verdict}`),
      element("p", {}, `${hardCase.title}. ${data.meanings[cell.verdict]}: ${cell.number}`),
      element("p", {}, element("code", {}, cell.command))));
  }

  function draw() {
    const columns = data.cases.flatMap((c, k) => (state.group === ALL || c.group === state.group ? [k] : []));
    const fits = (cell) => cell && (state.verdict === ALL || cell.verdict === state.verdict);
    const rows = data.methods.filter((row) => row.method.includes(state.name) && columns.some((k) => fits(row.cells[k])));
    const table = element("table", { class: "verdicts" });
    const head = element("tr", {}, element("th", { scope: "col", class: "text" }, "method"));
    for (const k of columns)
      head.append(element("th", { scope: "col", class: "turned", title: data.cases[k].title }, element("span", {}, data.cases[k].id)));
    table.append(element("thead", {}, head));
    const body = element("tbody");
    let shown = 0;
    for (const row of rows) {
      const line = element("tr", {}, element("th", { scope: "row", class: "text" }, row.method));
      for (const k of columns) {
        const cell = row.cells[k];
        const place = element("td");
        if (fits(cell)) {
          ++shown;
          place.append(element("button", {
            type: "button", class: `verdict ${cell.grade} v-${cell.verdict.replace(/\W+/g, "-")}`,
            title: `${row.method} on ${data.cases[k].id}: ${cell.number}`,
            onclick: () => say(row.method, data.cases[k], cell),
          }, cell.verdict));
        }
        line.append(place);
      }
      body.append(line);
    }
    table.append(body);
    scroll.replaceChildren(table);
    count.textContent = `${shown} cells, ${rows.length} methods`;
  }
  draw();
}
