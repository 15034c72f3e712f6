#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "methods/complementarity/mpcc/nlp.h"

namespace ricochet {

/// Positions of the nonzeros of a sparse matrix, in the order in which its values are stored.
struct SparsityPattern {
  std::vector<int> rows, columns;
  int size() const { return static_cast<int>(rows.size()); }
};

/// A residual, and the row, bound or pair that it belongs to.
struct NamedResidual {
  double value = 0;
  std::string name;
};

/// Evaluates the functions of an `Nlp` and their derivatives, assembled from the blocks: Jacobian G of the rows, and
/// lower triangle of the Hessian of the Lagrangian
///
///   W(x, w, lambda) = w f''(x) + sum_i lambda_i g_i''(x).                                                    (1)
///
/// The structure is found once. Blocks state dense matrices; an entry that vanishes at several random points is a
/// structural zero, since an analytic function that vanishes there vanishes everywhere. A block therefore declares no
/// structure, and its unused variables cost no fill-in. Blocks for which this does not hold must return true from
/// is_piecewise(). Entries of several blocks at one position are summed.
class NlpEvaluator {
 public:
  /// @param nlp  must outlive the evaluator; its bounds may change, its blocks may not
  explicit NlpEvaluator(const Nlp& nlp);

  const Nlp& nlp() const { return nlp_; }
  const SparsityPattern& jacobian_pattern() const { return jacobian_pattern_; }
  const SparsityPattern& hessian_pattern() const { return hessian_pattern_; }

  // @param x  n_variables. The derivatives throw std::logic_error for a nonzero outside of the structure.
  double objective(const double* x);
  /// @param g  n_rows
  void constraints(const double* x, double* g);
  /// @param gradient  n_variables
  void gradient(const double* x, double* gradient);
  /// @param values  jacobian_pattern().size()
  void jacobian(const double* x, double* values);
  /// @param lambda  n_rows, @param values  hessian_pattern().size()
  void hessian(const double* x, double objective_weight, const double* lambda, double* values);

  /// Largest violation of a row or a variable's bound at x; 0 without a name when there is none.
  NamedResidual worst_violation(const double* x);

  /// Work since construction.
  struct Work {
    std::int64_t objectives = 0, constraints = 0, gradients = 0, jacobians = 0, hessians = 0;
    double seconds = 0;             ///< in all evaluations
    double derivative_seconds = 0;  ///< in gradients, Jacobians and Hessians

    Work& operator+=(const Work& other);
  };
  const Work& work() const { return work_; }

 private:
  /// An entry of a block's dense matrix, and the position of its value in the assembled one.
  struct Entry {
    int local, global;
  };
  struct BlockStructure {
    std::vector<Entry> jacobian, hessian;
  };

  void find_structure();
  const double* gather(const NlpBlock& block, const double* x);
  /// Adds the entries of matrix_ to values.
  void scatter(const NlpBlock& block, const std::vector<Entry>& entries, bool is_hessian, double* values) const;

  const Nlp& nlp_;
  std::vector<BlockStructure> structures_;  // of each block
  SparsityPattern jacobian_pattern_, hessian_pattern_;
  Work work_;
  std::vector<double> x_, outputs_, matrix_;  // of one block
};

}  // namespace ricochet
