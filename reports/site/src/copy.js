// Commands that repeat something, and entries of BibTeX, are there to be taken elsewhere: a click copies one.
// Those in tables get theirs with the columns of the table (tables.js).
import { commandLine, copyButton, element } from "./dom.js";

export const isCommand = (text) => /^ricochet [\w-]+/.test(text);

export function addCopyButtons() {
  for (const code of document.querySelectorAll("main code")) {
    if (isCommand(code.textContent) && !code.closest("td, .command-line")) code.replaceWith(commandLine(code.textContent));
  }
  for (const pre of document.querySelectorAll("main pre")) {
    const text = pre.textContent, first = text.split("\n", 1)[0];
    if (isCommand(first)) {
      pre.before(element("p", { class: "links" }, commandLine(first)));
      pre.textContent = text.slice(first.length + 1);
    } else if (text.startsWith("@")) pre.before(element("p", { class: "links" }, "BibTeX", copyButton(text, "BibTeX", pre)));
  }
}
