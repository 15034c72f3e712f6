#include "methods/runge_kutta/order_conditions.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

/// Data of a subtree for the order conditions of larger trees.
struct Subtree {
  int nodes;
  double density;  // gamma(t)
  Vector factor;   // sum_j a_ij Phi_j(t)
};

/// Visits all ways to hang trees with `nodes` nodes in total below a root: visit(prod gamma(t_k), Phi). Subtrees are
/// taken in the order of the list, so that each tree is met once.
template <class Visit>
void for_each_tree(const std::vector<Subtree>& subtrees, std::size_t first, int nodes, double density,
                   const Vector& weights, const Visit& visit) {
  if (nodes == 0) return visit(density, weights);
  for (std::size_t k = first; k < subtrees.size() && subtrees[k].nodes <= nodes; ++k) {
    for_each_tree(subtrees, k, nodes - subtrees[k].nodes, density * subtrees[k].density,
                  weights.cwiseProduct(subtrees[k].factor), visit);
  }
}

}  // namespace

std::vector<OrderConditions> order_conditions(const Matrix& A, const Vector& b, int max_nodes, double stop_beyond) {
  std::vector<Subtree> subtrees;  // sorted by nodes
  std::vector<OrderConditions> result;
  for (int nodes = 1; nodes <= max_nodes; ++nodes) {
    std::vector<Subtree> fresh;
    OrderConditions conditions;
    for_each_tree(subtrees, 0, nodes - 1, 1.0, Vector::Ones(b.size()), [&](double product, const Vector& Phi) {
      const double gamma = nodes * product;  // (2)
      ++conditions.count;
      conditions.residual = std::max(conditions.residual, std::abs(b.dot(Phi) - 1 / gamma));  // (4)
      if (nodes < max_nodes) fresh.push_back({nodes, gamma, A * Phi});                        // (3)
    });
    result.push_back(conditions);
    if (conditions.residual > stop_beyond) break;
    subtrees.insert(subtrees.end(), fresh.begin(), fresh.end());
  }
  return result;
}

int order_from_trees(const Matrix& A, const Vector& b, int limit, double tolerance) {
  const auto conditions = order_conditions(A, b, limit, tolerance);
  const auto broken = std::find_if(conditions.begin(), conditions.end(),
                                   [&](const OrderConditions& c) { return c.residual > tolerance; });
  return static_cast<int>(broken - conditions.begin());
}

}  // namespace ricochet
