// Bundles src/ into dist/, which the program embeds: `npm run build`. With --check nothing is written: exit code 1 where
// a file of dist/ is not what src/ and the pinned packages make.
import { build } from "esbuild";
import { readFileSync, writeFileSync } from "node:fs";

// The delimiter of the raw strings that dist/ becomes in C++, and what CMake would replace.
const FORBIDDEN = [/\)~"/, /@[A-Za-z_.]+@/];

const result = await build({
  absWorkingDir: import.meta.dirname,
  entryPoints: { site: "src/site.js", equations: "src/equations.js" },
  bundle: true,
  minify: true,
  charset: "utf8",
  format: "iife",
  target: ["es2022"],
  legalComments: "inline",
  outdir: "dist",
  write: false,
  loader: { ".woff2": "dataurl", ".woff": "empty", ".ttf": "empty" },
});

let differs = false;
for (const { path, text: bundle } of result.outputFiles) {
  // A string of KaTeX holds a mark of writing direction, of which compilers warn.
  const text = bundle.replaceAll("\u202A", "\\u202A");
  const name = path.split("/").pop();
  for (const pattern of FORBIDDEN) if (pattern.test(text)) throw new Error(`dist/${name}: ${pattern} cannot be embedded`);
  const file = `${import.meta.dirname}/dist/${name}`;
  console.log(`dist/${name}: ${(text.length / 1024).toFixed(0)} KiB`);
  if (!process.argv.includes("--check")) writeFileSync(file, text);
  else if (readFileSync(file, "utf8") !== text) {
    console.error(`dist/${name} is not what src/ makes: run npm ci && npm run build`);
    differs = true;
  }
}
process.exit(differs ? 1 : 0);
