// Menus over the columns of a table that it names in data-filters: rows that fit none are hidden.
import { element, menu } from "./dom.js";

const ALL = "all";

export function addFilters(table) {
  const rows = [...table.tBodies[0].rows];
  const chosen = new Map();
  const count = element("output", { class: "count" });
  const show = () => {
    let shown = 0;
    for (const row of rows) {
      row.hidden = [...chosen].some(([column, value]) => value !== ALL && row.cells[column].textContent !== value);
      shown += !row.hidden;
    }
    count.textContent = `${shown} of ${rows.length} rows`;
  };
  const menus = element("div", { class: "menus" });
  for (const column of table.dataset.filters.split(" ").map(Number)) {
    const name = table.tHead.rows[0].cells[column].textContent;
    const values = [...new Set(rows.map((row) => row.cells[column].textContent))];
    menus.append(menu(name, [[ALL, ALL], ...values.map((value) => [value, value])], (value) => {
      chosen.set(column, value);
      show();
    }));
  }
  menus.append(count);
  table.closest(".scroll").before(menus);
  show();
}
