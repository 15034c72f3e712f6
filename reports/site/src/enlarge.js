// Still figures fit the width of a phone, so that their shape is seen; a tap shows one as large as it is drawn, with the place
// that was tapped where it was. On wider windows there is nothing to enlarge, and the style sheet hides the button.
import { element } from "./dom.js";

const NARROW = matchMedia("(max-width: 44rem)");  // as wide as an enlarged figure is at least, as in the style sheet

export function enlargeStills() {
  for (const image of document.querySelectorAll("figure > img.still:not(.moves)")) {
    const figure = image.parentElement;
    const button = element("button", { type: "button", class: "enlarge", "aria-pressed": "false" }, "Enlarge");
    /// @param x, y  shares of the image that stay where they are
    const toggle = (x, y) => {
      const before = image.getBoundingClientRect(), left = figure.getBoundingClientRect().left;
      button.setAttribute("aria-pressed", figure.classList.toggle("enlarged"));
      const after = image.getBoundingClientRect();
      figure.scrollLeft = x * after.width - (before.left + x * before.width - left);
      scrollBy({ top: y * (after.height - before.height), behavior: "instant" });
    };
    button.addEventListener("click", () => toggle(0, 0));
    image.addEventListener("click", (event) => {
      const box = image.getBoundingClientRect();
      if (NARROW.matches) toggle((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
    });
    figure.classList.add("fits");
    image.after(button);
  }
}
