// Places are linear between samples, forces those of the last sample.
for (const figure of document.querySelectorAll("figure.motion")) {
  const data = JSON.parse(figure.querySelector("script").textContent);
  const svg = figure.querySelector("svg"), button = figure.querySelector("button");
  const slider = figure.querySelector("input"), clock = figure.querySelector("output");
  const speed = figure.querySelector("select"), ring = figure.querySelector(".impact");
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const FLASH = 0.25;  // seconds
  const names = { circle: ["cx", "cy"], rect: ["x", "y"], line: ["x1", "y1", "x2", "y2"] };
  for (const s of data.shapes) s.element = svg.querySelector(`[data-shape="${s.shape}"]`);
  data.arrows.forEach((a, k) => { a.element = svg.querySelector(`[data-arrow="${k}"]`); });

  function sampleBefore(t) {
    let low = 0, high = data.t.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (data.t[middle] <= t) low = middle; else high = middle;
    }
    return low;
  }
  const between = (a, b, part) => a.map((x, k) => x + part * (b[k] - x));
  function arrowPath(x, y, dx, dy) {
    const length = Math.hypot(dx, dy);
    if (length < 1.5) return "";
    const head = Math.min(7, length), nx = dx / length, ny = dy / length, half = 0.45 * head;
    const tx = x + dx, ty = y + dy, bx = tx - head * nx, by = ty - head * ny;
    return `M${x},${y}L${bx},${by}M${tx},${ty}L${bx - half * ny},${by + half * nx}` +
           `L${bx + half * ny},${by - half * nx}Z`;
  }
  function flash(t, k, part) {
    ring.setAttribute("visibility", "hidden");
    if (still.matches) return;
    for (const impact of data.impacts) {
      const arrow = data.arrows.find(a => a.contact === impact.contact), age = (t - impact.t) / FLASH;
      if (!arrow || age < 0 || age > 1) continue;
      const [cx, cy] = between(arrow.at[k], arrow.at[k + 1], part);
      const look = { cx, cy, r: 6 + 16 * age, opacity: 1 - age, visibility: "visible" };
      for (const name in look) ring.setAttribute(name, look[name]);
    }
  }
  function show(t) {
    const k = sampleBefore(t);
    const part = Math.min(1, Math.max(0, (t - data.t[k]) / (data.t[k + 1] - data.t[k])));
    for (const s of data.shapes) {
      const place = between(s.at[k], s.at[k + 1], part);
      names[s.element.tagName].forEach((name, i) => s.element.setAttribute(name, place[i]));
    }
    for (const a of data.arrows) {
      const [x, y] = between(a.at[k], a.at[k + 1], part), force = a.at[part === 1 ? k + 1 : k];
      a.element.setAttribute("d", arrowPath(x, y, force[2], force[3]));
    }
    flash(t, k, part);
    slider.value = t;
    clock.textContent = t.toFixed(2) + " s";
  }

  let t = 0, last = null;  // last: when the picture before this one was shown, while it plays
  function stop() { last = null; button.textContent = "Play"; }
  function play(now) {
    if (last === null) return;
    t = Math.min(data.T, t + Math.max(0, now - last) / 1000 * Number(speed.value));
    last = now;
    show(t);
    if (t < data.T) requestAnimationFrame(play); else stop();
  }
  button.addEventListener("click", () => {
    if (last !== null) return stop();
    if (t >= data.T) t = 0;
    button.textContent = "Pause";
    last = performance.now();
    requestAnimationFrame(play);
  });
  slider.addEventListener("input", () => { stop(); t = Number(slider.value); show(t); });
  figure.hidden = false;
  show(0);
}
