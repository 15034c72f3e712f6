#pragma once

#include <ginac/ginac.h>

#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "problems/interval.h"

/// @file
/// Formulas made fast: symbolic expressions as programs over a number type.

namespace ricochet {

/// Straight-line program for a list of symbolic expressions. It is made once and runs over a number type: in doubles for
/// values, in intervals for bounds over a box of inputs. Its constants are doubles in either case.
///
/// GiNaC differentiates; a StraightLineProgram makes the result fast and repeatable. Equal subexpressions are computed
/// once, numbers are folded, and operands are put into an order that depends on their structure only: GiNaC's own order
/// follows memory addresses and would change the last bit from one run to the next.
class StraightLineProgram {
 public:
  /// A symbol that is folded into the program as a number; or, if it `may_change`, one that set_constants() changes.
  struct Constant {
    GiNaC::symbol symbol;     ///< as it occurs in the expressions
    double value;             ///< what it stands for
    bool may_change = false;  ///< set_constants() gives it other values
  };
  /// Symbols that are arguments, in groups with a pointer each.
  using InputGroups = std::vector<std::vector<GiNaC::symbol>>;

  StraightLineProgram() = default;  ///< Of no output.

  /// @param outputs    expressions, in the order in which evaluate() writes them
  /// @param inputs     groups of symbols, for example {q, v, u}
  /// @param constants  every other symbol that occurs
  /// @throws InputError for a symbol without value, a complex number or a function that has no double counterpart
  StraightLineProgram(const std::vector<GiNaC::ex>& outputs, const InputGroups& inputs,
                      const std::vector<Constant>& constants);

  /// Computes all outputs. No allocation.
  /// @tparam Number    double, or Interval
  /// @param inputs     one pointer per input group; the pointer of an empty group is not read
  /// @param outputs    where output k goes: outputs[k], or outputs[positions[k]]; may not overlap the inputs
  /// @param positions  n_outputs() of them, or null
  template <class Number>
  void evaluate(std::span<const std::type_identity_t<Number>* const> inputs, Number* outputs,
                const int* positions = nullptr) const;

  /// Other values of the constants that may change. What depends on nothing else is computed here, once, so that
  /// evaluate() takes the steps of a program into which they are folded: its outputs are those of one, but for the sign
  /// of a zero. No allocation.
  /// @param values  in the order of the constructor's list, without those that may not change
  void set_constants(std::span<const double> values);

  int n_outputs() const { return static_cast<int>(outputs_.size()); }  ///< Expressions.
  int n_operations() const { return static_cast<int>(code_.size()); }  ///< That evaluate() takes.

  /// True when no output depends on an input: one evaluation holds for ever.
  bool is_constant() const { return constant_; }
  /// Writes the `outputs`, n_outputs() of them, if is_constant().
  void constant_outputs(double* outputs) const;

 private:
  friend class ProgramBuilder;

  enum class Op : std::uint8_t {
    add,
    sub,
    mul,
    div,
    neg,
    sqrt,
    pow,
    sin,
    cos,
    tan,
    asin,
    acos,
    atan,
    atan2,
    exp,
    log,
    sinh,
    cosh,
    tanh,
    abs,
    sign,
    choose
  };
  /// The result goes to the next register. @param third  of choose alone: left > 0 ? right : third
  struct Instruction {
    Op op;
    std::int32_t left, right, third;
  };
  template <class Number>
  static Number apply(Op op, const Number& x, const Number& y);
  /// Results one after the other, from `next` on. @param r  registers
  template <class Number>
  static void run(const std::vector<Instruction>& code, const Number* r, Number* next);

  // Registers: constants first, then inputs, then one per instruction of `code_`. Of the constants the first may change,
  // the next are results of `preparation_`, and the others are numbers.
  std::vector<double> constants_;
  std::vector<Instruction> preparation_;
  std::int32_t n_changing_ = 0;
  std::vector<Instruction> code_;
  std::vector<std::int32_t> outputs_;
  std::vector<std::int32_t> group_sizes_;
  std::int32_t n_inputs_ = 0;
  bool constant_ = true;
};

}  // namespace ricochet
