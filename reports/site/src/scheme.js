// The plain text of numbered equations, as the files of the methods write them, to TeX: they are nearly that.

const GREEK = /\b(theta|gamma|lambda|Lambda|mu|alpha|beta|eps|tau|rho|omega|sigma|phi|Delta|delta|xi|nu|kappa|chi|pi)(?=[^a-z]|$)/g;
const SYMBOLS = [
  [/_\|_/g, "\\perp "], [/<=/g, "\\le "], [/>=/g, "\\ge "], [/!=/g, "\\ne "], [/<-/g, "\\leftarrow "], [/->/g, "\\to "],
  [/\|\|/g, "\\Vert "], [/\+-/g, "\\pm "], [/\binf\b/g, "\\infty "], [/\.\.\./g, "\\dots "],
  [/\bsum_/g, "\\sum_"], [/\bmin_/g, "\\min_"], [/\bmax_/g, "\\max_"], [/\bgrad\b/g, "\\nabla "], [/\*/g, "\\cdot "], [/%/g, "\\%"], [/&/g, "\\&"], [/#/g, "\\#"],
  [/λ/g, "\\lambda "], [/Λ/g, "\\Lambda "], [/θ/g, "\\theta "], [/μ|µ/g, "\\mu "],
];

/// Words are words, not products of letters.
const words = (text) => text.replace(/(^|[\s(,;])((?:[A-Za-z][a-z]{2,}|is|in|of|at|if|to|or|by|on|no|as|an|the|for|with|where)(?:[\s-]+(?:[a-z]{2,}))*)(?=[\s,;.:)]|$)/g,
  (all, before, word) => (/^(theta|gamma|lambda|Lambda|mu|alpha|beta|eps|tau|rho|omega|sigma|phi|Delta|delta|sum|min|max|grad|inf|sin|cos|exp|log|det)$/.test(word) ? all : `${before}\\text{ ${word} }`));

export function toTex(text) {
  let tex = words(text);
  tex = tex.replace(/([A-Za-z)}\]])((?:_\{[^}]*\}|_[A-Za-z0-9]+)?)\^-1/g, "$1$2^{-1}");
  tex = tex.replace(/_([A-Za-z0-9]{2,})/g, "_{$1}").replace(/\^(-?[A-Za-z0-9]{2,}|-\d)/g, "^{$1}").replace(/\^\(([^()]*)\)/g, "^{($1)}");
  tex = tex.replace(/([A-Za-z}])\^(\{[^}]*\}|[A-Za-z0-9])'/g, (all, base, power) => `${base}^{${power.replace(/[{}]/g, "")}\\prime}`);
  tex = tex.replace(/\b([A-Z])hat\b/g, "\\hat{$1}").replace(/\b([a-z])bar\b/g, "\\bar{$1}");
  tex = tex.replace(/\bsqrt\(([^()]*)\)/g, "\\sqrt{$1}").replace(/(\s|\()(sin|cos|exp|log|det|sign)\(/g, "$1\\operatorname{$2}(");
  tex = tex.replace(GREEK, "\\$1 ");
  for (const [pattern, by] of SYMBOLS) tex = tex.replace(pattern, by);
  return tex.replace(/\\eps /g, "\\varepsilon ").replace(/\s{3,}/g, "\\quad ").replace(/\s+_/g, "_").replace(/\s+\^/g, "^");
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
    const equation = /^\s{2,}(.*?)\s{2,}\((\d+[a-z']?)\)$/.exec(line);
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
