// Scenes in motion are images that move by themselves, and without an end. What moves beside a text can be stopped, and
// stands still from the start where the reader has asked the system for less motion.
import { element } from "./dom.js";

const CALM = matchMedia("(prefers-reduced-motion: reduce)");
const DATA = "data:image/svg+xml,";

/// A drawing whose text is at hand stands in a tree of its own: its names and styles are not those of the page.
function inlined(image, text) {
  const host = element("div", { class: "scene moves", role: "img", "aria-label": image.alt });
  image.replaceWith(host);
  const root = host.attachShadow({ mode: "open" });
  root.innerHTML = text;
  const [svg, ...inner] = root.querySelectorAll("svg"), { width, height } = svg.viewBox.baseVal;
  for (const name of ["width", "height"]) svg.removeAttribute(name);
  svg.setAttribute("style", "display: block; width: 100%; height: 100%");
  host.style.aspectRatio = `${width} / ${height}`;
  // Drawings inside of a drawing have a time of their own in Chromium; what has no layout yet waits until it is told again.
  const pause = () => { for (const each of [svg, ...inner]) each.pauseAnimations(); };
  const play = () => { for (const each of [svg, ...inner]) each.unpauseAnimations(); };
  host.getBoundingClientRect();
  pause();
  return { place: host, pause, play };
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

/// The image becomes one that can be stopped, by a button below it.
function hold(image, text) {
  const { place, pause, play } = text ? inlined(image, text) : covered(image);
  const button = element("button", { type: "button", class: "motion", onclick: () => set(!moves) });
  let moves;
  const set = (isMoving) => {
    moves = isMoving;
    button.textContent = moves ? "Pause" : "Play";
    (moves ? play : pause)();
  };
  place.after(button);
  set(!CALM.matches);
  CALM.addEventListener("change", () => { if (CALM.matches) set(false); });
}

export function holdMotions() {
  for (const image of document.querySelectorAll("main figure > img")) {
    const source = image.getAttribute("src"), text = source.startsWith(DATA) ? decodeURIComponent(source.slice(DATA.length)) : "";
    if (!text.includes("<animate") && !/_scene\.svg$/.test(source)) continue;
    const closed = image.closest("details:not([open])");
    // What is closed has no layout: its drawing comes when it is opened.
    if (closed) closed.addEventListener("toggle", () => hold(image, text), { once: true });
    else hold(image, text);
  }
}
