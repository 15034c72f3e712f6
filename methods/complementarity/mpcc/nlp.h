#pragma once

#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "problems/problem.h"

namespace ricochet {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A smooth function of a few variables of a nonlinear program: one term of its objective, or some of its rows.
/// Both lists below are in the program's numbering; x and everything else that the functions see is local, in the
/// order of the lists.
class NlpBlock {
 public:
  virtual ~NlpBlock() = default;

  std::vector<int> variables;
  std::vector<int> rows;  ///< empty for a term of the objective

  /// Whether derivatives vanish on some pieces of the function only: all its entries then belong to the structure.
  virtual bool is_piecewise() const { return false; }

  /// Outputs: rows.size() constraint values, or 1 objective term.
  int n_outputs() const { return rows.empty() ? 1 : static_cast<int>(rows.size()); }

  /// @param x  variables.size(); @param values  n_outputs
  virtual void evaluate(const double* x, double* values) const = 0;
  /// @param J  n_outputs x variables.size(), column-major, zero on entry
  virtual void jacobian(const double* x, double* J) const = 0;
  /// Hessian of sum_r weights[r] values[r]. @param H  variables.size() squared, symmetric, zero on entry
  virtual void hessian(const double* x, const double* weights, double* H) const = 0;
};

/// Nonlinear program whose functions are sums of blocks,
///
///   min sum of objective blocks   subject to   g_L <= g(x) <= g_U,   x_L <= x <= x_U,                       (1)
///
/// where a row of g is the sum of the outputs of the blocks that list it. Structure is known per block, so Jacobian and
/// Hessian are assembled by structure, exact and sparse.
struct Nlp {
  struct Variable {
    double lower = -kInfinity, upper = kInfinity;
    double guess = 0;
    std::string name;
  };
  struct Row {
    double lower = 0, upper = 0;
    std::string name;
  };

  std::vector<Variable> variables;
  std::vector<Row> rows;
  std::vector<std::unique_ptr<NlpBlock>> blocks;

  int n_variables() const { return static_cast<int>(variables.size()); }
  int n_rows() const { return static_cast<int>(rows.size()); }

  /// @return its number
  int add_variable(double lower, double upper, double guess, std::string name) {
    variables.push_back({lower, upper, guess, std::move(name)});
    return n_variables() - 1;
  }
  int add_row(double lower, double upper, std::string name) {
    rows.push_back({lower, upper, std::move(name)});
    return n_rows() - 1;
  }
  void add_block(std::unique_ptr<NlpBlock> block) { blocks.push_back(std::move(block)); }
};

/// Nonlinear program with complementarity constraints: (1), and for every pair
///
///   0 <= G  _|_  H >= 0,   G, H: sums of variables that have the lower bound 0.                              (2)
struct Mpcc {
  struct Pair {
    std::vector<int> G, H;  ///< variables to sum; one each in the sparse form, several when aggregated
    std::string name;
    double bias = 1;  ///< G is taken for the zero side of a nearly complementary pair where G <= bias H
  };

  Nlp nlp;
  std::vector<Pair> pairs;

  void add_pair(std::vector<int> G, std::vector<int> H, std::string name, double bias = 1) {
    pairs.push_back({std::move(G), std::move(H), std::move(name), bias});
  }
};

}  // namespace ricochet
