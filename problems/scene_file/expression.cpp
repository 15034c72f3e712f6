#include "problems/scene_file/expression.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string_view>
#include <tao/pegtl.hpp>
#include <tao/pegtl/contrib/limit_depth.hpp>

#include "problems/derivatives/real_functions.h"
#include "problems/input_error.h"
#include "problems/names.h"

// PEGTL (Debian: tao-pegtl-dev) because a grammar is a list of types there and every error carries its position.

namespace ricochet {
namespace {

namespace pegtl = tao::pegtl;
using GiNaC::ex;

constexpr std::size_t kLongest = 100000;  // characters: sums are built term by term
constexpr double kLargest = 100000;       // operations: min, max and if repeat their arguments, at every level
constexpr int kMostDigits = 400;          // of a number, and of its exponent of ten
constexpr double kMostBits = 1e6;         // of a power of numbers, which is exact
constexpr double kMostDegree = 1000;      // of a power with names in it, whose factor is raised with it
constexpr std::size_t kShown = 100;       // characters of a formula beside its error

/// A part of a formula with bounds of its size: values are exact, so a short text can mean a number that fills the
/// memory.
struct Part {
  ex value;
  double size = 1;    ///< operations, shared ones as often as they occur
  double degree = 0;  ///< of a polynomial in the names
};

/// Bits of the numerator and the denominator.
double bits(const GiNaC::numeric& number) {
  return number.is_rational() ? number.numer().int_length() + number.denom().int_length() : 64;
}

/// Rejects a number, or a numeric factor of a product, outside 10^-400 to 10^400. This range is far beyond that of
/// doubles, and its numbers are short.
void require_short(const ex& value) {
  const ex last = GiNaC::is_a<GiNaC::mul>(value) ? value.op(value.nops() - 1) : value;
  if (!GiNaC::is_a<GiNaC::numeric>(last)) return;
  static const GiNaC::numeric largest = GiNaC::pow(GiNaC::numeric(10), GiNaC::numeric(kMostDigits));
  const GiNaC::numeric size = GiNaC::abs(GiNaC::ex_to<GiNaC::numeric>(last));
  if (!size.is_zero() && (size > largest || size < largest.inverse()))
    throw std::range_error("a number is beyond the range of double precision");
}

/// A value with its operations and its degree, for a name that stands for a formula. Counting stops if the value is too
/// large, because shared operations count as often as they occur.
Part part_of(const ex& value) {
  Part part{value, 1, GiNaC::is_a<GiNaC::symbol>(value) ? 1.0 : 0.0};
  const bool is_product = GiNaC::is_a<GiNaC::mul>(value), is_sum = GiNaC::is_a<GiNaC::add>(value);
  for (std::size_t k = 0; k < value.nops() && part.size <= kLargest; ++k) {
    const Part operand = part_of(value.op(k));
    part.size += operand.size;
    part.degree = is_product ? part.degree + operand.degree : std::max(part.degree, operand.degree);
  }
  if (GiNaC::is_a<GiNaC::power>(value)) {
    if (GiNaC::is_a<GiNaC::numeric>(value.op(1)))
      part.degree *= std::max(1.0, std::abs(GiNaC::ex_to<GiNaC::numeric>(value.op(1)).to_double()));
  } else if (!is_product && !is_sum) {
    part.degree = std::min(part.degree, 1.0);  // of a function
  }
  return part;
}

/// "m, t, q[i], pi and the functions"
std::string allowed_names(const ExpressionNames& names) {
  std::vector<std::string> list = keys_of(names.scalars);
  for (const auto& vector : keys_of(names.vectors)) list.push_back(vector + "[i]");
  list.emplace_back("pi");
  return fmt::format("{} and the functions", fmt::join(list, ", "));
}

/// The message for an unknown name. For t, q, v and u it states the admissible variables of the field.
std::string unknown_name(const std::string& name, const ExpressionNames& names) {
  if (const auto vector = names.vectors.find(name); vector != names.vectors.end())
    return fmt::format("'{0}' has {1} entries; write {0}[0] for the first", name, vector->second.size());
  const std::string allowed = allowed_names(names);
  if (name != "t" && name != "q" && name != "v" && name != "u")
    return fmt::format("unknown name '{}'; known are {}", name, allowed);
  std::vector<std::string> may = keys_of(names.vectors);
  if (names.scalars.contains("t")) may.emplace_back("t");
  const std::string why = may.empty() ? "this field is a constant of the motion, a formula of parameters"
                                      : fmt::format("this field may depend on {} only", fmt::join(may, " and "));
  return fmt::format("'{}' is not allowed here: {}; allowed are {}", name, why, allowed);
}

/// An operator of another language, and its replacement.
struct ForeignOperator {
  std::string_view sign, advice;
};
constexpr std::string_view kBoth = "nest if: if(c, if(d, x, y), y) is x where c and d hold";
constexpr std::string_view kEither = "nest if: if(c, x, if(d, x, y)) is x where c or d holds";
constexpr std::string_view kNegation = "exchange the branches of if: if(c, y, x) is x where c does not hold";
constexpr std::string_view kComparison = "conditions compare with <, <=, > or >=";
constexpr ForeignOperator kForeign[] = {{"&&", kBoth},
                                        {"||", kEither},
                                        {"==", kComparison},
                                        {"!=", kComparison},
                                        {"<>", kComparison},
                                        {"//", "'/' divides"},
                                        {"&", kBoth},
                                        {"|", kEither},
                                        {"!", kNegation},
                                        {"=", kComparison},
                                        {"and", kBoth},
                                        {"or", kEither},
                                        {"not", kNegation},
                                        {"^", "write a**b for a power"},
                                        {"?", "write if(condition, a, b)"},
                                        {"<", "comparisons stand in if alone: if(a < b, x, y)"},
                                        {">", "comparisons stand in if alone: if(a > b, x, y)"}};

/// The foreign operator at the beginning of a text; null if there is none.
const ForeignOperator* foreign_operator(std::string_view text) {
  const auto is_letter = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
  const auto found = std::ranges::find_if(kForeign, [&](const ForeignOperator& op) {
    if (!text.starts_with(op.sign)) return false;
    return !is_letter(op.sign.front()) || text.size() == op.sign.size() || !is_letter(text[op.sign.size()]);
  });
  return found == std::end(kForeign) ? nullptr : found;
}

std::string message_of(const ForeignOperator& op) {
  return fmt::format("'{}' is not possible here; {}", op.sign, op.advice);
}

struct Reader {
  const ExpressionNames& names;
  std::vector<Part> values;
  std::vector<std::size_t> open_calls;  // value count where the arguments of each unfinished call begin
  std::vector<std::string> functions;
  std::vector<std::string> comparisons;  // of unfinished conditions

  Part pop() {
    Part part = std::move(values.back());
    values.pop_back();
    return part;
  }
  void push(ex value, double size, double degree) {
    if (size > kLargest) throw std::length_error("the expression is too large: min, max and if repeat their arguments");
    if (GiNaC::is_a<GiNaC::numeric>(value) && !GiNaC::ex_to<GiNaC::numeric>(value).is_real())
      throw std::domain_error("a real number is required");
    require_short(value);
    values.push_back({std::move(value), size, degree});
  }
};

namespace grammar {

using pegtl::digit, pegtl::if_must, pegtl::list, pegtl::not_at, pegtl::one, pegtl::opt, pegtl::plus, pegtl::seq,
    pegtl::sor, pegtl::star, pegtl::string;

struct space : star<pegtl::space> {};
template <char c>
struct token : seq<one<c>, space> {};

struct unary;
struct expression;

struct exponent : seq<one<'e', 'E'>, opt<one<'+', '-'>>, plus<digit>> {};
struct number : seq<sor<seq<plus<digit>, opt<one<'.'>, star<digit>>>, seq<one<'.'>, plus<digit>>>, opt<exponent>> {};
struct name : pegtl::identifier {};
struct index : plus<digit> {};
struct close_bracket : token<']'> {};
struct close_parenthesis : token<')'> {};
struct vector_name : name {};
struct vector_entry : seq<vector_name, space, if_must<token<'['>, index, space, close_bracket>> {};
struct comma : token<','> {};
struct comparison : seq<one<'<', '>'>, opt<one<'='>>> {};
struct condition : seq<expression, comparison, space, expression> {};
struct choice : seq<string<'i', 'f'>, space,
                    if_must<token<'('>, condition, comma, expression, comma, expression, close_parenthesis>> {};
struct function_name : name {};
struct call : seq<function_name, space, if_must<token<'('>, list<expression, token<','>>, close_parenthesis>> {};
struct scalar : name {};
struct parenthesis : if_must<token<'('>, expression, close_parenthesis> {};
struct atom : seq<sor<number, seq<pegtl::at<seq<string<'i', 'f'>, space, one<'('>>>, choice>,
                      seq<pegtl::at<seq<name, space, one<'('>>>, call>,
                      seq<pegtl::at<seq<name, space, one<'['>>>, vector_entry>, scalar, parenthesis>,
                  space> {};
struct raise : if_must<string<'*', '*'>, space, unary> {};
struct power : seq<atom, opt<raise>> {};
struct negate : if_must<token<'-'>, unary> {};
struct keep : if_must<token<'+'>, unary> {};
struct unary : sor<negate, keep, power> {};
struct times : if_must<seq<one<'*'>, not_at<one<'*'>>, space>, unary> {};
struct divide : if_must<token<'/'>, unary> {};
struct term : seq<unary, star<sor<times, divide>>> {};
struct add : if_must<token<'+'>, term> {};
struct subtract : if_must<token<'-'>, term> {};
struct expression : seq<term, star<sor<add, subtract>>> {};
struct end : pegtl::eof {};
struct whole : pegtl::must<space, expression, end> {};

}  // namespace grammar

struct Messages {
  template <class Rule>
  static constexpr const char* message = nullptr;
};
template <>
constexpr const char* Messages::message<grammar::expression> = "an expression is expected";
template <>
constexpr const char* Messages::message<grammar::condition> =
    "a condition is expected, two expressions with <, <=, > or >=";
template <>
constexpr const char* Messages::message<grammar::comma> = "',' is expected: if(condition, a, b)";
template <>
constexpr const char* Messages::message<grammar::unary> = "a number, a name or '(' is expected";
template <>
constexpr const char* Messages::message<grammar::term> = "a number, a name or '(' is expected";
template <>
constexpr const char* Messages::message<grammar::index> = "a whole number is expected as index";
template <>
constexpr const char* Messages::message<grammar::close_bracket> = "']' is expected";
template <>
constexpr const char* Messages::message<grammar::close_parenthesis> = "')' is expected";
template <>
constexpr const char* Messages::message<grammar::end> = "an operator or the end of the expression is expected";

/// Adds the column of the rule to an exception of an action.
template <class Rule>
struct Control : pegtl::must_if<Messages, pegtl::normal, false>::control<Rule> {
  template <template <class...> class Action, class Iterator, class Input>
  static auto apply(const Iterator& begin, const Input& in, Reader& reader)
      -> decltype(Action<Rule>::apply(std::declval<const typename Input::action_t&>(), reader)) {
    const typename Input::action_t match(begin, in);
    try {
      Action<Rule>::apply(match, reader);
    } catch (const pegtl::parse_error&) {
      throw;
    } catch (const std::exception& error) {  // GiNaC: division by zero and the like
      throw pegtl::parse_error(error.what(), match);
    }
  }
};

template <class Rule>
struct Action {};

template <>
struct Action<grammar::unary> : pegtl::limit_depth<200> {};

template <>
struct Action<grammar::number> {
  static void apply(const auto& in, Reader& reader) {
    const std::string text = in.string();
    const auto e = text.find_first_of("eE");
    if (std::min(e, text.size()) > kMostDigits)
      throw pegtl::parse_error(fmt::format("a number may have {} digits", kMostDigits), in);
    if (e != std::string::npos) {
      const auto first = text.find_first_not_of("+-0", e + 1);
      if (first != std::string::npos && (text.size() - first > 3 || std::stoi(text.substr(first)) > kMostDigits))
        throw pegtl::parse_error(fmt::format("an exponent of ten from -{} to {} is possible", kMostDigits, kMostDigits),
                                 in);
    }
    reader.push(GiNaC::numeric(text.c_str()), 1, 0);
  }
};

template <>
struct Action<grammar::scalar> {
  static void apply(const auto& in, Reader& reader) {
    const auto known = reader.names.scalars.find(in.string());
    if (known != reader.names.scalars.end()) {
      Part part = part_of(known->second);
      reader.push(std::move(part.value), part.size, part.degree);
    } else if (in.string() == "pi") {
      reader.push(GiNaC::Pi, 1, 0);
    } else {
      const ForeignOperator* const op = foreign_operator(in.string());
      throw pegtl::parse_error(op ? message_of(*op) : unknown_name(in.string(), reader.names), in);
    }
  }
};

template <>
struct Action<grammar::vector_entry> {
  static void apply(const auto& in, Reader& reader) {
    const std::string text = in.string();
    const auto bracket = text.find('[');
    const std::string name = text.substr(0, text.find_first_of(" \t[", 0));
    const auto known = reader.names.vectors.find(name);
    if (known == reader.names.vectors.end()) {
      const bool is_scalar = reader.names.scalars.contains(name) || name == "pi";
      throw pegtl::parse_error(
          is_scalar ? fmt::format("'{}' is a number and has no entries", name) : unknown_name(name, reader.names), in);
    }
    const auto size = known->second.size();
    const std::string digits = text.substr(text.find_first_of("0123456789", bracket));
    const unsigned long index = digits.size() > 9 ? size : std::stoul(digits);
    if (index >= size) throw pegtl::parse_error(fmt::format("index out of range, {} has {} entries", name, size), in);
    reader.push(known->second[index], 1, 1);
  }
};

template <>
struct Action<grammar::comparison> {
  static void apply(const auto& in, Reader& reader) { reader.comparisons.push_back(in.string()); }
};

/// b > a and b >= a are written as a positive difference; for >= the branches are exchanged.
template <>
struct Action<grammar::choice> {
  static void apply(const auto&, Reader& reader) {
    Part otherwise = reader.pop(), then = reader.pop();
    const Part right = reader.pop(), left = reader.pop();
    const std::string comparison = reader.comparisons.back();
    reader.comparisons.pop_back();
    ex difference = comparison[0] == '>' ? left.value - right.value : right.value - left.value;
    if (comparison.ends_with('=')) {
      difference = -difference;
      std::swap(then, otherwise);
    }
    reader.push(choose(difference, then.value, otherwise.value),
                1 + left.size + right.size + then.size + otherwise.size, std::max(then.degree, otherwise.degree));
  }
};

template <>
struct Action<grammar::function_name> {
  static void apply(const auto& in, Reader& reader) {
    reader.functions.push_back(in.string());
    reader.open_calls.push_back(reader.values.size());
  }
};

using Unary = ex (*)(const ex&);
using Binary = ex (*)(const ex&, const ex&);

const std::map<std::string, Unary>& functions_of_one() {
  static const std::map<std::string, Unary> functions = {{"sin", [](const ex& x) { return ex(sin(x)); }},
                                                         {"cos", [](const ex& x) { return ex(cos(x)); }},
                                                         {"tan", [](const ex& x) { return ex(tan(x)); }},
                                                         {"asin", [](const ex& x) { return ex(asin(x)); }},
                                                         {"acos", [](const ex& x) { return ex(acos(x)); }},
                                                         {"atan", [](const ex& x) { return ex(atan(x)); }},
                                                         {"sinh", [](const ex& x) { return ex(sinh(x)); }},
                                                         {"cosh", [](const ex& x) { return ex(cosh(x)); }},
                                                         {"tanh", [](const ex& x) { return ex(tanh(x)); }},
                                                         {"exp", [](const ex& x) { return ex(exp(x)); }},
                                                         {"log", [](const ex& x) { return ex(log(x)); }},
                                                         {"sqrt", [](const ex& x) { return ex(sqrt(x)); }},
                                                         {"abs", magnitude},
                                                         {"sign", sign}};
  return functions;
}

const std::map<std::string, Binary>& functions_of_two() {
  static const std::map<std::string, Binary> functions = {
      {"atan2", [](const ex& y, const ex& x) { return ex(atan2(y, x)); }},
      {"max", [](const ex& a, const ex& b) { return choose(a - b, a, b); }},
      {"min", [](const ex& a, const ex& b) { return choose(b - a, a, b); }}};
  return functions;
}

template <>
struct Action<grammar::call> {
  static void apply(const auto& in, Reader& reader) {
    const auto& unary = functions_of_one();
    const auto& binary = functions_of_two();
    const std::string name = reader.functions.back();
    const std::size_t begin = reader.open_calls.back();
    reader.functions.pop_back();
    reader.open_calls.pop_back();
    const std::vector<Part> arguments(reader.values.begin() + static_cast<std::ptrdiff_t>(begin), reader.values.end());
    reader.values.resize(begin);
    const auto of_one = unary.find(name);
    const auto of_two = binary.find(name);
    if (of_one == unary.end() && of_two == binary.end()) {
      if (const ForeignOperator* const op = foreign_operator(name)) throw pegtl::parse_error(message_of(*op), in);
      throw pegtl::parse_error(fmt::format("unknown function '{}'; known are {}, {}, if", name,
                                           fmt::join(keys_of(unary), ", "), fmt::join(keys_of(binary), ", ")),
                               in);
    }
    const std::size_t expected = of_one != unary.end() ? 1 : 2;
    if (arguments.size() != expected) {
      throw pegtl::parse_error(fmt::format("{} takes {} argument(s), not {}", name, expected, arguments.size()), in);
    }
    if (expected == 1) {
      reader.push(of_one->second(arguments[0].value), 1 + arguments[0].size, arguments[0].degree > 0 ? 1 : 0);
    } else {
      const auto& [a, b] = std::tie(arguments[0], arguments[1]);
      reader.push(of_two->second(a.value, b.value), 1 + 2 * (a.size + b.size), std::max(a.degree, b.degree));
    }
  }
};

template <class Combine>
struct BinaryAction {
  static void apply(const auto&, Reader& reader) {
    const Part right = reader.pop(), left = reader.pop();
    reader.push(Combine{}(left.value, right.value), 1 + left.size + right.size, std::max(left.degree, right.degree));
  }
};
template <class Combine>
struct ProductAction {
  static void apply(const auto&, Reader& reader) {
    const Part right = reader.pop(), left = reader.pop();
    reader.push(Combine{}(left.value, right.value), 1 + left.size + right.size, left.degree + right.degree);
  }
};
template <>
struct Action<grammar::add> : BinaryAction<std::plus<ex>> {};
template <>
struct Action<grammar::subtract> : BinaryAction<std::minus<ex>> {};
template <>
struct Action<grammar::times> : ProductAction<std::multiplies<ex>> {};
template <>
struct Action<grammar::divide> : ProductAction<std::divides<ex>> {};

/// Powers of numbers are exact; a power of a product also raises its numeric factor.
template <>
struct Action<grammar::raise> {
  static void apply(const auto&, Reader& reader) {
    const Part exponent = reader.pop(), base = reader.pop();
    const bool is_number = GiNaC::is_a<GiNaC::numeric>(base.value);
    double degree = is_number ? 0 : std::max(base.degree, 1.0);
    if (GiNaC::is_a<GiNaC::numeric>(exponent.value)) {
      const double n = std::abs(GiNaC::ex_to<GiNaC::numeric>(exponent.value).to_double());
      degree *= std::max(n, 1.0);
      if (degree > kMostDegree)
        throw std::range_error(
            fmt::format("exponents up to {} are possible, those of powers of powers multiply", kMostDegree));
      if (is_number && n > 1) {
        const auto& number = GiNaC::ex_to<GiNaC::numeric>(base.value);
        const double decades = number.is_zero() ? 0 : n * std::abs(std::log10(std::abs(number.to_double())));
        // A base of 400 digits may be infinite or zero as a double.
        if (bits(number) * n > kMostBits || !(decades <= kMostDigits))
          throw std::range_error("a power of numbers is too large");
      }
    } else if (is_number && !GiNaC::ex_to<GiNaC::numeric>(base.value).is_positive()) {
      // Its derivative contains the logarithm of the base.
      throw std::domain_error("a base above zero is required where the exponent is no number");
    }
    reader.push(pow(base.value, exponent.value), 1 + base.size + exponent.size, degree);
  }
};
template <>
struct Action<grammar::negate> {
  static void apply(const auto&, Reader& reader) {
    const Part part = reader.pop();
    reader.push(-part.value, 1 + part.size, part.degree);
  }
};

/// A formula with a mark below the column, from 1; for a long formula only the part around it.
std::string picture(const std::string& text, std::size_t column) {
  const std::size_t at = std::min(column, text.size() + 1);
  const std::size_t begin = text.size() <= kShown || at <= kShown / 2 ? 0 : at - kShown / 2;
  return fmt::format("  {}\n  {:>{}}", text.substr(begin, kShown), '^', at - begin);
}

}  // namespace

GiNaC::ex parse_expression(const std::string& text, const ExpressionNames& names, const std::string& field) {
  const auto complain = [&](std::size_t column, std::string_view what) -> InputError {
    return InputError(fmt::format("{}, column {}: {}\n{}", field, column, what, picture(text, column)));
  };
  if (text.size() > kLongest)
    throw InputError(field, fmt::format("{} characters", text.size()),
                     fmt::format("at most {} are possible", kLongest));
  Reader reader{names, {}, {}, {}, {}};
  pegtl::memory_input input(text, field);
  try {
    pegtl::parse<grammar::whole, Action, Control>(input, reader);
  } catch (const pegtl::parse_error& error) {
    // An operator of another language is at the position of the error, or within an invalid condition.
    std::size_t column = error.positions().front().column;
    const bool in_condition = error.message() == Messages::message<grammar::condition>;
    const auto foreign_at = [&](std::size_t c) {
      const bool is_in_a_name = c > 1 && std::isalnum(static_cast<unsigned char>(text[c - 2]));
      const auto* const op = c <= text.size() ? foreign_operator(std::string_view(text).substr(c - 1)) : nullptr;
      return op && is_in_a_name && std::isalpha(static_cast<unsigned char>(op->sign.front())) ? nullptr : op;
    };
    const auto is_expected = error.message().find(" expected") != std::string::npos;
    if (in_condition) {
      std::size_t c = column;
      while (c <= text.size() && text[c - 1] != ',' && !(foreign_at(c) && text[c - 1] != '<' && text[c - 1] != '>'))
        ++c;
      if (c <= text.size() && text[c - 1] != ',') column = c;
    }
    if (const ForeignOperator* const op = is_expected ? foreign_at(column) : nullptr)
      if (!in_condition || (op->sign != "<" && op->sign != ">")) throw complain(column, message_of(*op));
    throw complain(error.positions().front().column, error.message());
  }
  return reader.values.back().value;
}

double formula_value(const std::string& text, const ExpressionNames& names, const std::string& field) {
  const ex formula = parse_expression(text, names, field);
  double value = std::nan("");
  try {
    const ex number = formula.evalf();
    if (GiNaC::is_a<GiNaC::numeric>(number) && GiNaC::ex_to<GiNaC::numeric>(number).is_real())
      value = GiNaC::ex_to<GiNaC::numeric>(number).to_double();
  } catch (const std::exception& error) {  // CLN: overflow and the like
    throw InputError(field, text, error.what());
  }
  if (!std::isfinite(value)) throw InputError(field, text, "a finite real number is required");
  return value;
}

std::set<std::string> words_of_formulas() {
  std::set<std::string> words = {"pi", "if"};
  for (const auto& name : keys_of(functions_of_one())) words.insert(name);
  for (const auto& name : keys_of(functions_of_two())) words.insert(name);
  return words;
}

}  // namespace ricochet
