#pragma once

#include <initializer_list>
#include <vector>

#include "problems/derivatives/tape.h"

namespace ricochet {

/// A tape for the entries of a dense array that are not identically zero. Entries that never change are computed once.
class SparseTape {
 public:
  SparseTape() = default;
  /// @param dense  the array, column-major when it is a matrix
  SparseTape(const std::vector<GiNaC::ex>& dense, const Tape::InputGroups& inputs,
             const std::vector<Tape::Constant>& constants);

  /// Writes the whole array, zeros too. @param inputs  as of Tape::evaluate()
  void evaluate(std::initializer_list<const double*> inputs, double* dense) const;

  /// True when no entry depends on an input.
  bool is_constant() const { return tape_.is_constant(); }
  int size() const { return size_; }  ///< of the array
  /// Where the entries of the tape stand in the array.
  const std::vector<int>& positions() const { return positions_; }

 private:
  Tape tape_;
  std::vector<int> positions_;
  std::vector<double> constants_;  // the entries, when they never change
  int size_ = 0;                   // of the array
};

}  // namespace ricochet
