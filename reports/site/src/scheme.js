// The plain text of numbered equations, as the files of the methods write them, to TeX. It is nearly that: names with
// _ and ^, Greek letters by name, words between. Every word is looked at once, with what stands before and behind it.

const GREEK = new Set(["alpha", "beta", "gamma", "delta", "Delta", "zeta", "theta", "kappa", "lambda", "Lambda", "mu", "nu",
  "xi", "pi", "rho", "sigma", "tau", "phi", "chi", "omega", "Omega"]);
const FUNCTIONS = new Set(["max", "min", "arg", "sin", "cos", "tan", "exp", "log", "det", "diag", "sym", "sign", "atan2", "dim"]);
const BIG = new Map([["sum", "\\sum"], ["prod", "\\prod"], ["int", "\\int"], ["grad", "\\nabla "], ["inf", "\\infty "]]);
const SHORT_WORDS = new Set(["is", "in", "of", "at", "if", "to", "or", "by", "on", "no", "as", "an", "so", "it"]);
const SIGNS = [["_|_", "\\perp "], ["<->", "\\leftrightarrow "], ["<=", "\\le "], [">=", "\\ge "], ["!=", "\\ne "],
  ["<-", "\\leftarrow "], ["->", "\\to "], ["-+", "\\mp "], ["+-", "\\pm "], ["||", "\\Vert "], ["...", "\\dots "]];
const UNICODE = new Map([["λ", "lambda"], ["Λ", "Lambda"], ["θ", "theta"], ["μ", "mu"], ["µ", "mu"]]);

const word = (text) => `\\;\\text{${text}}\\;`;

function nameToTex(name, before, behind) {
  if (name === "eps") return "\\varepsilon ";
  if (GREEK.has(name)) return `\\${name} `;
  if (BIG.has(name)) return BIG.get(name);
  if (FUNCTIONS.has(name) && /^\s*[(_]/.test(behind)) return `\\operatorname{${name}}`;
  const hat = /^([A-Z])hat$/.exec(name);
  if (hat) return `\\hat{${hat[1]}}`;
  if (/[_^]$/.test(before)) return name.length > 2 ? `{\\mathrm{${name}}}` : `{${name}}`;
  if (name.length > 2 || SHORT_WORDS.has(name)) return word(name);
  return name;
}

function toTex(text) {
  let rest = [...text].map((c) => UNICODE.get(c) ?? c).join("");
  let tex = "";
  const take = (length) => { rest = rest.slice(length); };
  while (rest) {
    let match;
    const sign = SIGNS.find(([plain]) => rest.startsWith(plain));
    if (sign) {
      tex += sign[1];
      take(sign[0].length);
    } else if ((match = /^sqrt\(((?:[^()]|\([^()]*\))*)\)/.exec(rest))) {
      tex += `\\sqrt{${toTex(match[1])}}`;
      take(match[0].length);
    } else if ((match = /^[A-Za-z]{3,}'s\b/.exec(rest))) {
      tex += word(match[0]);
      take(match[0].length);
    } else if ((match = /^([a-z])\^(?=_)/.exec(rest))) {  // v^_i: a hat
      tex += `\\hat{${match[1]}}`;
      take(match[0].length);
    } else if ((match = /^([A-Za-z])~/.exec(rest))) {
      tex += `\\tilde{${match[1]}}`;
      take(match[0].length);
    } else if ((match = /^([A-Za-z])\*(?=[\s),;]|$)/.exec(rest))) {
      tex += `${match[1]}^{*}`;
      take(match[0].length);
    } else if ((match = /^\^(-?\w{2,}|-\w|\([^()]*\))(?![A-Za-z])/.exec(rest))) {  // ^-1, ^(1/j)
      tex += `^{${toTex(match[1].replace(/^\((.*)\)$/, "$1"))}}`;
      take(match[0].length);
    } else if ((match = /^\^([A-Za-z0-9])'/.exec(rest))) {  // J^i': two superscripts are one
      tex += `^{${match[1]}\\prime}`;
      take(match[0].length);
    } else if ((match = /^_([A-Za-z0-9]+(?:,[A-Za-z0-9](?![\w(~]))+)/.exec(rest))) {  // lambda_t,j
      tex += `_{${match[1]}}`;
      take(match[0].length);
    } else if ((match = /^[A-Za-z]+\d?/.exec(rest))) {
      const letters = /^[A-Za-z]+$/.test(match[0]) || FUNCTIONS.has(match[0]) ? match[0] : match[0].slice(0, -1);
      tex += nameToTex(letters, tex, rest.slice(letters.length));
      take(letters.length);
    } else if ((match = /^\s{3,}/.exec(rest))) {
      tex += "\\quad ";
      take(match[0].length);
    } else {
      tex += { "*": "\\cdot ", "%": "\\%", "&": "\\&", "#": "\\#" }[rest[0]] ?? rest[0];
      take(1);
    }
  }
  return tex.replace(/\\;\s*\\;/g, "\\ ").replace(/\s+([_^])/g, "$1");
}

/// Lines that end in a number in brackets, behind space, are equations; the others are paragraphs.
export function schemeToBlocks(text) {
  const blocks = [];
  let paragraph = [];
  const end = () => {
    if (paragraph.length) blocks.push({ kind: "text", text: paragraph.join(" ") });
    paragraph = [];
  };
  for (const line of text.split("\n")) {
    const equation = /^\s{2,}(\S.*?)\s+\((\d+[a-z']?)\)$/.exec(line);
    if (equation) {
      end();
      blocks.push({ kind: "equation", text: equation[1], number: equation[2], tex: toTex(equation[1]) });
    } else if (line.trim() === "") {
      end();
    } else {
      paragraph.push(line.trim());
    }
  }
  end();
  return blocks;
}
