// Names of methods and problems in tables lead to their pages, which the contents know.
import { element } from "./dom.js";

export function pagesByName() {
  const pages = new Map();
  for (const link of document.querySelectorAll("nav a")) {
    if (/(methods|problems)\//.test(link.getAttribute("href"))) pages.set(link.textContent, link.getAttribute("href"));
  }
  return pages;
}

export function linkNames() {
  const pages = pagesByName();
  for (const cell of document.querySelectorAll("main td.text")) {
    const text = cell.textContent, name = /^\w+/.exec(text)?.[0];
    if (!pages.has(name) || /\s/.test(text) || !/^($|[:,])/.test(text.slice(name.length))) continue;
    cell.replaceChildren(element("a", { href: pages.get(name) }, text));
  }
}
