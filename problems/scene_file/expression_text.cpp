#include "problems/scene_file/expression_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>
#include <vector>

#include "problems/input_error.h"

namespace ricochet {
namespace {

using GiNaC::ex;

/// Precedence of a text: one of lower precedence needs parentheses inside one of higher precedence.
enum class Binding { sum, product, power, atom };

struct Text {
  bool negative = false;
  std::string magnitude;
  Binding binding = Binding::atom;

  bool operator<(const Text& other) const {
    return magnitude != other.magnitude ? magnitude < other.magnitude : negative < other.negative;
  }
  std::string inside(Binding required) const { return binding < required ? "(" + magnitude + ")" : magnitude; }
};

Text write(const ex& e);

std::string with_sign(const Text& text) {
  return text.negative ? "-" + text.inside(Binding::product) : text.magnitude;
}

Text write_number(const GiNaC::numeric& number) {
  if (!number.is_real()) throw InputError("expression", "complex number", "only real numbers can be written");
  const GiNaC::numeric size = GiNaC::abs(number);
  if (!size.is_rational()) return {number.is_negative(), fmt::format("{}", size.to_double())};
  std::ostringstream text;
  text << size;
  return {number.is_negative(), text.str(), size.is_integer() ? Binding::atom : Binding::product};
}

/// The sum, or its negative if that starts with a plus.
Text write_sum(const ex& e) {
  std::vector<Text> terms;
  for (const ex& term : e) terms.push_back(write(term));
  std::sort(terms.begin(), terms.end());
  Text sum{terms.front().negative, terms.front().inside(Binding::product), Binding::sum};
  for (auto term = terms.begin() + 1; term != terms.end(); ++term)
    sum.magnitude += (term->negative == sum.negative ? "+" : "-") + term->inside(Binding::product);
  return sum;
}

struct Factors {
  bool negative = false;
  std::vector<std::string> top, bottom;
};

void add_factor(const ex& e, Factors& factors) {
  if (GiNaC::is_a<GiNaC::numeric>(e)) {
    const auto& number = GiNaC::ex_to<GiNaC::numeric>(e);
    factors.negative = factors.negative != number.is_negative();
    const GiNaC::numeric size = GiNaC::abs(number);
    if (!size.numer().is_equal(1)) factors.top.insert(factors.top.begin(), write_number(size.numer()).magnitude);
    if (!size.denom().is_equal(1)) factors.bottom.insert(factors.bottom.begin(), write_number(size.denom()).magnitude);
    return;
  }
  if (!GiNaC::is_a<GiNaC::power>(e)) {
    const Text text = write(e);
    factors.negative = factors.negative != text.negative;
    factors.top.push_back(text.inside(Binding::power));
    return;
  }
  const Text base = write(e.op(0));
  const Text exponent = write(e.op(1));
  const bool inverse = exponent.negative && GiNaC::is_a<GiNaC::numeric>(e.op(1));
  const bool whole = e.op(1).info(GiNaC::info_flags::integer);
  // A sign can be moved out of an integer power, but not out of another one.
  factors.negative = factors.negative != (base.negative && whole && e.op(1).info(GiNaC::info_flags::odd));
  const std::string signed_base = base.negative && !whole ? "(" + with_sign(base) + ")" : base.inside(Binding::atom);
  std::string text;
  if (exponent.magnitude == "1")
    text = base.inside(Binding::power);
  else if (exponent.magnitude == "1/2")
    text = "sqrt(" + with_sign(base) + ")";
  else
    text = signed_base + "**" +
           (inverse || !exponent.negative ? exponent.inside(Binding::atom) : "(" + with_sign(exponent) + ")");
  (inverse ? factors.bottom : factors.top).push_back(text);
}

Text write_product(const ex& e) {
  Factors factors;
  if (GiNaC::is_a<GiNaC::mul>(e)) {
    for (const ex& factor : e) add_factor(factor, factors);
  } else {
    add_factor(e, factors);
  }
  std::sort(factors.top.begin(), factors.top.end());
  std::sort(factors.bottom.begin(), factors.bottom.end());
  std::string text = factors.top.empty() ? "1" : fmt::format("{}", fmt::join(factors.top, "*"));
  for (const auto& divisor : factors.bottom) text += "/" + divisor;
  const bool single = factors.top.size() == 1 && factors.bottom.empty();
  return {factors.negative, text, single ? Binding::power : Binding::product};
}

Text write_call(const GiNaC::function& f) {
  static const std::vector<std::string> known = {"sin",  "cos",  "tan", "asin", "acos", "atan", "atan2", "sinh",
                                                 "cosh", "tanh", "exp", "log",  "abs",  "sign", "choose"};
  const std::string name = f.get_name() == "magnitude" ? "abs" : f.get_name();
  if (std::find(known.begin(), known.end(), name) == known.end())
    throw InputError("function", name, fmt::format("scene files support {}, sqrt", fmt::join(known, ", ")));
  std::vector<std::string> arguments;
  for (std::size_t i = 0; i < f.nops(); ++i) arguments.push_back(with_sign(write(f.op(i))));
  if (name == "choose") return {false, fmt::format("if({} > 0, {}, {})", arguments[0], arguments[1], arguments[2])};
  return {false, fmt::format("{}({})", name, fmt::join(arguments, ", "))};
}

Text write(const ex& e) {
  if (GiNaC::is_a<GiNaC::numeric>(e)) return write_number(GiNaC::ex_to<GiNaC::numeric>(e));
  if (GiNaC::is_a<GiNaC::symbol>(e)) return {false, GiNaC::ex_to<GiNaC::symbol>(e).get_name()};
  if (e.is_equal(GiNaC::Pi)) return {false, "pi"};
  if (GiNaC::is_a<GiNaC::add>(e)) return write_sum(e);
  if (GiNaC::is_a<GiNaC::mul>(e) || GiNaC::is_a<GiNaC::power>(e)) return write_product(e);
  if (GiNaC::is_a<GiNaC::function>(e)) return write_call(GiNaC::ex_to<GiNaC::function>(e));
  std::ostringstream text;
  text << e;
  throw InputError("expression", text.str(), "scene files cannot express this");
}

}  // namespace

std::string expression_text(const GiNaC::ex& expression) {
  const Text text = write(expression);
  if (text.binding != Binding::sum || !text.negative) return with_sign(text);
  // A complete expression needs no common sign: write the sum term by term.
  std::vector<Text> terms;
  for (const ex& term : expression) terms.push_back(write(term));
  std::sort(terms.begin(), terms.end());
  std::string sum;
  for (const auto& term : terms) sum += (term.negative ? "-" : sum.empty() ? "" : "+") + term.inside(Binding::product);
  return sum;
}

}  // namespace ricochet
