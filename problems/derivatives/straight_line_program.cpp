#include "problems/derivatives/straight_line_program.h"

#include <ginac/ginac.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <tuple>
#include <unordered_map>

#include "problems/derivatives/canonical_order.h"
#include "problems/derivatives/real_functions.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

double real_value(const GiNaC::numeric& number) {
  if (!number.is_real()) throw InputError("expression", "complex number", "only real numbers are allowed");
  return number.to_double();
}

}  // namespace

/// Translates expressions into instructions. Every value is a magnitude with a separate sign, and operands are in
/// canonical order, so the rounding of the program is the same in every run.
class ProgramBuilder {
 public:
  ProgramBuilder(StraightLineProgram& program, const StraightLineProgram::InputGroups& inputs,
                 const std::vector<StraightLineProgram::Constant>& constants)
      : program_(program) {
    for (const auto& group : inputs) {
      program_.group_sizes_.push_back(static_cast<std::int32_t>(group.size()));
      for (const auto& symbol : group) symbols_.emplace(symbol, Node{.index = program_.n_inputs_++});
    }
    for (const auto& [symbol, value, may_change] : constants) {
      if (!may_change) {
        symbols_.emplace(symbol, number(value));
        continue;
      }
      symbols_.emplace(symbol, Node{.kind = Node::Kind::prepared, .index = program_.n_changing_++});
      changing_.push_back(value);
    }
  }

  void add_output(const GiNaC::ex& expression) { outputs_.push_back(with_sign(visit(expression))); }

  /// Numbers the registers now that all constants are known.
  void finish() {
    program_.constants_.resize(changing_.size() + prepared_steps_.size());
    const auto register_of = [&](const Node& node) -> std::int32_t {
      if (node.is_number()) return constant_index(node.number);
      return node.kind == Node::Kind::prepared ? -node.index - 1 : node.index;
    };
    const auto translate_steps = [&](const std::vector<Step>& steps, std::vector<Instruction>& code) {
      for (const auto& step : steps) {
        const auto left = register_of(step.left);
        const auto right = step.binary ? register_of(step.right) : left;
        code.push_back({step.op, left, right, step.op == Op::choose ? register_of(step.third) : left});
      }
    };
    translate_steps(prepared_steps_, program_.preparation_);
    translate_steps(steps_, program_.code_);
    for (const auto& node : outputs_) {
      program_.constant_ = program_.constant_ && node.kind != Node::Kind::computed;
      program_.outputs_.push_back(register_of(node));
    }
    // Until here, inputs and results count from 0 and constants are negative; shift them after the constants.
    const auto shift = static_cast<std::int32_t>(program_.constants_.size());
    const auto place = [&](std::int32_t r) { return r < 0 ? -r - 1 : r + shift; };
    for (auto* code : {&program_.preparation_, &program_.code_}) {
      for (auto& instruction : *code) {
        for (auto* operand : {&instruction.left, &instruction.right, &instruction.third}) *operand = place(*operand);
      }
    }
    for (auto& output : program_.outputs_) output = place(output);
    program_.set_constants(changing_);
  }

 private:
  using Op = StraightLineProgram::Op;
  using Instruction = StraightLineProgram::Instruction;

  /// A number; the index of a constant that may change, or of a result that depends only on such constants; or the
  /// index of an input or of any other result.
  struct Node {
    enum class Kind { number, prepared, computed };
    Kind kind = Kind::computed;
    double number = 0;
    std::int32_t index = -1;
    bool is_number() const { return kind == Kind::number; }
    auto operator<=>(const Node&) const = default;
  };
  struct Value {
    bool negative = false;
    Node magnitude;
  };
  struct Step {
    Op op;
    bool binary;
    Node left, right, third;
  };
  Value visit(const GiNaC::ex& expression) {
    const auto known = values_.find(expression);
    if (known != values_.end()) return known->second;
    const Value value = translate(expression);
    values_.emplace(expression, value);
    return value;
  }

  Value translate(const GiNaC::ex& e) {
    if (GiNaC::is_a<GiNaC::numeric>(e)) return signed_number(real_value(GiNaC::ex_to<GiNaC::numeric>(e)));
    if (GiNaC::is_a<GiNaC::constant>(e)) return signed_number(real_value(GiNaC::ex_to<GiNaC::numeric>(e.evalf())));
    if (GiNaC::is_a<GiNaC::symbol>(e)) {
      const auto bound = symbols_.find(e);
      if (bound == symbols_.end()) {
        throw InputError("expression", GiNaC::ex_to<GiNaC::symbol>(e).get_name(), "this name is not bound to a value");
      }
      return {false, bound->second};
    }
    if (GiNaC::is_a<GiNaC::add>(e)) return sum(e);
    if (GiNaC::is_a<GiNaC::mul>(e)) return product(order_.sorted(e));
    if (GiNaC::is_a<GiNaC::power>(e)) return product({e});
    if (GiNaC::is_a<GiNaC::function>(e)) return {false, call(GiNaC::ex_to<GiNaC::function>(e))};
    throw InputError("expression", printed(e), "this kind of expression cannot be evaluated in doubles");
  }

  /// The first term in canonical order is positive in the magnitude of the sum.
  Value sum(const GiNaC::ex& e) {
    Value total;
    bool is_first = true;
    for (const auto& term : order_.sorted(e)) {
      const Value value = visit(term);
      if (is_first) {
        total = value;
        is_first = false;
      } else {
        total.magnitude =
            binary(value.negative == total.negative ? Op::add : Op::sub, total.magnitude, value.magnitude);
      }
    }
    return total;
  }

  /// Numerator over denominator, so that x^-1 y^-2 costs one division.
  Value product(const std::vector<GiNaC::ex>& factors) {
    bool negative = false;
    Node top = number(1), bottom = number(1);
    const auto times = [&](Node& side, const Value& factor) {
      negative = negative != factor.negative;
      side = binary(Op::mul, side, factor.magnitude);
    };
    for (const auto& factor : factors) {
      if (GiNaC::is_a<GiNaC::power>(factor)) {
        const GiNaC::ex exponent = factor.op(1);
        const bool inverse = order_.shape(exponent).negative && !GiNaC::is_a<GiNaC::add>(exponent);
        times(inverse ? bottom : top, raise(visit(factor.op(0)), inverse ? GiNaC::ex(-exponent) : exponent));
      } else if (GiNaC::is_a<GiNaC::numeric>(factor)) {
        const auto& rational = GiNaC::ex_to<GiNaC::numeric>(factor);
        times(top, signed_number(real_value(rational.numer())));
        times(bottom, signed_number(real_value(rational.denom())));
      } else {
        times(top, visit(factor));
      }
    }
    if (!(bottom.is_number() && bottom.number == 1)) top = binary(Op::div, top, bottom);
    return {negative, top};
  }

  /// base^exponent for an exponent without minus sign: whole and half powers by multiplication and square root.
  Value raise(const Value& base, const GiNaC::ex& exponent) {
    if (GiNaC::is_a<GiNaC::numeric>(exponent)) {
      const GiNaC::numeric twice = 2 * GiNaC::ex_to<GiNaC::numeric>(exponent);
      if (twice.is_pos_integer() && twice <= 64) {
        const int n = twice.to_int();
        if (n % 2 == 0) return {n % 4 == 2 && base.negative, whole_power(base.magnitude, n / 2)};
        const Node root = unary(Op::sqrt, with_sign(base));
        return {n % 4 == 3 && base.negative, binary(Op::mul, whole_power(base.magnitude, n / 2), root)};
      }
    }
    return {false, binary(Op::pow, with_sign(base), with_sign(visit(exponent)))};
  }

  Node whole_power(const Node& base, int n) {
    if (n == 0) return number(1);
    if (n == 1) return base;
    const Node half = whole_power(base, n / 2);
    const Node square = binary(Op::mul, half, half);
    return n % 2 ? binary(Op::mul, square, base) : square;
  }

  Node call(const GiNaC::function& f) {
    static const std::map<std::string, Op> unary_functions = {
        {"sin", Op::sin},   {"cos", Op::cos}, {"tan", Op::tan},   {"asin", Op::asin},     {"acos", Op::acos},
        {"atan", Op::atan}, {"exp", Op::exp}, {"log", Op::log},   {"sinh", Op::sinh},     {"cosh", Op::cosh},
        {"tanh", Op::tanh}, {"abs", Op::abs}, {"csgn", Op::sign}, {"magnitude", Op::abs}, {"sign", Op::sign}};
    if (f.get_name() == "atan2") return binary(Op::atan2, with_sign(visit(f.op(0))), with_sign(visit(f.op(1))));
    if (f.get_name() == "choose") {
      const Node c = with_sign(visit(f.op(0))), a = with_sign(visit(f.op(1))), b = with_sign(visit(f.op(2)));
      return c.is_number() ? (c.number > 0 ? a : b) : emit(Op::choose, true, c, a, b);
    }
    const auto known = unary_functions.find(f.get_name());
    if (known == unary_functions.end()) throw InputError("function", f.get_name(), "has no counterpart in doubles");
    return unary(known->second, with_sign(visit(f.op(0))));
  }

  static Node number(double value) { return Node{.kind = Node::Kind::number, .number = value}; }
  static Value signed_number(double value) { return {value < 0, number(std::abs(value))}; }
  Node with_sign(const Value& value) { return value.negative ? unary(Op::neg, value.magnitude) : value.magnitude; }

  Node unary(Op op, const Node& x) { return emit(op, false, x, x, x); }

  Node binary(Op op, Node x, Node y) {
    const auto is = [](const Node& n, double value) { return n.is_number() && n.number == value; };
    if (op == Op::mul && is(x, 1)) return y;
    if ((op == Op::mul || op == Op::div) && is(y, 1)) return x;
    if (op == Op::mul && (is(x, 0) || is(y, 0))) return number(0);
    if (op == Op::add && is(x, 0)) return y;
    if ((op == Op::add || op == Op::sub) && is(y, 0)) return x;
    return emit(op, true, x, y, x);
  }

  Node emit(Op op, bool is_binary, const Node& x, const Node& y, const Node& z) {
    if (x.is_number() && y.is_number()) return number(StraightLineProgram::apply(op, x.number, y.number));
    const auto key = std::tuple(op, x, y, z);
    const auto known = emitted_.find(key);
    if (known != emitted_.end()) return known->second;
    const auto is_computed = [](const Node& node) { return node.kind == Node::Kind::computed; };
    const Node::Kind kind =
        is_computed(x) || is_computed(y) || is_computed(z) ? Node::Kind::computed : Node::Kind::prepared;
    auto& steps = kind == Node::Kind::computed ? steps_ : prepared_steps_;
    const std::int32_t before = kind == Node::Kind::computed ? program_.n_inputs_ : program_.n_changing_;
    const Node result{.kind = kind, .index = before + static_cast<std::int32_t>(steps.size())};
    steps.push_back({op, is_binary, x, y, z});
    emitted_.emplace(key, result);
    return result;
  }

  std::int32_t constant_index(double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    const auto [entry, is_new] =
        constant_indices_.try_emplace(bits, static_cast<std::int32_t>(program_.constants_.size()));
    if (is_new) program_.constants_.push_back(value);
    return -entry->second - 1;
  }

  /// GiNaC names a symbol without a name by a counter of the process; here its position in the inputs is used.
  std::string lasting_name(const GiNaC::ex& e) const {
    const std::string name = printed(e);
    const auto bound = symbols_.find(e);
    const bool is_nameless = bound != symbols_.end() && name.starts_with("symbol");
    return is_nameless ? "input " + std::to_string(bound->second.index) : name;
  }

  StraightLineProgram& program_;
  std::map<GiNaC::ex, Node, GiNaC::ex_is_less> symbols_;
  std::map<GiNaC::ex, Value, GiNaC::ex_is_less> values_;
  CanonicalOrder order_{[this](const GiNaC::ex& e) { return lasting_name(e); }};
  std::map<std::tuple<Op, Node, Node, Node>, Node> emitted_;
  std::unordered_map<std::uint64_t, std::int32_t> constant_indices_;
  std::vector<double> changing_;  // values of the constants that may change
  std::vector<Step> steps_, prepared_steps_;
  std::vector<Node> outputs_;
};

StraightLineProgram::StraightLineProgram(const std::vector<GiNaC::ex>& outputs, const InputGroups& inputs,
                                         const std::vector<Constant>& constants) {
  ProgramBuilder builder(*this, inputs, constants);
  for (const auto& output : outputs) builder.add_output(output);
  builder.finish();
}

namespace {

/// The square of a register: its bounds are closer than those of a product.
inline double square_of(double x) {
  return x * x;
}
inline Interval square_of(const Interval& x) {
  return square(x);
}

}  // namespace

template <class Number>
Number StraightLineProgram::apply(Op op, const Number& x, const Number& y) {
  using std::abs, std::acos, std::asin, std::atan, std::atan2, std::cos, std::cosh, std::exp, std::log, std::pow,
      std::sin, std::sinh, std::sqrt, std::tan, std::tanh;
  switch (op) {
    case Op::add:
      return x + y;
    case Op::sub:
      return x - y;
    case Op::mul:
      return &x == &y ? square_of(x) : x * y;
    case Op::div:
      return x / y;
    case Op::neg:
      return -x;
    case Op::sqrt:
      return sqrt(x);
    case Op::pow:
      return pow(x, y);
    case Op::sin:
      return sin(x);
    case Op::cos:
      return cos(x);
    case Op::tan:
      return tan(x);
    case Op::asin:
      return asin(x);
    case Op::acos:
      return acos(x);
    case Op::atan:
      return atan(x);
    case Op::atan2:
      return atan2(x, y);
    case Op::exp:
      return exp(x);
    case Op::log:
      return log(x);
    case Op::sinh:
      return sinh(x);
    case Op::cosh:
      return cosh(x);
    case Op::tanh:
      return tanh(x);
    case Op::abs:
      return abs(x);
    case Op::sign:
      return sign(x);
    case Op::choose:
      break;  // of three operands: run()
  }
  return Number(std::nan(""));
}

template <class Number>
void StraightLineProgram::run(const std::vector<Instruction>& code, const Number* r, Number* next) {
  for (const auto& i : code)
    *next++ = i.op == Op::choose ? choose(r[i.left], r[i.right], r[i.third]) : apply(i.op, r[i.left], r[i.right]);
}

void StraightLineProgram::set_constants(std::span<const double> values) {
  if (n_changing_ == 0) return;
  double* next = std::copy_n(values.begin(), n_changing_, constants_.data());
  run(preparation_, static_cast<const double*>(constants_.data()), next);
}

void StraightLineProgram::constant_outputs(double* outputs) const {
  for (const auto k : outputs_) *outputs++ = constants_[k];
}

template <class Number>
void StraightLineProgram::evaluate(std::span<const std::type_identity_t<Number>* const> inputs, Number* outputs,
                                   const int* positions) const {
  const std::size_t n_registers = constants_.size() + static_cast<std::size_t>(n_inputs_) + code_.size();
  Number small[256];  // a stack buffer keeps the time step free of allocation and the program shareable between threads
  thread_local std::vector<Number> large;
  if (n_registers > std::size(small) && large.size() < n_registers) large.resize(n_registers);
  Number* r = n_registers > std::size(small) ? large.data() : small;

  Number* next = std::copy(constants_.begin(), constants_.end(), r);
  auto size = group_sizes_.begin();
  for (const Number* group : inputs) next = std::copy_n(group, *size++, next);
  run(code_, static_cast<const Number*>(r), next);
  if (positions) {
    for (std::size_t k = 0; k < outputs_.size(); ++k) outputs[positions[k]] = r[outputs_[k]];
  } else {
    for (std::size_t k = 0; k < outputs_.size(); ++k) outputs[k] = r[outputs_[k]];
  }
}

template void StraightLineProgram::evaluate<double>(std::span<const double* const>, double*, const int*) const;
template void StraightLineProgram::evaluate<Interval>(std::span<const Interval* const>, Interval*, const int*) const;

}  // namespace ricochet
