// The contents are open where there is room beside the page; the page that is shown lists what is on it.
import { breakable } from "./dom.js";

const SECTIONS = "main h2[id], main .block[id] > figure.table > figcaption";

function sections() {
  const list = document.createElement("ul");
  list.className = "sections";
  for (const heading of document.querySelectorAll(SECTIONS)) {
    const text = heading.id ? heading.firstChild.textContent.trim() : heading.textContent.trim();
    if (text === list.lastChild?.textContent) continue;  // the table of the chart above
    const link = document.createElement("a");
    link.href = `#${heading.id || heading.closest(".block").id}`;
    link.textContent = text;
    const item = document.createElement("li");
    item.append(link);
    list.append(item);
  }
  return list;
}

export function openContents() {
  const contents = document.querySelector("details.contents");
  for (const link of contents.querySelectorAll("a")) link.replaceChildren(...breakable(link.textContent, true));
  const wide = matchMedia("(min-width: 64rem)");
  const follow = () => { contents.open = wide.matches; };
  wide.addEventListener("change", follow);
  follow();
  const here = contents.querySelector("[aria-current]");
  const list = sections();
  if (list.childElementCount > 1) here?.after(list);
  here?.scrollIntoView({ block: "nearest" });
}
