// Plants faults into the scripts and the style of a site, one at a time, and runs the test that should notice; without a fault
// it has to pass.   node planted_faults.mjs SITE [TEST]   SITE, of the program that is built, is copied.
// Exit code 1 where a fault is not noticed, or what it would change is not there.
import { execFileSync, spawnSync } from "node:child_process";
import { cpSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";

const SOURCE = resolve(import.meta.dirname, "../../reports/site");

// Test, file of src/, what is there, what is planted.
const FAULTS = [
  ["tables", "site.css", ".sized.crowded :is(td, th):first-child { position: sticky;", ".sized.crowded :is(td, th):first-child { position: static;"],
  ["tables", "site.css", ".sized.crowded :is(td, th).command { position: sticky;", ".sized.crowded :is(td, th).command { position: static;"],
  ["tables", "tables.js", 'box.classList.toggle("more-right", isWide &&', 'box.classList.toggle("more-right", false &&'],
  ["tables", "site.css", "text-overflow: ellipsis; white-space: nowrap; cursor: pointer;", "cursor: pointer;"],
  ["tables", "tables.js", "if (row.classList.contains(\"whole\") || isClipped(cell))", "if (false)"],
  ["copies", "dom.js", 'document.execCommand("copy")', "true"],
  ["copies", "dom.js", "getSelection().selectAllChildren(place);", ""],
  ["copies", "dom.js", "told.textContent = text;", ""],
  ["copies", "tables.js", "if (isCommand(texts[r])) cell.replaceChildren(commandLine(texts[r]));", ""],
  ["copies", "copy.js", 'else if (text.startsWith("@"))', "else if (false)"],
  ["motion", "motion.js", "set(!CALM.matches);", "set(true);"],
  ["motion", "motion.js", "for (const each of [svg, ...inner]) each.pauseAnimations();", "svg.pauseAnimations();"],
  ["motion", "site.css", "max-height: 20rem;", ""],
  ["profiles", "profile.js", 'curve.style("stroke-dasharray", turn.array).style("stroke-dashoffset", turn.offset)', "curve"],
  ["profiles", "profile.js", "...lookOf(solver)", "...lookOf(solver), symbol: 0, dash: \"\""],
  ["profiles", "profile.js", "const isNamed = width >= ROOM &&", "const isNamed = false &&"],
  ["profiles", "profile.js", "if (solvers.length <= MOST) return all;", "return all;"],
  ["verdicts", "verdicts.js", "ofGroup.filter((k) => rows.some((row) => fits(row.cells[k])))", "ofGroup"],
  ["verdicts", "verdicts.js", "element(\"a\", { href: `#${cell.row}` }, \"its row in the table\")", "null"],
  ["verdicts", "verdicts.js", "return pages.get(name);", "return undefined;"],
  ["fewCurvesFirst", "work_precision.js", ".sort((a, b) => a.time - b.time)", ".sort((a, b) => b.time - a.time)"],
  ["fewCurvesFirst", "work_precision.js", "if (methods.length <= FEW)", "if (true)"],
  ["fewCurvesFirst", "work_precision.js", "key.add(k);", ""],
  ["fewCurvesFirst", "legend.js", 'list.classList.toggle("brief", NARROW.matches);', ""],
  ["printsWhatIsOpen", "site.css", "main details:not([open]) + .paper { display: block;", "main details:not([open]) + .paper { display: none;"],
  ["printsWhatIsOpen", "print.js", "see ${files.map", "${files.map"],
  ["search", "search.js", 'event.key !== "/" ||', 'event.key !== "?" ||'],
  ["search", "search.js", "heading(list).hidden = isEmpty;", "heading(list).hidden = false;"],
];

const [site, only] = [resolve(process.argv[2]), process.argv[3]];
const folder = mkdtempSync(join(tmpdir(), "ricochet-faults-"));
let missed = 0;
const runs = FAULTS.filter(([test]) => !only || test === only);
try {
  cpSync(site, join(folder, "site"), { recursive: true });
  cpSync(join(SOURCE, "build.mjs"), join(folder, "build.mjs"));
  symlinkSync(join(SOURCE, "node_modules"), join(folder, "node_modules"));
  execFileSync("mkdir", [join(folder, "dist")]);
  const passed = new Map();
  for (const [test, file, from, to] of [...new Set(runs.map(([name]) => name))].flatMap((name) =>
    [[name, "site.js", "", ""], ...runs.filter(([other]) => other === name)])) {
    cpSync(join(SOURCE, "src"), join(folder, "src"), { recursive: true });
    const text = readFileSync(join(folder, "src", file), "utf8");
    if (!text.includes(from)) {
      console.error(`${file} has no longer: ${from}`);
      missed++;
      continue;
    }
    writeFileSync(join(folder, "src", file), text.replace(from, () => to));
    execFileSync("node", [join(folder, "build.mjs")], { stdio: "ignore" });
    for (const name of ["site.js", "site.css"]) cpSync(join(folder, "dist", name), join(folder, "site/assets", name));
    const { status, stderr } = spawnSync("node", [join(import.meta.dirname, "site_test.mjs"), "--site", join(folder, "site"), "--only", test],
      { encoding: "utf8" });
    if (!from) {
      passed.set(test, status === 0);
      if (status !== 0) console.error(`${test} fails without a fault: ${stderr.split("\n")[0]}`);
      continue;
    }
    const isNoticed = status === 1 && passed.get(test);
    if (!isNoticed) missed++;
    console.log(`${isNoticed ? "noticed" : "MISSED"}: ${test}, ${file}: ${from}${isNoticed ? `\n    ${stderr.split("\n")[0]}` : ""}`);
  }
} finally {
  rmSync(folder, { recursive: true });
}
console.log(`${runs.length - missed} of ${runs.length} faults are noticed`);
process.exit(missed ? 1 : 0);
