#pragma once

#include <initializer_list>
#include <vector>

#include "problems/derivatives/straight_line_program.h"

/// @file
/// SparseProgram, a program for an array with many zeros.

namespace ricochet {

/// A program for the entries of a dense array that are not identically zero. Entries that never change are computed
/// once.
class SparseProgram {
 public:
  SparseProgram() = default;  ///< Without entries.
  /// @param dense      the array, column-major when it is a matrix
  /// @param inputs     groups of symbols, for example {q, v, u}
  /// @param constants  every other symbol that occurs
  /// @throws InputError as StraightLineProgram's constructor
  SparseProgram(const std::vector<GiNaC::ex>& dense, const StraightLineProgram::InputGroups& inputs,
                const std::vector<StraightLineProgram::Constant>& constants);

  /// Writes the whole array to `dense`, including zeros; `inputs` as in StraightLineProgram::evaluate().
  void evaluate(std::initializer_list<const double*> inputs, double* dense) const { evaluate_in(inputs, dense); }
  /// Bounds of the array over a box of inputs.
  void evaluate(std::initializer_list<const Interval*> inputs, Interval* dense) const { evaluate_in(inputs, dense); }

  /// As StraightLineProgram::set_constants(), with these `values`.
  void set_constants(std::span<const double> values);

  /// True when no entry depends on an input.
  bool is_constant() const { return program_.is_constant(); }
  int size() const { return size_; }  ///< Size of the array, including zeros.
  /// Positions of the entries of the program in the array.
  const std::vector<int>& positions() const { return positions_; }

 private:
  template <class Number>
  void evaluate_in(std::initializer_list<const Number*> inputs, Number* dense) const;

  StraightLineProgram program_;
  std::vector<int> positions_;
  std::vector<double> constants_;  // the entries, if they never change
  int size_ = 0;                   // of the array
};

}  // namespace ricochet
