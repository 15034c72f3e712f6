#include "problems/scene_file/expression.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

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

struct Reader {
  const ExpressionNames& names;
  std::vector<ex> values;
  std::vector<std::size_t> open_calls;  // value count where the arguments of each unfinished call begin
  std::vector<std::string> functions;
  std::vector<std::string> comparisons;  // of unfinished conditions

  ex pop() {
    ex value = values.back();
    values.pop_back();
    return value;
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

template <class Rule>
struct Control : pegtl::must_if<Messages, pegtl::normal, false>::control<Rule> {};

template <class Rule>
struct Action {};

template <>
struct Action<grammar::unary> : pegtl::limit_depth<200> {};

template <>
struct Action<grammar::number> {
  static void apply(const auto& in, Reader& reader) { reader.values.emplace_back(GiNaC::numeric(in.string().c_str())); }
};

template <>
struct Action<grammar::scalar> {
  static void apply(const auto& in, Reader& reader) {
    const auto known = reader.names.scalars.find(in.string());
    if (known != reader.names.scalars.end()) {
      reader.values.push_back(known->second);
    } else if (in.string() == "pi") {
      reader.values.emplace_back(GiNaC::Pi);
    } else {
      throw pegtl::parse_error(fmt::format("unknown name '{}'; known are {}, pi and the functions", in.string(),
                                           fmt::join(keys_of(reader.names.scalars), ", ")),
                               in);
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
      throw pegtl::parse_error(
          fmt::format("'{}' has no entries; {} have", name, fmt::join(keys_of(reader.names.vectors), ", ")), in);
    }
    const auto size = known->second.size();
    const std::string digits = text.substr(text.find_first_of("0123456789", bracket));
    const unsigned long index = digits.size() > 9 ? size : std::stoul(digits);
    if (index >= size) throw pegtl::parse_error(fmt::format("index out of range, {} has {} entries", name, size), in);
    reader.values.push_back(known->second[index]);
  }
};

template <>
struct Action<grammar::comparison> {
  static void apply(const auto& in, Reader& reader) { reader.comparisons.push_back(in.string()); }
};

/// b > a and b >= a are written as something that is positive: the second by choosing the other way round.
template <>
struct Action<grammar::choice> {
  static void apply0(Reader& reader) {
    ex otherwise = reader.pop(), then = reader.pop();
    const ex right = reader.pop(), left = reader.pop();
    const std::string comparison = reader.comparisons.back();
    reader.comparisons.pop_back();
    ex difference = comparison[0] == '>' ? left - right : right - left;
    if (comparison.ends_with('=')) {
      difference = -difference;
      std::swap(then, otherwise);
    }
    reader.values.push_back(choose(difference, then, otherwise));
  }
};

template <>
struct Action<grammar::function_name> {
  static void apply(const auto& in, Reader& reader) {
    reader.functions.push_back(in.string());
    reader.open_calls.push_back(reader.values.size());
  }
};

template <>
struct Action<grammar::call> {
  using Unary = ex (*)(const ex&);
  using Binary = ex (*)(const ex&, const ex&);

  static void apply(const auto& in, Reader& reader) {
    static const std::map<std::string, Unary> unary = {{"sin", [](const ex& x) { return ex(sin(x)); }},
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
    static const std::map<std::string, Binary> binary = {
        {"atan2", [](const ex& y, const ex& x) { return ex(atan2(y, x)); }},
        {"max", [](const ex& a, const ex& b) { return choose(a - b, a, b); }},
        {"min", [](const ex& a, const ex& b) { return choose(b - a, a, b); }}};
    const std::string name = reader.functions.back();
    const std::size_t begin = reader.open_calls.back();
    reader.functions.pop_back();
    reader.open_calls.pop_back();
    const std::vector<ex> arguments(reader.values.begin() + static_cast<std::ptrdiff_t>(begin), reader.values.end());
    reader.values.resize(begin);
    const auto of_one = unary.find(name);
    const auto of_two = binary.find(name);
    if (of_one == unary.end() && of_two == binary.end()) {
      throw pegtl::parse_error(fmt::format("unknown function '{}'; known are {}, {}, if", name,
                                           fmt::join(keys_of(unary), ", "), fmt::join(keys_of(binary), ", ")),
                               in);
    }
    const std::size_t expected = of_one != unary.end() ? 1 : 2;
    if (arguments.size() != expected) {
      throw pegtl::parse_error(fmt::format("{} takes {} argument(s), not {}", name, expected, arguments.size()), in);
    }
    reader.values.push_back(expected == 1 ? of_one->second(arguments[0]) : of_two->second(arguments[0], arguments[1]));
  }
};

template <class Combine>
struct BinaryAction {
  static void apply0(Reader& reader) {
    const ex right = reader.pop();
    const ex left = reader.pop();
    reader.values.push_back(Combine{}(left, right));
  }
};
struct Power {
  ex operator()(const ex& base, const ex& exponent) const { return pow(base, exponent); }
};
template <>
struct Action<grammar::add> : BinaryAction<std::plus<ex>> {};
template <>
struct Action<grammar::subtract> : BinaryAction<std::minus<ex>> {};
template <>
struct Action<grammar::times> : BinaryAction<std::multiplies<ex>> {};
template <>
struct Action<grammar::divide> : BinaryAction<std::divides<ex>> {};
template <>
struct Action<grammar::raise> : BinaryAction<Power> {};
template <>
struct Action<grammar::negate> {
  static void apply0(Reader& reader) { reader.values.push_back(-reader.pop()); }
};

}  // namespace

GiNaC::ex parse_expression(const std::string& text, const ExpressionNames& names, const std::string& field) {
  const auto complain = [&](std::size_t column, std::string_view what) -> InputError {
    return InputError(fmt::format("{}, column {}: {}\n  {}\n  {:>{}}", field, column, what, text, '^', column));
  };
  Reader reader{names, {}, {}, {}, {}};
  pegtl::memory_input input(text, field);
  try {
    pegtl::parse<grammar::whole, Action, Control>(input, reader);
  } catch (const pegtl::parse_error& error) {
    throw complain(error.positions().front().column, error.message());
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {  // GiNaC: division by zero and the like
    throw complain(input.position().column, error.what());
  }
  return reader.values.back();
}

}  // namespace ricochet
