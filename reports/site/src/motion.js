// Scenes in motion are images that move by themselves, and without an end. What moves beside a text can be stopped, and
// stands still from the start where the reader has asked the system for less motion.
import { element } from "./dom.js";

const CALM = matchMedia("(prefers-reduced-motion: reduce)");
const DATA = "data:image/svg+xml,";

/// A drawing whose text is at hand stands in a tree of its own: its names and styles are not those of the page.
function inlined(image, text) {
  const svg = document.adoptNode(new DOMParser().parseFromString(text, "image/svg+xml").documentElement);
  const { width, height } = svg.viewBox.baseVal;
  for (const name of ["width", "height", "style"]) svg.removeAttribute(name);
  svg.setAttribute("style", "display: block; width: 100%; height: 100%");
  const host = element("div", { class: "scene moves", role: "img", "aria-label": image.alt, style: `aspect-ratio: ${width} / ${height}` });
  host.attachShadow({ mode: "open" }).append(svg);
  image.replaceWith(host);
  return { place: host, pause: () => svg.pauseAnimations(), play: () => svg.unpauseAnimations() };
}

/// Of a file, which a page from a disk cannot read, the picture that is shown now is drawn over it.
function covered(image) {
  const canvas = element("canvas", { class: "scene moves", role: "img", "aria-label": image.alt, hidden: true });
  image.classList.add("moves");
  image.loading = "eager";
  image.after(canvas);
  const pause = async () => {
    await image.decode();
    const scale = devicePixelRatio;
    canvas.width = scale * image.naturalWidth;
    canvas.height = scale * image.naturalHeight;
    canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
    image.hidden = true;
    canvas.hidden = false;
  };
  return { place: canvas, pause, play: () => { image.hidden = false; canvas.hidden = true; } };
}

export function holdMotions() {
  for (const image of document.querySelectorAll("main figure > img")) {
    const source = image.getAttribute("src"), text = source.startsWith(DATA) ? decodeURIComponent(source.slice(DATA.length)) : "";
    if (!text.includes("<animate") && !/_scene\.svg$/.test(source)) continue;
    const { place, pause, play } = text ? inlined(image, text) : covered(image);
    let moves = true;
    const button = element("button", { type: "button", class: "motion", onclick: () => toggle() });
    const toggle = () => {
      moves = !moves;
      button.textContent = moves ? "Pause" : "Play";
      (moves ? play : pause)();
    };
    button.textContent = "Pause";
    place.after(button);
    if (CALM.matches) toggle();
    CALM.addEventListener("change", () => { if (CALM.matches && moves) toggle(); });
  }
}
