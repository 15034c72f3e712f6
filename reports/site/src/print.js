// On paper stands what is open on the screen: a page with all its tables would be a hundred sheets. What is closed says how much it
// is, and which file has it.
import { element } from "./dom.js";

export function notePaper() {
  for (const details of document.querySelectorAll("main details")) {
    const rows = [...details.querySelectorAll("table")].reduce((sum, table) => sum + (table.tBodies[0]?.rows.length ?? 0), 0);
    if (!rows || details.parentElement.closest("details")) continue;
    const files = [...details.querySelectorAll(".links a")].map((link) => link.getAttribute("href")).filter((file) => file.endsWith(".csv"));
    const where = files.length ? `see ${files.map((file) => file.split("/").pop()).join(", ")}` : "closed when this was printed";
    details.after(element("p", { class: "paper" }, `${rows} rows: ${where}`));
  }
}
