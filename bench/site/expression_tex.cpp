#include "bench/site/expression_tex.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <vector>

#include "problems/input_error.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using GiNaC::is_a;

/// A term with its sign apart, so that a sum can write "a - b".
struct Term {
  bool negative = false;
  std::string tex;
  std::string
      sum{};  ///< of a sum: with its sign, as it stands alone; `tex` leads with a plus, as it stands as a factor

  bool operator<(const Term& other) const { return tex != other.tex ? tex < other.tex : negative < other.negative; }
  std::string with_sign() const { return !sum.empty() ? sum : negative ? "-" + tex : tex; }
  std::string factor() const { return !sum.empty() ? "\\left(" + tex + "\\right)" : tex; }
};

Term term_of(const ex& e);

std::string number_tex(const GiNaC::numeric& size) {
  if (!size.is_rational()) return fmt::format("{}", size.to_double());
  std::ostringstream text;
  text << size;
  return text.str();
}

std::string joined(const std::vector<Term>& terms, bool opposite) {
  std::string tex;
  for (const Term& term : terms) tex += (term.negative != opposite ? "-" : tex.empty() ? "" : "+") + term.factor();
  return tex;
}

/// GiNaC takes a sign out of a sum, or leaves it, as its order of the terms will have it: ours follows their text.
Term sum_of(const ex& e) {
  std::vector<Term> terms;
  for (const ex& part : e) terms.push_back(term_of(part));
  std::sort(terms.begin(), terms.end());
  Term sum{.negative = terms.front().negative, .tex = joined(terms, terms.front().negative)};
  std::stable_partition(terms.begin(), terms.end(), [](const Term& term) { return !term.negative; });
  sum.sum = joined(terms, false);
  return sum;
}

struct Fraction {
  bool negative = false;
  std::vector<std::string> numbers, top, bottom;
};

/// base^exponent, in the numerator where the exponent is no negative number.
void multiply(const ex& e, Fraction& fraction) {
  if (is_a<GiNaC::numeric>(e)) {
    const auto& number = GiNaC::ex_to<GiNaC::numeric>(e);
    fraction.negative = fraction.negative != number.is_negative();
    const GiNaC::numeric size = GiNaC::abs(number);
    if (!size.is_rational()) {
      fraction.numbers.push_back(number_tex(size));
      return;
    }
    if (!size.numer().is_equal(1)) fraction.numbers.push_back(number_tex(size.numer()));
    if (!size.denom().is_equal(1)) fraction.bottom.insert(fraction.bottom.begin(), number_tex(size.denom()));
    return;
  }
  if (!is_a<GiNaC::power>(e)) {
    const Term term = term_of(e);
    fraction.negative = fraction.negative != term.negative;
    fraction.top.push_back(term.factor());
    return;
  }
  const ex &base = e.op(0), &exponent = e.op(1);
  const bool is_below = is_a<GiNaC::numeric>(exponent) && GiNaC::ex_to<GiNaC::numeric>(exponent).is_negative();
  const ex size = is_below ? -exponent : exponent;
  const Term inside = term_of(base);
  const bool is_whole = size.info(GiNaC::info_flags::integer);  // a sign leaves a whole power; in another one it stays
  fraction.negative = fraction.negative != (is_whole && inside.negative && size.info(GiNaC::info_flags::odd));
  std::string tex;
  if (size.is_equal(1))
    tex = inside.factor();
  else if (size.is_equal(GiNaC::numeric(1, 2)))
    tex = "\\sqrt{" + inside.with_sign() + "}";
  else {
    const bool is_plain = is_a<GiNaC::symbol>(base);
    const std::string text = is_whole ? inside.tex : inside.with_sign();
    tex = (is_plain ? "{" + text + "}" : "\\left(" + text + "\\right)") + "^{" + term_of(size).with_sign() + "}";
  }
  (is_below ? fraction.bottom : fraction.top).push_back(tex);
}

Term product_of(const ex& e) {
  Fraction fraction;
  if (is_a<GiNaC::mul>(e)) {
    for (const ex& factor : e) multiply(factor, fraction);
  } else {
    multiply(e, fraction);
  }
  std::ranges::sort(fraction.top);
  std::ranges::sort(fraction.bottom);
  fraction.top.insert(fraction.top.begin(), fraction.numbers.begin(), fraction.numbers.end());
  const std::string top = fraction.top.empty() ? "1" : fmt::format("{}", fmt::join(fraction.top, " \\, "));
  if (fraction.bottom.empty()) return {.negative = fraction.negative, .tex = top};
  return {.negative = fraction.negative,
          .tex = fmt::format("\\frac{{{}}}{{{}}}", top, fmt::join(fraction.bottom, " \\, "))};
}

Term call_of(const GiNaC::function& f) {
  std::vector<std::string> arguments;
  for (std::size_t i = 0; i < f.nops(); ++i) arguments.push_back(term_of(f.op(i)).with_sign());
  const std::string name = f.get_name();
  if (name == "abs" || name == "magnitude") return {.tex = "\\left|" + arguments[0] + "\\right|"};
  if (name == "choose")
    return {.tex = fmt::format("\\begin{{cases}} {} & {} > 0 \\\\ {} & \\text{{else}} \\end{{cases}}", arguments[1],
                               arguments[0], arguments[2])};
  return {.tex = fmt::format("\\operatorname{{{}}}\\left({}\\right)", name, fmt::join(arguments, ", "))};
}

Term term_of(const ex& e) {
  if (is_a<GiNaC::numeric>(e) || is_a<GiNaC::mul>(e) || is_a<GiNaC::power>(e)) return product_of(e);
  if (is_a<GiNaC::symbol>(e)) return {.tex = symbol_tex(GiNaC::ex_to<GiNaC::symbol>(e).get_name())};
  if (e.is_equal(GiNaC::Pi)) return {.tex = "\\pi"};
  if (is_a<GiNaC::add>(e)) return sum_of(e);
  if (is_a<GiNaC::function>(e)) return call_of(GiNaC::ex_to<GiNaC::function>(e));
  std::ostringstream text;
  text << e;
  throw InputError("expression", text.str(), "a formula is required");
}

}  // namespace

std::string expression_tex(const GiNaC::ex& expression) {
  return term_of(expression).with_sign();
}

std::string symbol_tex(const std::string& name) {
  static const std::set<std::string> greek = {"alpha",  "beta",  "gamma", "delta", "epsilon", "theta", "kappa",
                                              "lambda", "mu",    "nu",    "rho",   "sigma",   "tau",   "phi",
                                              "psi",    "omega", "Omega", "Phi",   "Theta"};
  const auto cut = name.find_first_of("[_0123456789");
  const std::string base = name.substr(0, cut);
  std::string subscript;
  if (cut != std::string::npos) {
    for (const char c : name.substr(cut)) {
      if (c != '[' && c != ']') subscript += c == '_' && !subscript.empty() ? ',' : c;
    }
    if (subscript.starts_with("_")) subscript.erase(0, 1);
  }
  const std::string letter = greek.contains(base) ? "\\" + base : base.size() > 1 ? "\\mathrm{" + base + "}" : base;
  const bool is_word = subscript.size() > 1 && std::isalpha(static_cast<unsigned char>(subscript.front()));
  if (subscript.empty()) return letter;
  return fmt::format("{}_{{{}}}", letter, is_word ? "\\mathrm{" + subscript + "}" : subscript);
}

}  // namespace ricochet
