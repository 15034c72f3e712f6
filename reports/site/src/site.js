// What a page of the site does beyond being read: contents, menus over tables, what copies a command, charts. Everything is there without it,
// as text, tables and images.
import "./site.css";
import { addAnswer } from "./choice.js";
import { openContents } from "./contents.js";
import { addCopyButtons } from "./copy.js";
import { enlargeStills } from "./enlarge.js";
import { drawCurves } from "./curves.js";
import { addFilters } from "./filter.js";
import { linkNames } from "./links.js";
import { holdMotions } from "./motion.js";
import { notePaper } from "./print.js";
import { addSearch } from "./search.js";
import { markEdges } from "./tables.js";
import { openTarget } from "./target.js";
import { drawProfile } from "./profile.js";
import { drawVerdicts } from "./verdicts.js";
import { drawWorkPrecision } from "./work_precision.js";

const CHARTS = { curves: drawCurves, profile: drawProfile, verdicts: drawVerdicts, work_precision: drawWorkPrecision };

openContents();
linkNames();
for (const block of document.querySelectorAll(".choice")) addAnswer(block);
for (const table of document.querySelectorAll("table[data-filters]")) addFilters(table);
for (const figure of document.querySelectorAll("figure.chart")) {
  const draw = CHARTS[figure.dataset.chart];
  if (!draw) continue;
  draw(figure.querySelector(".drawing"), JSON.parse(figure.querySelector("script").textContent));
  for (const still of figure.querySelectorAll("img.still")) still.remove();
}
holdMotions();
enlargeStills();
addCopyButtons();
addSearch();
notePaper();
markEdges();
openTarget();
