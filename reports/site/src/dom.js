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

// A name that goes on in another line behind a comma, or in narrow places between its words, rather than anywhere.
export const breakable = (name, isNarrow) => name.split(isNarrow ? /(?<=[,_])/ : /(?<=,)/).flatMap((part, k) => (k ? [element("wbr"), part] : [part]));

const TOLD = 4000;  // milliseconds
// A region that is there before its text changes is read aloud, one that comes with its text is not.
const told = document.body.appendChild(element("div", { class: "told", role: "status" }));
let timer = 0;

/// Says what a click did, to those who see it and to those who do not.
export function tell(text) {
  clearTimeout(timer);
  told.textContent = text;
  timer = setTimeout(() => told.replaceChildren(), TOLD);
}

/// The clipboard is there in secure contexts only, which a page from a disk is in some browsers; a selection is copied in all.
async function toClipboard(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    const focused = document.activeElement;
    const area = element("textarea", { class: "aside", readonly: true, "aria-hidden": "true", tabindex: "-1" }, text);
    document.body.append(area);
    area.select();
    const isCopied = document.execCommand("copy");
    area.remove();
    focused?.focus({ preventScroll: true });
    return isCopied;
  }
}

/// @param what  "command": of its name for those who hear it  @param place  what is selected where a browser copies nothing
export function copyButton(text, what, place) {
  const copy = async () => {
    if (await toClipboard(text)) tell(`Copied: ${text.length > 300 ? `the ${what}` : text}`);
    else {
      getSelection().selectAllChildren(place);
      tell(`The ${what} is selected: copy it with the keyboard.`);
    }
  };
  return element("button", { type: "button", class: "copy", title: text, "aria-label": `Copy the ${what}`, onclick: copy }, "copy");
}

/// A command, with what copies it.
export function commandLine(text) {
  const code = element("code", { title: text }, text);
  return element("span", { class: "command-line" }, code, copyButton(text, "command", code));
}
