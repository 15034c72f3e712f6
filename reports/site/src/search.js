// Methods, problems and experiments by a part of their name or title: a box above the lists of the first page, which '/' leads to.
import { element } from "./dom.js";

export function addSearch() {
  const lists = [...document.querySelectorAll("main ul.cards")];
  if (!lists.length) return;
  const heading = (list) => (list.previousElementSibling?.tagName === "H2" ? list.previousElementSibling : null);
  const items = lists.flatMap((list) => [...list.children]);
  const count = element("output", { class: "count" });
  const show = () => {
    const words = box.value.toLowerCase().split(/\s+/).filter(Boolean);
    for (const item of items) item.hidden = !words.every((word) => item.textContent.toLowerCase().includes(word));
    for (const list of lists) {
      const isEmpty = [...list.children].every((item) => item.hidden);
      list.hidden = isEmpty;
      if (heading(list)) heading(list).hidden = isEmpty;
    }
    count.textContent = words.length ? `${items.filter((item) => !item.hidden).length} of ${items.length}` : "";
  };
  const box = element("input", { type: "search", oninput: show, "aria-keyshortcuts": "/" });
  box.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" || !box.value) return;
    const found = items.filter((item) => !item.hidden).map((item) => item.querySelector("a"));
    (found.find((link) => link.textContent === box.value.trim()) ?? found[0])?.click();
  });
  const first = heading(lists[0]) ?? lists[0];
  first.before(element("div", { class: "menus search", role: "search" },
    element("label", { class: "menu" }, element("span", {}, "Find an experiment, a method or a problem ( / )"), box), count));
  addEventListener("keydown", (event) => {
    const isTyping = event.target.closest?.("input, select, textarea");
    if (event.key !== "/" || isTyping || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    box.focus();
    box.select();
  });
}
