// The site in a browser: draws, toggles, filters; no error on the console, no request beyond the disk, nothing that is
// cut off at three widths, no serious finding of axe.   node site_test.mjs RICOCHET   or   node site_test.mjs --site FOLDER
// With --only NAME behind either, one of the tests alone, by the name of its function.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, readdirSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";

const SOURCE = resolve(import.meta.dirname, "../../reports/site");
const SKIPPED = 77;
const skip = (why) => { console.log(`skipped: ${why}`); process.exit(SKIPPED); };

const chromium_path = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(existsSync);
if (!chromium_path) skip("no Chromium (Debian: chromium)");
if (!existsSync(join(SOURCE, "node_modules"))) skip("no packages: npm ci in reports/site");
const require = createRequire(join(SOURCE, "package.json"));
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

const WIDTHS = [390, 768, 1400];
const FIRST_VIEW = 2e6;  // bytes, of index.html and what it loads

// Small experiments with everything that the site draws.
const EXPERIMENTS = {
  grid: {
    id: "grid", title: "Work over error", description: "d.", problem: "bouncing_ball", quick: true,
    methods: [
      { method: "moreau_jean", steps: [20, 50, 100, 200] }, { method: "anitescu_potra", steps: [20, 50, 100, 200] },
      { method: "fesd:gauss:2", steps: [10, 20, 40] }, { method: "fesd:gauss:2,n_fe=1", steps: [2, 3], may_fail: "one element does not do" },
      { method: "fesd_adaptive:gauss:4", tolerances: [1e-3, 1e-6, 1e-9] },
    ],
  },
  fastest: {
    id: "fastest", kind: "fastest", title: "Which method", description: "d.", quick: true, time_limit: 10, levels: [0.1, 1e-3],
    families: [
      { name: "time stepping", methods: ["moreau_jean"], steps: { from: 20, to: 20000, per_decade: 1 } },
      { name: "FESD-J", methods: ["fesd_adaptive:radau-iia:3"], tolerances: { from: 1e-2, to: 1e-6, per_decade: 1 } },
    ],
    scenes: [{ problem: "bouncing_ball", group: "impacts" },
      { problem: "belt_oscillator", group: "stick and slip", parameters: { duration: 2 } }],
  },
};

const HISTORY = [0, 1, 2].map((k) => ({ commit: `abc000${k}`, date: `2026-01-0${k + 1}`, subject: `change ${k}`, rows: 3,
  verdicts: { ok: 1 }, changes: [{ text: `grid: moreau_jean: order 1 to ${k}` }] }));
const CHANGED = [
  { title: "Counters and errors", label: "over the first value", is_log: true,
    curves: [{ label: "grid: moreau_jean, steps", points: [[0, 1], [1, 1.05], [2, 1.1]] }] },
  { title: "Orders", label: "order", is_log: false, curves: [{ label: "grid: moreau_jean, order", points: [[0, 1], [2, -0.5]] }] }];

function makeSite(program, folder) {
  const run = (...args) => execFileSync(program, args, { stdio: ["ignore", "ignore", "inherit"] });
  for (const [name, experiment] of Object.entries(EXPERIMENTS)) {
    writeFileSync(join(folder, `${name}.json`), JSON.stringify(experiment));
    run("run-experiment", join(folder, `${name}.json`), "-o", join(folder, "results"));
  }
  run("run-experiment", "hard_cases", "-p", "disc_in_chute", "-p", "ball_row*", "-m", "moreau_jean", "-m", "fesd:gauss:3", "-o", join(folder, "results"));
  writeFileSync(join(folder, "history.json"), JSON.stringify(HISTORY));
  writeFileSync(join(folder, "curves.json"), JSON.stringify(CHANGED));
  const results = readdirSync(join(folder, "results")).filter((name) => name.endsWith(".jsonl")).sort();
  run("report", ...results.map((name) => join(folder, "results", name)), "--history", folder, "-o", join(folder, "report"));
  return join(folder, "report");
}

const isProgram = process.argv[2] !== "--site";
const folder = isProgram ? mkdtempSync(join(tmpdir(), "ricochet-site-")) : "";
const site = isProgram ? makeSite(resolve(process.argv[2]), folder) : resolve(process.argv[3]);
const hard = readdirSync(join(site, "experiments")).find((name) => /^hard_cases.*\.html$/.test(name));
const grid = existsSync(join(site, "experiments/grid.html")) ? "grid" : "two_balls_order";
const fastest = existsSync(join(site, "experiments/fastest.html")) ? "fastest" : "opponents";
const PAGES = ["index.html", "environment.html", "cite.html", `experiments/${grid}.html`, `experiments/${fastest}.html`, `experiments/${hard}`,
  "methods/moreau_jean.html", "methods/fesd.html", "problems/two_balls_spring.html", "problems/slider_crank_stop.html",
  ...(existsSync(join(site, "history.html")) ? ["history.html"] : [])];

const browser = await chromium.launch({ executablePath: chromium_path, args: ["--no-sandbox"] });
const complaints = [];

async function open(name, width, colorScheme = "light", prepare = () => {}, reducedMotion = "reduce") {
  const page = await browser.newPage({ viewport: { width, height: 900 }, colorScheme, reducedMotion });
  page.on("console", (message) => { if (message.type() === "error") complaints.push(`${name}: console: ${message.text()}`); });
  page.on("pageerror", (error) => complaints.push(`${name}: ${error.message}`));
  page.on("request", (request) => {
    if (!/^(file|data|blob):/.test(request.url())) complaints.push(`${name}: asks for ${request.url()}`);
  });
  await prepare(page);
  await page.goto(`file://${site}/${name}`);
  return page;
}

/// What sticks out of the page, or of a box that cuts it off without an ellipsis, or of one that scrolls and does not say so.
const cutOff = () => {
  const found = [];
  if (document.documentElement.scrollWidth > innerWidth) found.push(`the page is ${document.documentElement.scrollWidth} wide`);
  for (const e of document.querySelectorAll("main *")) {
    const style = getComputedStyle(e);
    if (!["hidden", "clip"].includes(style.overflowX) || !e.textContent.trim() || e.closest(".katex, svg") || !e.clientWidth) continue;
    if (style.textOverflow === "ellipsis") continue;
    if (e.scrollWidth > e.clientWidth + 1) found.push(`${e.tagName}.${e.className}: ${e.textContent.slice(0, 40)}`);
  }
  for (const box of document.querySelectorAll("main .scroll")) {
    if (box.closest("details:not([open])") || box.scrollWidth <= box.clientWidth + 1) continue;
    const edge = box.closest(".edge"), button = edge?.previousElementSibling?.querySelector("button");
    const isMarked = edge?.classList.contains("more-right") && getComputedStyle(edge, "::after").visibility === "visible";
    if (!isMarked || !button?.offsetHeight) found.push(`no shadow or button at the edge of ${box.getAttribute("aria-label")}`);
    const first = box.querySelector("th"), before = first?.getBoundingClientRect().left;
    box.scrollLeft = box.scrollWidth;
    if (first && Math.abs(first.getBoundingClientRect().left - before) > 1 && innerWidth < 800)
      found.push(`the first column of ${box.getAttribute("aria-label")} scrolls away`);
    box.scrollLeft = 0;
  }
  for (const button of document.querySelectorAll("td.command button.copy")) {
    if (button.closest("details:not([open])")) continue;
    const box = button.getBoundingClientRect();
    if (box.left < 0 || box.right > innerWidth) found.push(`a button that copies a command is out of sight: ${button.title}`);
  }
  for (const text of document.querySelectorAll(".picture svg text")) {
    const box = text.getBoundingClientRect(), frame = text.ownerSVGElement.getBoundingClientRect();
    if (box.left < frame.left - 1 || box.right > frame.right + 1 || box.bottom > frame.bottom + 1 || box.top < frame.top - 1)
      found.push(`label ${text.textContent} leaves its chart`);
  }
  return found;
};

/// Observers of sizes have been told of the first layout when a second frame is drawn.
const framesDrawn = (page) =>
  page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

async function looksRight(name) {
  for (const width of WIDTHS) {
    const page = await open(name, width);
    await framesDrawn(page);
    for (const what of await page.evaluate(cutOff)) complaints.push(`${name} at ${width}: ${what}`);
    await page.close();
  }
  for (const scheme of ["light", "dark"]) {
    const page = await open(name, 1400, scheme);
    await page.evaluate(axe);
    const { violations } = await page.evaluate(() => axe.run(document, { resultTypes: ["violations"], preload: false }));
    for (const v of violations.filter((v) => ["serious", "critical"].includes(v.impact)))
      complaints.push(`${name}, ${scheme}: axe: ${v.id}: ${v.help}: ${v.nodes[0].html.slice(0, 160)} (${v.nodes.length} places)`);
    await page.close();
  }
}

async function isSeen(locator) {
  const box = await locator.boundingBox(), { height } = locator.page().viewportSize();
  return box !== null && box.y >= -1 && box.y + box.height <= height + 1;
}

async function answers() {
  const page = await open("index.html", 1400);
  const take = page.locator(".answer").first();
  const before = await take.textContent();
  await page.locator("table.choices").first().locator("button").last().click();
  assert.notEqual(await take.textContent(), before, "another cell, another answer");
  assert.ok(await take.locator("a[href^=methods]").count(), "the method leads to its page");
  assert.match(await take.locator("code").last().textContent(), /^ricochet run --/, "a command repeats the run");
  const level = page.locator(".question select").nth(1);
  await level.selectOption({ index: 0 });
  assert.equal(await page.locator("table.choices").first().locator("button[aria-pressed=true]").count(), 1);
  await page.setViewportSize({ width: 390, height: 420 });
  await page.addStyleTag({ content: "main { padding-bottom: 60rem; }" });  // a short page is scrolled as far as a long one
  const cell = page.locator("table.choices").first().locator("button").last();
  await cell.evaluate((button) => button.scrollIntoView({ block: "start" }));
  assert.ok(!(await isSeen(take.locator(".take"))), "the answer is above the window before the click");
  await cell.click();
  assert.ok(await isSeen(take.locator(".take")), "the answer is seen after a click in the table below it");
  await page.setViewportSize({ width: 1400, height: 900 });
  const rows = page.locator("details.long table tbody tr");
  await page.locator("details.long summary").first().click();
  const all = await rows.filter({ visible: true }).count();
  await page.locator("details.long .menus select").first().selectOption({ index: 1 });
  assert.ok((await rows.filter({ visible: true }).count()) < all, "a menu hides rows");
  await page.close();
}

async function curves() {
  const page = await open(`experiments/${grid}.html`, 1400);
  const chart = page.locator("figure.chart[data-chart=curves]"), marks = chart.locator(".picture .mark");
  assert.equal(await chart.locator("img.still").count(), 0, "the panels stand in place of their images");
  const all = await marks.count();
  assert.ok(all > 10, `${all} marks`);
  await chart.locator(".legend .curves button:not(.group)").first().click();
  assert.ok((await marks.count()) < all, "a curve is switched off");
  const panel = chart.locator(".panel").last();
  await panel.locator("svg").focus();
  await page.keyboard.press("End");
  assert.match(await panel.locator(".said").textContent(), /step length/, "a key says the numbers of a mark");
  await page.close();
}

async function workPrecision() {
  const page = await open(`experiments/${grid}.html`, 1400);
  const chart = page.locator("figure.chart[data-chart=work_precision]");
  assert.equal(await chart.locator("img.still").count(), 0, "the chart stands in place of its image");
  const marks = chart.locator(".picture .mark"), allMethods = chart.getByRole("button", { name: "all methods", exact: true });
  await allMethods.click();
  const all = await marks.count();
  assert.ok(all >= 12, `${all} marks`);
  const first = chart.locator(".legend .curves button:not(.group)").first();
  await first.click();
  const without = await marks.count();
  assert.ok(without < all, "a curve is switched off");
  await first.dblclick();
  assert.ok((await marks.count()) < all && (await chart.locator(".legend [aria-pressed=true]").count()) === 1, "one stays alone");
  await allMethods.click();
  assert.equal(await marks.count(), all);

  const label = () => chart.locator(".picture text.label:not(.beside)").last().textContent();
  await chart.locator("select").nth(1).selectOption("force_evaluations");
  assert.equal(await label(), "force evaluations");
  await chart.locator("select").nth(0).selectOption("relative");
  await chart.locator("select").nth(1).selectOption("time");

  await chart.locator(".picture svg").scrollIntoViewIfNeeded();
  const box = await marks.first().boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  assert.match(await chart.locator(".said").textContent(), /ricochet run /, "the command that repeats the run");
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  const one = await chart.locator(".said").textContent();
  const other = await marks.last().boundingBox();
  await page.mouse.click(other.x + other.width / 2, other.y + other.height / 2);
  const two = await chart.locator(".said").textContent();
  assert.notEqual(two, one, "another run is another text");
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  assert.equal(await chart.locator(".said").textContent(), two, "a click on another run pins that one");
  await chart.locator(".said a").click();
  const row = page.locator("tr:target");
  assert.equal(await row.count(), 1);
  assert.ok(await row.isVisible(), "the link opens the table of its row");

  const cross = chart.locator(".picture .cross").first();
  assert.ok((await cross.count()) === 1, "runs without a solution are crosses");
  await chart.locator(".picture svg").scrollIntoViewIfNeeded();
  const failed = await cross.boundingBox();
  await page.mouse.click(failed.x + failed.width / 2, failed.y + failed.height / 2);
  assert.match(await chart.locator(".said").textContent(), /no solution: \w+/, "a cross says why");

  await chart.locator(".picture svg").focus();
  const before = await chart.locator(".said").textContent();
  await page.keyboard.press("ArrowRight");
  assert.notEqual(await chart.locator(".said").textContent(), before, "the keyboard goes from run to run");
  await page.keyboard.press("Home");
  const start = await chart.locator(".said").textContent();
  await page.keyboard.press("End");
  const end = await chart.locator(".said").textContent();
  assert.notEqual(end, start, "Home and End go to the first and the last run");
  await page.keyboard.press("Enter");
  assert.equal(await chart.locator(".said.pinned").count(), 1, "Enter pins");
  await page.mouse.move(0, 0);
  await chart.locator(".picture .mark").first().hover({ force: true });
  assert.equal(await chart.locator(".said").textContent(), end, "the pointer passes over a pinned run");
  const isFocused = (target) => target.evaluate((e) => e === document.activeElement);
  await page.keyboard.press("Tab");
  assert.ok(await isFocused(chart.locator(".said button.copy")), "one Tab leads to what copies the command");
  await page.keyboard.press("Tab");
  assert.ok(await isFocused(chart.locator(".said a")), "and another to the link");

  await page.setViewportSize({ width: 390, height: 844 });
  await chart.locator(".picture svg").focus();
  await page.keyboard.press("Home");
  assert.ok(await isSeen(chart.locator(".said .title")), "on a phone the text is beside the chart");
  await page.close();
}

/// Changes the data of the chart before it is drawn: a penetration of which the test knows where it is zero, tiny or missing, and
/// measures that no run has. The second method is at zero in each run, with no linear solve.
function plantZeros() {
  document.addEventListener("readystatechange", () => {
    if (document.readyState !== "interactive") return;
    const script = document.querySelector("figure[data-chart=work_precision] script"), data = JSON.parse(script.textContent);
    const label = "deepest penetration [m]", fields = ["error", "relative"];
    data.errors = data.errors.filter((e) => fields.includes(e.field));
    data.errors.push({ field: "penetration", label }, { field: "nobody", label: "of nobody" });
    data.works.push({ field: "idle", label: "counted by nobody" });
    let first = 0;
    data.runs.forEach((run, k) => {
      run.nobody = null;
      run.idle = null;
      run.penetration = 1e-4 * (k + 1);
      if (run.method === 0 && first < 4) run.penetration = [0, 1e-3, 0, null][first++];
      if (run.method === 1) Object.assign(run, { penetration: 0, linear_solves: 0 });
      else run.linear_solves += 1;
    });
    data.runs.at(-1).penetration = 1e-20;
    script.textContent = JSON.stringify(data);
    window.planted = { runs: data.runs.length, idle: data.runs.filter((run) => run.method === 1).length };
  });
}

/// Of the chart's drawing, in its own units: bands, marks and the pieces of lines.
const drawnOf = () => {
  const svg = document.querySelector("figure[data-chart=work_precision] .picture svg");
  const frame = (e) => ({ x: Number(e.getAttribute("x")), y: Number(e.getAttribute("y")),
    width: Number(e.getAttribute("width")), height: Number(e.getAttribute("height")) });
  const points = (d) => [...d.matchAll(/(-?[\d.]+),(-?[\d.]+)/g)].map((m) => [Number(m[1]), Number(m[2])]);
  return {
    name: svg.getAttribute("aria-label"),
    bands: [...svg.querySelectorAll(".zeros")].map(frame),
    labels: [...svg.querySelectorAll(".axis text")].map((text) => text.textContent),
    powers: [...svg.querySelectorAll(".axis[transform^='translate(0,'] text")].map((text) => text.textContent),
    marks: [...svg.querySelectorAll(".mark")].map((mark) => points(mark.getAttribute("transform"))[0]),
    pieces: [...svg.querySelectorAll(".curve")].flatMap((curve) => (curve.getAttribute("d") ?? "").split("M").filter(Boolean).map(points)),
  };
};

async function zeros() {
  const page = await open(`experiments/${grid}.html`, 1400, "light", (p) => p.addInitScript(plantZeros));
  const chart = page.locator("figure.chart[data-chart=work_precision]"), notes = chart.locator(".drawn > .hint");
  const choose = (menu, value) => chart.locator("select").nth(menu).selectOption(value);
  await chart.getByRole("button", { name: "all methods", exact: true }).click();
  const offered = (menu) => chart.locator("select").nth(menu).locator("option").evaluateAll((all) => all.map((o) => o.value));
  const { runs, idle } = await page.evaluate(() => window.planted);
  assert.deepEqual(await offered(0), ["error", "relative", "penetration"], "an error that no run has is not offered");
  assert.ok(!(await offered(1)).includes("idle"), "nor is a work that nobody counts");
  assert.equal((await page.evaluate(drawnOf)).bands.length, 0, "without zeros there is no band");

  await choose(0, "penetration");
  const told = `${idle + 2} runs at zero, 1 below 1e-16, 1 without this number`;
  assert.ok((await notes.textContent()).includes(`deepest penetration [m]: ${told}`), await notes.textContent());
  let drawn = await page.evaluate(drawnOf);
  assert.ok(drawn.name.includes(told), drawn.name);
  assert.equal(drawn.marks.length, runs - 1, "a run at zero is drawn, one without the number is not");
  assert.equal(drawn.bands.length, 1);
  const rim = drawn.bands[0].x + drawn.bands[0].width, isInside = ([x]) => x > drawn.bands[0].x && x < rim;
  assert.equal(drawn.marks.filter(isInside).length, idle + 3, "zeros, and what is rounding, lie in the band");
  assert.equal(new Set(drawn.marks.filter(isInside).map(([x]) => x)).size, 3, "in a column for each of three methods");
  assert.ok(drawn.labels.includes("<1e-16"), "the band is marked");
  for (const piece of drawn.pieces) assert.ok(piece.every(isInside) || !piece.some(isInside), `a line leads into the band: ${piece}`);
  assert.ok(drawn.pieces.some((piece) => piece.every(isInside)), "lines go on inside of the band");

  const zero = chart.locator(".picture .mark").first();
  await chart.locator(".picture svg").scrollIntoViewIfNeeded();
  const box = await zero.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  const said = chart.locator(".said");
  assert.match(await said.textContent(), /deepest penetration \[m\]: 0(?!\.)/, "the pointer finds a run at zero");
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  assert.equal(await chart.locator(".said.pinned").count(), 1, "a click pins it");
  const one = await said.textContent();
  await chart.locator(".picture svg").focus();
  await page.keyboard.press("End");
  await page.keyboard.press("Home");
  assert.equal(await said.textContent(), one, "keys lead to it");

  await choose(1, "linear_solves");
  assert.ok((await notes.textContent()).includes(`linear solves: ${idle} runs at zero`), await notes.textContent());
  drawn = await page.evaluate(drawnOf);
  const [left, below] = drawn.bands;
  const corner = drawn.marks.filter(([x, y]) => x < left.x + left.width && y > below.y);
  assert.equal(corner.length, idle, "runs at zero in both lie in the corner");
  assert.equal(new Set(corner.map(String)).size, idle, "beside each other");
  assert.ok(drawn.marks.every(([x, y]) => x >= left.x && y <= below.y + below.height), "nothing lies outside of the axes");
  for (const piece of drawn.pieces) {
    const isBelow = ([, y]) => y > below.y;
    assert.ok(piece.every(isBelow) || !piece.some(isBelow), "no line leads into the band below");
  }
  await page.setViewportSize({ width: 390, height: 844 });
  await page.waitForTimeout(200);
  for (const what of await page.evaluate(cutOff)) complaints.push(`a chart with zeros at 390: ${what}`);

  await page.setViewportSize({ width: 1400, height: 900 });
  await choose(1, "time");
  await chart.locator(".legend .curves button:not(.group)").nth(1).dblclick();
  drawn = await page.evaluate(drawnOf);
  assert.equal(drawn.marks.length, idle, "a method that is at zero alone is drawn alone");
  assert.ok(drawn.labels.includes("0") && drawn.powers.includes("1e-3"), "and the axis says what zero is left of");
  await page.close();
}

/// More methods than can be told from each other: each family gets ten more, slower at every error, and runs of their own.
function plantMethods() {
  document.addEventListener("readystatechange", () => {
    if (document.readyState !== "interactive") return;
    const script = document.querySelector("figure[data-chart=work_precision] script"), data = JSON.parse(script.textContent);
    const { methods, runs } = data, n = methods.length, m = runs.length;
    for (let k = 1; k <= 10; ++k) {
      for (let i = 0; i < n; ++i) methods.push({ ...methods[i], id: `${methods[i].id}-${k}`, label: `${methods[i].label}, slow ${k}` });
      for (const run of runs.slice(0, m)) runs.push({ ...run, time: 10 * run.time, method: run.method + k * n, row: `planted-${k}-${run.row}` });
    }
    script.textContent = JSON.stringify(data);
    window.planted = { families: new Set(methods.map((one) => one.family)).size, methods: methods.length, id: methods[n].id,
      row: runs.find((run) => run.method === n).row };
  });
}

async function fewCurvesFirst() {
  const page = await open(`experiments/${grid}.html`, 1400, "light", (p) => p.addInitScript(plantMethods));
  const chart = page.locator("figure.chart[data-chart=work_precision]"), count = chart.locator(".legend .count");
  const { families, methods, id, row } = await page.evaluate(() => window.planted);
  const shown = () => chart.locator(".legend .curves [aria-pressed=true]").allTextContents();
  assert.equal(await count.textContent(), `${families} of ${methods} methods shown`);
  for (const name of await shown()) assert.doesNotMatch(name, /slow/, "the best of a family is its fastest");
  await page.evaluate((hash) => { location.hash = hash; }, row);
  await page.waitForFunction((n) => document.querySelector("[data-chart=work_precision] .legend .count").textContent.startsWith(`${n} `), families + 1);
  assert.equal((await shown()).filter((name) => /slow 1$/.test(name)).length, 1, "a link to a row shows its curve");
  await chart.getByRole("button", { name: "best of each family" }).click();
  assert.equal((await shown()).length, families);
  await page.evaluate((hash) => { location.hash = hash; }, `curve=${id}`);
  await page.waitForFunction((n) => document.querySelector("[data-chart=work_precision] .legend .count").textContent.startsWith(`${n} `), families + 1);
  await chart.getByRole("button", { name: "all methods", exact: true }).click();
  assert.equal((await shown()).length, methods);
  await page.close();

  const phone = await open(`experiments/${grid}.html`, 390, "light", (p) => p.addInitScript(plantMethods));
  const phoneChart = phone.locator("figure.chart[data-chart=work_precision]"), names = phoneChart.locator(".legend .curves button:not(.group)");
  assert.equal(await names.filter({ visible: true }).count(), families, "on a phone the legend has what is shown");
  await phoneChart.getByRole("button", { name: "names of all methods" }).click();
  assert.equal(await names.filter({ visible: true }).count(), methods, "and all names when they are asked for");
  for (const what of await phone.evaluate(cutOff)) complaints.push(`a chart with many methods at 390: ${what}`);
  await phone.close();
}

async function copies() {
  // A page from a disk has no clipboard in some browsers.
  const withoutClipboard = (p) => p.addInitScript(() => Object.defineProperty(navigator, "clipboard", { value: undefined }));
  const page = await open("index.html", 1400, "light", withoutClipboard);
  const line = page.locator("main .command-line").first(), button = line.locator("button.copy");
  const command = await line.locator("code").textContent();
  assert.match(command, /^ricochet run(-experiment)? \S+/);
  await button.focus();
  await page.keyboard.press("Enter");
  const told = page.locator("[role=status]");
  await page.waitForFunction(() => document.querySelector("[role=status]").textContent !== "");
  assert.equal(await told.textContent(), `Copied: ${command}`, "what a click did is said");
  assert.ok(await button.evaluate((e) => e === document.activeElement), "the focus stays");
  await page.locator(".search input").focus();
  await page.keyboard.press("Control+V");
  assert.equal(await page.locator(".search input").inputValue(), command, "the command is in the clipboard");
  await page.close();

  const refusing = (p) => p.addInitScript(() => {
    Object.defineProperty(navigator, "clipboard", { value: { writeText: () => Promise.reject(new Error("no")) } });
    document.execCommand = () => false;
  });
  const other = await open("index.html", 1400, "light", refusing);
  await other.locator("main .command-line button.copy").first().click();
  await other.waitForFunction(() => document.querySelector("[role=status]").textContent !== "");
  assert.equal(await other.evaluate(() => getSelection().toString().trim()), command, "where nothing copies, the command is selected");
  await other.close();

  for (const name of [`experiments/${grid}.html`, `experiments/${fastest}.html`, `experiments/${hard}`, "methods/moreau_jean.html", "cite.html"]) {
    const one = await open(name, 1400);
    await one.evaluate(() => { for (const details of document.querySelectorAll("main details")) details.open = true; });
    await one.waitForFunction(() => [...document.querySelectorAll(".scroll > table:not(.verdicts, .choices)")].every((t) => t.classList.contains("sized")));
    const bare = await one.evaluate(() => [...document.querySelectorAll("main code, main td, main pre")]
      .filter((e) => /^(ricochet (run|export|show)|@\w+\{)/.test(e.textContent) && e.matches(":not(:has(code))"))
      .filter((e) => !e.parentElement.querySelector("button.copy")).map((e) => e.textContent));
    assert.deepEqual(bare, [], `${name}: commands without a button`);
    await one.close();
  }
}

async function tables() {
  const name = "methods/fesd.html";
  const page = await open(name, 768);
  const table = page.locator("figure.table table").first(), box = page.locator(".edge").first();
  assert.ok(await table.evaluate((t) => t.parentElement.scrollWidth > t.parentElement.clientWidth), "the table of examples is wider than the page");
  const button = page.locator(".table-tools button").first();
  assert.match(await button.textContent(), /^\d+ more columns? →$/);
  const left = (locator) => locator.evaluate((e) => e.getBoundingClientRect().left);
  const first = table.locator("tbody td").first(), second = table.locator("tbody td").nth(1);
  const stays = await left(first), moves = await left(second);
  await button.click();
  await page.waitForFunction(() => document.querySelector(".edge").classList.contains("more-left"));
  assert.ok(Math.abs((await left(first)) - stays) < 1, "the first column stays");
  assert.ok((await left(second)) < moves - 50, "the others move");
  await box.locator(".scroll").evaluate((e) => { e.scrollLeft = e.scrollWidth; });
  await page.waitForFunction(() => !document.querySelector(".edge").classList.contains("more-right"));
  assert.match(await button.textContent(), /back to the first/);
  await page.close();

  // A reason of many words beside many numbers: its end is left out until it is asked for, and no row is high and empty.
  const many = await open(name, 768, "light", (p) => p.addInitScript(() => {
    document.addEventListener("readystatechange", () => {
      if (document.readyState !== "interactive") return;
      const table = document.querySelector("figure.table table");
      const add = (row, tag, text, name) => { row.append(Object.assign(document.createElement(tag), { textContent: text, className: name })); };
      const command = "ricochet run --problem two_balls_spring --method fesd:radau-iia:3 --steps 100";
      for (let k = 0; k < 8; ++k) add(table.tHead.rows[0], "th", `number ${k}`, "");
      add(table.tHead.rows[0], "th", "reason", "text");
      add(table.tHead.rows[0], "th", "repeat with", "text");
      for (const row of table.tBodies[0].rows) {
        for (let k = 0; k < 8; ++k) add(row, "td", "1.2345e+00", "");
        add(row, "td", "no solution was found in this step. ".repeat(6), "text long");
        add(row, "td", command, "text");
      }
    });
  }));
  const row = many.locator("figure.table table").first().locator("tbody tr").first(), height = () => row.evaluate((e) => e.offsetHeight);
  assert.ok((await height()) < 40, `a row is ${await height()} pixels high`);
  const copy = await row.locator("button.copy").boundingBox();
  assert.ok(copy && copy.x + copy.width <= 768, "the button of the command beyond the edge is seen");
  const whole = many.locator(".table-tools").first().getByRole("button", { name: "Whole texts" });
  await whole.click();
  assert.ok((await height()) > 60, "whole texts when they are asked for");
  await whole.click();
  await row.locator("td.long").evaluate((cell) => cell.click());
  assert.ok((await height()) > 60, "a tap opens a row");
  assert.equal(await many.locator("tr.whole").count(), 1);
  await many.close();
}

async function motion() {
  const names = ["problems/two_balls_spring.html", `experiments/${grid}.html`];
  for (const name of names) {
    for (const reduced of ["reduce", "no-preference"]) {
      const page = await open(name, 1400, "light", () => {}, reduced);
      if (await page.locator("details:has(img.scene)").count()) await page.locator("details:has(img.scene) > summary").click();
      const button = page.locator("button.motion").first();
      if (!(await button.count()) && name !== names[0]) {  // the experiment has no scene
        await page.close();
        continue;
      }
      const figure = page.locator("figure:has(button.motion)").first(), scene = figure.locator(".moves:not([hidden])");
      await figure.scrollIntoViewIfNeeded();
      await page.evaluate(() => document.fonts.ready);
      // A scene holds its last picture for a while, and a page may move by parts of a pixel when it has just come.
      const still = async () => {
        const seen = new Set();
        for (let k = 0; k < 8; ++k) {
          await page.waitForTimeout(200);
          seen.add((await scene.screenshot()).toString("base64"));
        }
        return seen.size <= 2;
      };
      const isCalm = reduced === "reduce", says = isCalm ? ["Play", "Pause"] : ["Pause", "Play"];
      assert.equal(await button.textContent(), says[0], `${name}, ${reduced}`);
      assert.equal(await still(), isCalm, `${name} starts ${isCalm ? "still" : "in motion"}`);
      await button.click();
      assert.equal(await button.textContent(), says[1]);
      assert.equal(await still(), !isCalm, `${name}: ${says[0]} does what it says`);
      assert.ok((await scene.boundingBox()).height <= 321, "a scene leaves room on the screen");
      await page.close();
    }
  }
}

async function search() {
  const page = await open("index.html", 1400);
  const cards = page.locator("ul.cards li").filter({ visible: true }), all = await cards.count();
  await page.keyboard.press("/");
  await page.keyboard.type("moreau jean");
  const found = await cards.count();
  assert.ok(found > 0 && found < all, `${found} of ${all} are found`);
  assert.equal(await page.locator(".search .count").textContent(), `${found} of ${all}`);
  assert.equal(await page.locator("h2#Problems").isVisible(), false, "a list without hits is hidden with its heading");
  await page.locator(".search input").fill("two_balls_spring");
  await page.keyboard.press("Enter");
  await page.waitForURL(/problems\/two_balls_spring\.html$/);
  await page.close();
}

async function stillsFit() {
  const page = await open(`experiments/${grid}.html`, 390);
  const still = page.locator("figure.fits > img.still").first();
  if (await still.count()) {  // there is none without gnuplot
    const button = page.locator("button.enlarge").first();
    await still.scrollIntoViewIfNeeded();
    await page.waitForFunction((image) => image.complete && image.naturalWidth, await still.elementHandle());
    assert.ok((await still.boundingBox()).width <= 390, "a still figure fits a phone");
    await button.click();
    assert.ok((await still.boundingBox()).width > 390, "the button enlarges it");
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "inside of its own box");
    await button.click();
    assert.ok((await still.boundingBox()).width <= 390);
    await still.scrollIntoViewIfNeeded();
    const box = await still.boundingBox(), at = { x: box.x + 0.6 * box.width, y: box.y + 0.5 * box.height };
    await page.mouse.click(at.x, at.y);
    const large = await still.boundingBox();
    assert.ok(Math.abs(large.x + 0.6 * large.width - at.x) < 4 && Math.abs(large.y + 0.5 * large.height - at.y) < 4,
      "what was tapped stays under the finger");
    await page.setViewportSize({ width: 768, height: 900 });
    assert.ok(!(await button.isVisible()), "a wide window needs no button");
  }
  await page.close();
}

async function namesLeadToPages() {
  const page = await open(`experiments/${grid}.html`, 1400);
  await page.locator('td a[href$="methods/moreau_jean.html"]').first().click();
  assert.match(page.url(), /methods\/moreau_jean\.html$/);
  await page.close();
}

async function profiles() {
  const page = await open(`experiments/${fastest}.html`, 768);
  const chart = page.locator("figure.chart[data-chart=profile]").first();
  const curves = chart.locator(".picture path.curve"), all = await curves.count();
  assert.ok(all >= 2, `${all} profiles`);
  const looks = await chart.locator(".legend .curves button").evaluateAll((buttons) =>
    buttons.map((b) => b.querySelector(".curve").style.strokeDasharray + b.querySelector(".mark").getAttribute("d")));
  assert.equal(new Set(looks).size, looks.length, "no two curves have the same dashes and marks");
  assert.equal(await chart.locator(".picture text.end").count(), all, "names stand at the ends of the curves");
  await chart.locator(".legend .curves button").first().click();
  assert.equal(await curves.count(), all - 1);
  await chart.locator(".picture svg").focus();
  await page.keyboard.press("End");
  assert.match(await chart.locator(".said").textContent(), /problems .* times the time of the best/, "the keyboard goes along curves");
  const ring = await chart.locator(".ring").boundingBox();
  await page.mouse.move(ring.x + ring.width / 2, ring.y + ring.height / 2 + 1);
  assert.equal(await chart.locator("path.curve.near").count(), 1, "the curve beside the pointer stands out");
  await page.close();

  const twins = await open(`experiments/${fastest}.html`, 768, "light", (p) => p.addInitScript(() => {
    document.addEventListener("readystatechange", () => {
      if (document.readyState !== "interactive") return;
      const script = document.querySelector("figure[data-chart=profile] script"), data = JSON.parse(script.textContent);
      const look = { colour: 5, symbol: 3, dash: 1 };
      const { curves } = data.panels[0], [start, end] = [curves[0].points[0], curves[0].points.at(-1)];
      data.panels[0].curves = [curves[0], { ...curves[0], label: "twin" }, { ...curves[1], ...look },
        ...Array.from({ length: 20 }, (_, k) => ({ ...look, label: `slow ${k}`, points: [start, [end[0], 0]] }))];
      script.textContent = JSON.stringify(data);
    });
  }));
  const figure = twins.locator("figure.chart[data-chart=profile]").first();
  const [one, two, three] = await figure.locator(".picture path.curve").evaluateAll((paths) => paths
    .filter((path) => path.getAttribute("d").length > 60).map((path) => ({ d: path.getAttribute("d"), colour: path.classList[1],
      dash: path.style.strokeDasharray, offset: path.style.strokeDashoffset })).sort((a, b) => a.colour < b.colour ? -1 : 1));
  assert.equal(one.d, two.d);
  assert.ok(one.dash === two.dash && one.dash !== "" && one.offset !== two.offset, "curves that are the same take turns");
  assert.ok(three.colour === "c5" && three.dash !== "", "a look that the data state is taken");
  assert.equal(await figure.locator(".legend .count").textContent(), "8 of 23 solvers shown");
  await twins.close();
}

/// Commits have names and no logarithm, an order may be negative, and a curve ends where a commit has none.
async function history() {
  if (!isProgram) return;
  const page = await open("history.html", 1400);
  const [ratios, orders] = await page.locator("figure[data-chart=curves] .panel svg").all();
  assert.deepEqual((await orders.locator(".axis text").allTextContents()).filter((text) => text.startsWith("abc")), HISTORY.map((h) => h.commit));
  const values = (await ratios.locator(".axis text").allTextContents()).filter((text) => /^1(\.|$)/.test(text));
  assert.ok(values.length >= 3 && new Set(values).size === values.length, `an axis of less than a decade has numbers: ${values}`);
  assert.equal(await ratios.locator("path.mark").count(), 3);
  assert.match(await ratios.locator("path.curve").getAttribute("d"), /^M[^ML]*L[^ML]*L[^ML]*$/);
  assert.equal(await orders.locator("path.mark").count(), 2);
  assert.match(await orders.locator("path.curve").getAttribute("d"), /^M[^ML]*M[^ML]*$/, "no line over a commit without an order");
  await orders.focus();
  await page.keyboard.press("End");
  const link = page.locator("figure[data-chart=curves] .said a");
  assert.equal(await link.textContent(), "abc0002");
  assert.equal(await page.locator(await link.getAttribute("href")).count(), 1, "what a commit changed is one click away");
  await page.close();
}

async function verdicts() {
  const page = await open(`experiments/${hard}`, 1400);
  assert.equal(await page.locator("h2#matrix + figure[data-chart=verdicts]").count(), 1, "a link to the heading leads to the matrix");
  const cells = page.locator("button.verdict"), all = await cells.count();
  assert.ok(all >= 4, `${all} verdicts`);
  await cells.first().click();
  assert.match(await page.locator("figure[data-chart=verdicts] .said").textContent(), /ricochet run/);
  await page.setViewportSize({ width: 1400, height: 300 });
  const last = cells.last();
  await last.evaluate((cell) => cell.scrollIntoView({ block: "end" }));
  await last.click();
  assert.ok(await isSeen(page.locator("figure[data-chart=verdicts] .said .title")), "what decided a cell is seen where the cell is clicked");
  assert.ok(await isSeen(last), "and so is the cell");
  assert.equal(await last.getAttribute("aria-pressed"), "true");
  assert.equal(await page.locator("button.verdict[aria-pressed=true]").count(), 1, "one cell is chosen");
  assert.ok((await last.boundingBox()).height >= 24, "a cell is high enough for a finger");
  await page.setViewportSize({ width: 1400, height: 900 });
  await page.locator("input[type=search]").fill("fesd:gauss:3");
  const found = await cells.count();
  assert.ok(found > 0 && found < all, "methods are found by name");
  await page.locator("input[type=search]").fill("no such method");
  assert.equal(await cells.count(), 0);
  await page.close();
  await filteredVerdicts();
}

/// A verdict that one cell has.
function plantVerdict() {
  document.addEventListener("readystatechange", () => {
    if (document.readyState !== "interactive") return;
    const script = document.querySelector("figure[data-chart=verdicts] script"), data = JSON.parse(script.textContent);
    data.meanings.planted = "by the test";
    data.methods[0].cells.find((cell) => cell !== null).verdict = "planted";
    script.textContent = JSON.stringify(data);
  });
}

async function filteredVerdicts() {
  const page = await open(`experiments/${hard}`, 1400, "light", (p) => p.addInitScript(plantVerdict));
  const chart = page.locator("figure[data-chart=verdicts]"), cells = page.locator("button.verdict");
  const columns = () => chart.locator("th.turned").count(), before = await columns();
  const links = await chart.locator("th.turned a").evaluateAll((list) => list.map((link) => link.href));
  assert.ok(links.length > 0, "cases lead to their problems");
  for (const link of links) assert.ok(existsSync(new URL(link)), link);
  await chart.locator("select").nth(1).selectOption("planted");
  assert.equal(await columns(), 1, "a case without such a cell has no column");
  assert.equal(await cells.count(), 1);
  assert.match(await chart.locator(".count").textContent(), new RegExp(`; ${before - 1} cases? without such a cell (is|are) hidden$`));
  const method = await chart.locator("tbody th").textContent(), hardCase = await chart.locator("th.turned").textContent();
  await cells.first().click();
  await chart.locator(".said a", { hasText: "its row" }).click();
  const row = page.locator("tr:target");
  assert.equal(await row.count(), 1);
  assert.ok(await row.isVisible(), "a cell leads to its row");
  const [first, second] = await row.locator("td").allTextContents();
  assert.deepEqual([first, second], [hardCase, method], "which is of the same case and method");
  await page.close();
}

async function equations() {
  for (const name of ["methods/moreau_jean.html", "problems/two_balls_spring.html"]) {
    const page = await open(name, 1400);
    assert.ok((await page.locator(".katex-display").count()) >= 4, `${name}: equations are typeset`);
    assert.equal(await page.locator(".katex-error").count(), 0);
    await page.close();
  }
}

async function figuresLinkToTheirNumbers() {
  for (const name of readdirSync(join(site, "experiments")).filter((file) => file.endsWith(".html"))) {
    const figures = readFileSync(join(site, "experiments", name), "utf8").split("<figure").slice(1);
    for (const figure of figures.filter((text) => !text.startsWith(' class="table"')))  // whose links stand below
      assert.ok(/href="[^"]+\.csv"/.test(figure.split("</figure>")[0]), `${name}: a figure without its CSV: ${figure.slice(0, 200)}`);
  }
}

async function printsWhatIsOpen() {
  const page = await open(`experiments/${grid}.html`, 1400);
  await page.emulateMedia({ media: "print" });
  assert.ok(!(await page.locator("nav").isVisible()), "contents are not printed");
  assert.ok(await page.locator(".picture svg").first().isVisible());
  const style = (of, property) => of.evaluate((e, name) => getComputedStyle(e)[name], property);
  assert.equal(await style(page.locator("figure.chart").first(), "breakInside"), "auto", "a long chart goes over pages");
  const fire = (target, name) => target.evaluate((event) => { dispatchEvent(new Event(event)); }, name);
  const closed = page.locator("main details:not([open])");
  const before = await closed.count();
  assert.ok(before > 0, "something is closed on the screen");
  await fire(page, "beforeprint");
  assert.equal(await closed.count(), before, "what is closed on the screen is closed on paper");
  await fire(page, "afterprint");
  const notes = page.locator(".paper"), long = page.locator("details.long:has(table):not([open])");
  const told = await notes.filter({ visible: true }).allTextContents();
  assert.ok(told.length > 0 && told.length === (await long.count()), "and a line says what is not printed");
  for (const text of told) assert.match(text, /^\d+ rows: see \w+\.csv/);
  await long.first().evaluate((e) => { e.open = true; });
  assert.equal(await notes.filter({ visible: true }).count(), told.length - 1, "but not of what is open");
  await page.emulateMedia({ media: "screen" });
  assert.equal(await notes.filter({ visible: true }).count(), 0, "nor on the screen");
  await page.close();

  const paper = await open(`experiments/${hard}`, 718);  // A4 with Chromium's margins
  await paper.emulateMedia({ media: "print" });
  await fire(paper, "beforeprint");
  for (const table of await paper.locator("table.verdicts").all())
    assert.ok((await table.boundingBox()).width <= 718, "a table of verdicts fits on paper");
  assert.equal(await style(paper.locator("button.verdict").first(), "printColorAdjust"), "exact", "verdicts keep their colours");
  await fire(paper, "afterprint");
  assert.equal(await paper.locator("table.verdicts").count(), 1);
  await paper.close();
}

const bytes = ["index.html", "assets/site.css", "assets/site.js"].reduce((sum, name) => sum + statSync(join(site, name)).size, 0);
assert.ok(bytes < FIRST_VIEW, `the first view has ${bytes} bytes`);
const TESTS = [answers, curves, workPrecision, fewCurvesFirst, zeros, copies, tables, motion, search, stillsFit, namesLeadToPages, profiles, verdicts,
  equations, history, figuresLinkToTheirNumbers, printsWhatIsOpen, async function looks() { for (const name of PAGES) await looksRight(name); }];
const only = process.argv.includes("--only") ? process.argv.at(-1) : "";
try {
  for (const test of TESTS.filter(({ name }) => !only || name === only)) {
    await test().catch((error) => complaints.push(`${test.name}: ${error.message}`));
  }
} finally {
  await browser.close();
  if (folder) rmSync(folder, { recursive: true });
}
for (const complaint of complaints) console.error(complaint);
console.log(complaints.length ? `${complaints.length} complaints` : `${PAGES.length} pages, ${bytes} bytes for the first view: all right`);
process.exit(complaints.length ? 1 : 0);
