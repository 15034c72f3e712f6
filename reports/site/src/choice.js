// What to choose, as an answer: class of scene and wanted error above, all answers as a matrix below. Both are made from the
// data of the choices (choice_data() in bench/studies/grid/fastest_choice.cpp); their table stays for those who want it all.
import { commandLine, element, menu } from "./dom.js";
import { pagesByName } from "./links.js";

const errorText = (level) => level.toExponential(0).replace(/e([+-])(\d)$/, "e$10$2");
const times = (factor) => (Number.isFinite(factor) ? `${factor.toFixed(factor < 9.95 ? 1 : 0)} ×` : "");

// The name leads to its page, where there is one. @param name  "fesd:gauss:4", "two_balls_spring"
function linked(name, pages) {
  const page = pages.get(/^\w+/.exec(name)?.[0]);
  return page ? element("a", { href: page }, name) : name;
}

function reasons({ families, never, scenes }) {
  const speed = (slower) => (slower < 1.005 ? "always the fastest" : `${times(slower)} the time of the fastest`);
  return [...families.map((f) => `${f.name} reaches it on ${f.reached} of ${scenes} ${scenes === 1 ? "scene" : "scenes"}, ${speed(f.slower)}`),
    ...(never.length ? [`Not reached by ${never.join(", ")}`] : []),
    ...(scenes === 1 ? ["One scene only: look at its problem before you trust the class"] : [])];
}

// The elements of an answer. @param choice  undefined where no reference is good enough
function answer(choice, pages) {
  if (!choice) return [element("p", {}, "No reference is good enough to say.")];
  const [take, next] = choice.families, { run } = choice;
  if (!take) return [element("p", { class: "take" }, "Nothing that was tried reaches it")];
  return [
    element("p", { class: "take" }, take.name),
    element("p", {}, "For example ", element("code", {}, linked(run.method, pages)),
      `, which takes ${run.microseconds.toPrecision(3)} µs on `, linked(run.scene, pages), "."),
    element("p", {}, !next ? "Nothing else reaches it."
      : Number.isFinite(choice.factor) ? `The next, ${next.name}, takes ${times(choice.factor)} the time.` : `The next is ${next.name}, on other scenes.`),
    element("p", {}, commandLine(run.command)),
    element("ul", {}, ...reasons(choice).map((part) => element("li", {}, part)))];
}

export function addAnswer(block) {
  const { groups, levels, choices } = JSON.parse(block.querySelector("script").textContent);
  const pages = pagesByName();
  const state = { group: 0, level: Math.min(1, levels.length - 1) };
  const find = (group, level) => choices.find((choice) => choice.group === group && choice.level === level);
  const card = element("div", { class: "answer", "aria-live": "polite" });
  const cells = new Map();

  function show() {
    card.replaceChildren(...answer(find(state.group, state.level), pages));
    for (const [key, button] of cells) button.setAttribute("aria-pressed", key === `${state.group}|${state.level}`);
  }

  const groupMenu = menu("class of scene", groups.map((g, k) => [k, g]), (group) => { state.group = +group; show(); });
  const levelMenu = menu("wanted error", levels.map((l, k) => [k, errorText(l)]), (level) => { state.level = +level; show(); });
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
    ...levels.map((level) => element("th", { scope: "col", class: "text" }, `error ${errorText(level)}`)));
  const body = element("tbody");
  for (const [group, title] of groups.entries()) {
    const line = element("tr", {}, element("th", { scope: "row", class: "text" }, title));
    for (const level of levels.keys()) {
      const choice = find(group, level), cell = element("td", { class: "text" });
      if (choice) {
        const button = element("button", { type: "button", "aria-pressed": "false", onclick: () => chooseBelow(group, level) },
          element("strong", {}, choice.families[0]?.name ?? "none"), " ", element("span", {}, times(choice.factor ?? NaN)));
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
