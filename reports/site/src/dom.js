// Elements, shortly: element("button", { type: "button" }, "text", child).
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value !== undefined && value !== false) made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children);
  return made;
}

// A menu with its label. @param choices  [value, text], the first is chosen
export function menu(label, choices, onchange) {
  const select = element("select", { onchange: () => onchange(select.value) });
  for (const [value, text] of choices) select.append(element("option", { value }, text));
  return element("label", { class: "menu" }, element("span", {}, label), select);
}
