#pragma once

#include <initializer_list>
#include <vector>

#include "problems/derivatives/straight_line_program.h"

namespace ricochet {

/// A program for the entries of a dense array that are not identically zero. Entries that never change are computed
/// once.
class SparseProgram {
 public:
  SparseProgram() = default;
  /// @param dense  the array, column-major when it is a matrix
  SparseProgram(const std::vector<GiNaC::ex>& dense, const StraightLineProgram::InputGroups& inputs,
                const std::vector<StraightLineProgram::Constant>& constants);

  /// Writes the whole array, zeros too. @param inputs  as of StraightLineProgram::evaluate()
  void evaluate(std::initializer_list<const double*> inputs, double* dense) const;

  /// As of StraightLineProgram.
  void set_constants(std::span<const double> values);

  /// True when no entry depends on an input.
  bool is_constant() const { return program_.is_constant(); }
  int size() const { return size_; }  ///< of the array
  /// Where the entries of the program stand in the array.
  const std::vector<int>& positions() const { return positions_; }

 private:
  StraightLineProgram program_;
  std::vector<int> positions_;
  std::vector<double> constants_;  // the entries, when they never change
  int size_ = 0;                   // of the array
};

}  // namespace ricochet
