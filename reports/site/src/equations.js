// Typesets what is TeX, by KaTeX; where it cannot, the text stays as it is.
import "katex/dist/katex.min.css";
import katex from "katex";
import { schemeToBlocks } from "./scheme.js";
import { element } from "./dom.js";

function typeset(place, tex, displayMode) {
  try {
    katex.render(tex, place, { displayMode, throwOnError: true, output: "htmlAndMathml", strict: "ignore" });
    return true;
  } catch {
    return false;
  }
}

for (const place of document.querySelectorAll(".tex")) {
  const text = place.textContent;
  if (!typeset(place, text, place.tagName === "DIV")) place.textContent = text;
}

// The comment at the head of a method's file: its numbered lines are equations.
for (const place of document.querySelectorAll("pre.scheme")) {
  const set = element("div", { class: "scheme" });
  for (const block of schemeToBlocks(place.textContent)) {
    if (block.kind === "text") {
      set.append(element("p", {}, block.text));
      continue;
    }
    const line = element("div", { class: "equation", tabindex: "0", role: "group", "aria-label": `equation ${block.number}` });
    if (!typeset(line, block.tex, true)) line.append(element("code", {}, block.text));
    set.append(element("div", { class: "numbered" }, line, element("span", {}, `(${block.number})`)));
  }
  place.before(set);
  place.replaceWith(element("details", { class: "long" }, element("summary", {}, "As the file states it"), place.cloneNode(true)));
}
