#pragma once

#include <ginac/ginac.h>

#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "problems/interval.h"

/// @file
/// StraightLineProgram, a fast evaluation of symbolic expressions.

namespace ricochet {

/// Straight-line program for a list of symbolic expressions. It is made once and can be evaluated with doubles, for
/// values, or with intervals, for bounds over a box of inputs. Its constants are doubles in both cases.
///
/// GiNaC computes derivatives; a StraightLineProgram evaluates them fast and repeatably. Equal subexpressions are
/// computed once, numbers are folded, and the order of operands depends only on their structure. GiNaC's own order
/// depends on memory addresses and would change the last bit from run to run.
class StraightLineProgram {
 public:
  /// A symbol with a number as its value. If it `may_change`, set_constants() changes the number; else it is folded.
  struct Constant {
    GiNaC::symbol symbol;     ///< as it occurs in the expressions
    double value;             ///< its value
    bool may_change = false;  ///< set_constants() gives it other values
  };
  /// Symbols that are arguments, in groups with a pointer each.
  using InputGroups = std::vector<std::vector<GiNaC::symbol>>;

  StraightLineProgram() = default;  ///< Without outputs.

  /// @param outputs    expressions, in the order in which evaluate() writes them
  /// @param inputs     groups of symbols, for example {q, v, u}
  /// @param constants  every other symbol that occurs
  /// @throws InputError for a symbol without value, a complex number or a function that has no double counterpart
  StraightLineProgram(const std::vector<GiNaC::ex>& outputs, const InputGroups& inputs,
                      const std::vector<Constant>& constants);

  /// Computes all outputs. No allocation.
  /// @tparam Number    double, or Interval
  /// @param inputs     one pointer per input group; the pointer of an empty group is not read
  /// @param outputs    output k is written to outputs[k], or outputs[positions[k]]; must not overlap the inputs
  /// @param positions  n_outputs() of them, or null
  template <class Number>
  void evaluate(std::span<const std::type_identity_t<Number>* const> inputs, Number* outputs,
                const int* positions = nullptr) const;

  /// Sets the constants that may change. Operations that depend only on constants are executed here, once. evaluate()
  /// then executes the same operations as a program with folded constants, with the same results up to the sign of
  /// zeros. No allocation.
  /// @param values  in the order of the constructor's list, without those that must not change
  void set_constants(std::span<const double> values);

  int n_outputs() const { return static_cast<int>(outputs_.size()); }  ///< Number of expressions.
  int n_operations() const { return static_cast<int>(code_.size()); }  ///< Operations of evaluate().

  /// Whether no output depends on an input.
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
  /// The result is written to the next register. @param third  for choose only: left > 0 ? right : third
  struct Instruction {
    Op op;
    std::int32_t left, right, third;
  };
  template <class Number>
  static Number apply(Op op, const Number& x, const Number& y);
  /// Writes the results to consecutive registers, from `next`. @param r  registers
  template <class Number>
  static void run(const std::vector<Instruction>& code, const Number* r, Number* next);

  // Registers: constants first, then inputs, then one per instruction of `code_`. Of the constants the first may
  // change, the next are results of `preparation_`, and the others are numbers.
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
