// What to choose, as an answer: class of scene and wanted error above, all answers as a matrix below. Both are read from
// the table of the choices (which_to_take() in bench/studies/fastest/choice.cpp), which stays for those who want it all.
import { element, menu } from "./dom.js";

const COLUMNS = ["class of scene", "wanted error", "take", "for example", "time [us]", "next", "next takes [times]", "why"];

export function addAnswer(block) {
  const table = block.querySelector("table");
  const heads = [...table.tHead.rows[0].cells].map((cell) => cell.textContent);
  const at = COLUMNS.map((name) => heads.indexOf(name));
  if (at.includes(-1)) return;
  const rows = [...table.tBodies[0].rows].map((row) => {
    const [group, level, take, example, time, next, factor, why] = at.map((k) => row.cells[k].textContent);
    return { group, level, take, example, time, next, factor, why };
  });
  const groups = [...new Set(rows.map((row) => row.group))], levels = [...new Set(rows.map((row) => row.level))];
  const state = { group: groups[0], level: levels[Math.min(1, levels.length - 1)] };
  const find = (group, level) => rows.find((row) => row.group === group && row.level === level);
  const times = (factor) => (factor === "-" ? "" : `${factor} ×`);
  const card = element("div", { class: "answer", "aria-live": "polite" });
  const cells = new Map();

  function show() {
    const row = find(state.group, state.level);
    card.replaceChildren();
    if (!row) card.append(element("p", {}, "No reference is good enough to say."));
    else {
      const reason = row.why.split("; ");
      card.append(
        element("p", { class: "take" }, row.take === "none" ? "Nothing that was tried reaches it" : row.take),
        element("p", {}, row.example && element("code", {}, row.example), row.time === "-" ? "" : ` takes ${row.time} µs`),
        element("p", {}, row.next === "-" ? "Nothing else reaches it." : `The next, ${row.next}, takes ${times(row.factor)} the time.`),
        element("ul", {}, ...reason.map((part) => element("li", {}, part))));
    }
    for (const [key, button] of cells) button.setAttribute("aria-pressed", key === `${state.group}|${state.level}`);
  }

  const groupMenu = menu("class of scene", groups.map((g) => [g, g]), (group) => { state.group = group; show(); });
  const levelMenu = menu("wanted error", levels.map((l) => [l, l]), (level) => { state.level = level; show(); });
  levelMenu.querySelector("select").value = state.level;
  const choose = (group, level) => {
    Object.assign(state, { group, level });
    groupMenu.querySelector("select").value = group;
    levelMenu.querySelector("select").value = level;
    show();
  };
  // The table is longer than a screen, and the answer stands above it.
  const chooseBelow = (group, level) => {
    choose(group, level);
    card.scrollIntoView({ block: "nearest" });
  };

  const head = element("tr", {}, element("th", { scope: "col", class: "text" }, "class of scene"),
    ...levels.map((level) => element("th", { scope: "col", class: "text" }, `error ${level}`)));
  const body = element("tbody");
  for (const group of groups) {
    const line = element("tr", {}, element("th", { scope: "row", class: "text" }, group));
    for (const level of levels) {
      const row = find(group, level), cell = element("td", { class: "text" });
      if (row) {
        const button = element("button", { type: "button", "aria-pressed": "false", onclick: () => chooseBelow(group, level) },
          element("strong", {}, row.take), " ", element("span", {}, times(row.factor)));
        cells.set(`${group}|${level}`, button);
        cell.append(button);
      }
      line.append(cell);
    }
    body.append(line);
  }
  const name = "Which family to take, and how many times as long the next takes";
  const whole = element("details", { class: "long" }, element("summary", {}, "All choices as a table, with the reasons"));
  block.prepend(
    element("div", { class: "question" }, element("div", { class: "menus" }, groupMenu, levelMenu), card),
    element("p", { class: "hint" }, `${name}:`),
    element("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": name },
      element("table", { class: "choices" }, element("thead", {}, head), body)));
  for (const rest of [...block.children].slice(3)) whole.append(rest);
  block.append(whole);
  show();
}
