#include "methods/complementarity/mpcc/static_ldl.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

namespace ricochet {

namespace {

/// A pivot is only rounding if it is smaller than this, relative to the terms that it is the sum of.
constexpr double kSingular = 1e-14;
/// Added to the curvature of an unknown in a matrix whose rows have largest entries near 1, to compare unknowns.
constexpr double kLeastCurvature = 1e-8;
/// After new pairs did not help, this many failures pass before the next attempt: a degenerate program has a singular
/// matrix in every iteration, and pairs take the time of five factorisations.
constexpr int kPatience = 20;
constexpr int kScalingSweeps = 5;
/// Refinement ends at this residual, or where a step does not halve it. Ipopt refines again, at least once.
constexpr double kResidual = 1e-12;
constexpr int kMaxRefinements = 10;

double largest_of(const Vector& v) {
  return v.lpNorm<Eigen::Infinity>();
}

}  // namespace

StaticLdl::StaticLdl(int n, int n_rows, int n_entries, const int* rows, const int* columns)
    : n_(n), n_rows_(n_rows), given_rows_(rows, rows + n_entries), given_columns_(columns, columns + n_entries) {
  if (n_rows < 0 || n_rows > n) throw std::logic_error("StaticLdl: more rows than unknowns");
  for (auto* list : {&given_rows_, &given_columns_})
    for (int& index : *list) --index;
}

/// Partner of each unknown: of a row the unknown that it is paired with and the other way round, or -1. Slacks, which
/// belong to one row only, are paired first. Then rows take unknowns of large entries, and smaller ones if they have to.
std::vector<int> StaticLdl::match(const std::vector<double>& values, bool by_size) const {
  const int n_primal = n_ - n_rows_, n_entries = static_cast<int>(given_rows_.size());
  struct Edge {
    int unknown;
    double size;        // of the entry, relative to the largest one of its row
    double preference;  // an unknown without a curvature of its own has no other pivot
  };
  std::vector<int> degree(n_primal, 0);
  std::vector<std::vector<Edge>> edges(n_rows_);
  for (int e = 0; e < n_entries; ++e) {
    const int row = std::max(given_rows_[e], given_columns_[e]), unknown = std::min(given_rows_[e], given_columns_[e]);
    if (row != unknown && unknown < n_primal) ++degree[unknown];
    if (row != unknown && row < n_primal) ++degree[row];
    if (row >= n_primal && unknown < n_primal) edges[row - n_primal].push_back({unknown, std::abs(values[e]), 0});
  }
  std::vector<int> partner(n_, -1);
  const auto pair = [&](int row, int unknown) {
    partner[row] = unknown;
    partner[unknown] = row;
  };
  for (int row = n_primal; row < n_; ++row) {
    std::vector<Edge>& own = edges[row - n_primal];
    double largest = 0;
    for (const Edge& edge : own) largest = std::max(largest, edge.size);
    for (Edge& edge : own) {
      edge.preference = by_size ? edge.size : edge.size / (kLeastCurvature + least_diagonal_[edge.unknown]);
      edge.size = largest > 0 ? edge.size / largest : 0;
      if (degree[edge.unknown] == 1 && edge.size > 0 && partner[row] < 0) pair(row, edge.unknown);
    }
    std::ranges::stable_sort(own, std::greater{}, &Edge::preference);
  }
  // A row takes a free unknown, or one whose row finds another: an augmenting path, depth first. Unknowns of a search
  // without success lead nowhere later, either.
  std::vector<char> is_visited(n_primal);
  std::vector<int> visited;
  struct Visit {
    int row;
    std::size_t next;
  };
  std::vector<Visit> path;
  const auto find_path = [&](int row, double least) {
    path.assign(1, {row, 0});
    while (!path.empty()) {
      Visit& visit = path.back();
      const std::vector<Edge>& own = edges[visit.row - n_primal];
      if (visit.next == 0) {
        const auto is_free = [&](const Edge& edge) { return edge.size >= least && partner[edge.unknown] < 0; };
        const auto free = std::ranges::find_if(own, is_free);
        visit.next = static_cast<std::size_t>(free - own.begin()) + 1;
        if (free != own.end()) return true;
        visit.next = 0;
      }
      while (visit.next < own.size() && (own[visit.next].size < least || is_visited[own[visit.next].unknown]))
        ++visit.next;
      if (visit.next == own.size()) {
        path.pop_back();
        continue;
      }
      const int unknown = own[visit.next++].unknown;
      is_visited[unknown] = true;
      visited.push_back(unknown);
      path.push_back({partner[unknown], 0});
    }
    return false;
  };
  for (const double least : {1e-1, 1e-3, 1e-6, 1e-9}) {
    std::ranges::fill(is_visited, 0);
    for (int row = n_primal; row < n_; ++row) {
      if (partner[row] >= 0) continue;
      visited.clear();
      if (!find_path(row, least)) continue;
      for (auto step = path.rbegin(); step != path.rend(); ++step)
        pair(step->row, edges[step->row - n_primal][step->next - 1].unknown);
      for (const int unknown : visited) is_visited[unknown] = false;
    }
  }
  return partner;
}

/// Nodes in the order of AMD of their graph. A single unknown without a curvature of its own gets one from its neighbours,
/// and follows the last of them at once: at the end of the order, all of them would be neighbours of each other.
void StaticLdl::order(const std::vector<int>& partner) {
  std::vector<int> node_of(n_, -1);
  std::vector<std::pair<int, int>> members;
  for (int i = 0; i < n_; ++i) {
    if (node_of[i] >= 0) continue;
    node_of[i] = static_cast<int>(members.size());
    if (partner[i] >= 0) node_of[partner[i]] = node_of[i];
    members.emplace_back(i, partner[i]);
  }
  const int n_nodes = static_cast<int>(members.size());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(2 * given_rows_.size() + n_nodes);
  for (int i = 0; i < n_nodes; ++i) entries.emplace_back(i, i, 1.0);
  for (std::size_t e = 0; e < given_rows_.size(); ++e) {
    const int a = node_of[given_rows_[e]], b = node_of[given_columns_[e]];
    entries.emplace_back(a, b, 1.0);
    entries.emplace_back(b, a, 1.0);
  }
  Eigen::SparseMatrix<double> graph(n_nodes, n_nodes);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(graph, permutation);

  nodes_.assign(n_nodes, {});
  position_.resize(n_);
  std::vector<int> n_before(n_nodes, 0);  // neighbours that a node waits for
  using Neighbours = Eigen::SparseMatrix<double>::InnerIterator;
  for (int k = 0; k < n_nodes; ++k) {
    const auto [first, second] = members[k];
    if (second >= 0 || least_diagonal_[first] > 0) continue;
    for (Neighbours other(graph, k); other; ++other) n_before[k] += other.row() != k;
  }
  std::vector<int> sequence, ready;
  std::vector<char> is_waiting(n_nodes, false);
  for (const int next : permutation.indices()) {
    is_waiting[next] = true;
    if (n_before[next] <= 0) ready.push_back(next);
    while (!ready.empty()) {
      const int node = ready.back();
      ready.pop_back();
      is_waiting[node] = false;
      sequence.push_back(node);
      for (Neighbours other(graph, node); other; ++other)
        if (--n_before[other.row()] == 0 && is_waiting[other.row()]) ready.push_back(static_cast<int>(other.row()));
    }
  }
  // Neighbours that wait for each other.
  std::ranges::copy_if(permutation.indices(), std::back_inserter(sequence), [&](int node) { return is_waiting[node]; });
  int next = 0;
  for (int k = 0; k < n_nodes; ++k) {
    const auto [first, second] = members[sequence[k]];
    nodes_[k].first = next;
    nodes_[k].size = second >= 0 ? 2 : 1;
    position_[first] = next++;
    if (second >= 0) position_[second] = next++;
  }
}

/// S K S with a diagonal S, whose rows have largest entries near 1: powers of the largest entries, alternately.
std::vector<double> StaticLdl::equilibrated(const double* values) const {
  std::vector<double> scaled(values, values + given_rows_.size());
  Vector largest(n_);
  for (int sweep = 0; sweep < kScalingSweeps; ++sweep) {
    largest.setZero();
    for (std::size_t e = 0; e < scaled.size(); ++e)
      for (const int i : {given_rows_[e], given_columns_[e]}) largest[i] = std::max(largest[i], std::abs(scaled[e]));
    for (double& value : largest) value = value > 0 ? 1 / std::sqrt(value) : 1;
    for (std::size_t e = 0; e < scaled.size(); ++e) scaled[e] *= largest[given_rows_[e]] * largest[given_columns_[e]];
  }
  return scaled;
}

/// Order, and the structure of L.
void StaticLdl::prepare(const double* values, bool by_size) {
  const std::vector<double> scaled = equilibrated(values);
  std::vector<double> diagonal(n_, 0.0);
  for (std::size_t e = 0; e < scaled.size(); ++e)
    if (given_rows_[e] == given_columns_[e]) diagonal[given_rows_[e]] += scaled[e];
  least_diagonal_.resize(n_, std::numeric_limits<double>::infinity());
  for (int i = 0; i < n_; ++i) least_diagonal_[i] = std::min(least_diagonal_[i], std::abs(diagonal[i]));
  order(match(scaled, by_size));
  const int n_nodes = static_cast<int>(nodes_.size());
  std::vector<int> node_at(n_);
  for (int k = 0; k < n_nodes; ++k)
    for (int i = 0; i < nodes_[k].size; ++i) node_at[nodes_[k].first + i] = k;

  std::vector<std::vector<int>> columns(n_);
  const auto place = [&](std::size_t e) {
    const int a = position_[given_rows_[e]], b = position_[given_columns_[e]];
    return std::pair(std::min(a, b), std::max(a, b));
  };
  for (int k = 0; k < n_; ++k) columns[k].push_back(k);
  for (std::size_t e = 0; e < given_rows_.size(); ++e) {
    const auto [row, column] = place(e);
    columns[column].push_back(row);
  }
  upper_start_.assign(1, 0);
  upper_row_.clear();
  for (auto& column : columns) {
    std::ranges::sort(column);
    column.erase(std::unique(column.begin(), column.end()), column.end());
    upper_row_.insert(upper_row_.end(), column.begin(), column.end());
    upper_start_.push_back(static_cast<int>(upper_row_.size()));
  }
  upper_.resize(upper_row_.size());
  entry_.resize(given_rows_.size());
  for (std::size_t e = 0; e < entry_.size(); ++e) {
    const auto [row, column] = place(e);
    const auto begin = upper_row_.begin() + upper_start_[column], end = upper_row_.begin() + upper_start_[column + 1];
    entry_[e] = static_cast<int>(std::lower_bound(begin, end, row) - upper_row_.begin());
  }

  // Elimination tree of the nodes, and the pattern of each row of L.
  std::vector<int> parent(n_nodes, -1), mark(n_nodes, -1), n_rows(n_nodes, 0), path, row;
  pattern_start_.assign(1, 0);
  pattern_.clear();
  for (int k = 0; k < n_nodes; ++k) {
    mark[k] = k;
    row.clear();  // from its end
    const int first = nodes_[k].first;
    for (int p = upper_start_[first]; p < upper_start_[first + nodes_[k].size]; ++p) {
      path.clear();
      for (int i = node_at[upper_row_[p]]; mark[i] != k; i = parent[i]) {
        if (parent[i] == -1) parent[i] = k;
        mark[i] = k;
        path.push_back(i);
        n_rows[i] += nodes_[k].size;
      }
      row.insert(row.end(), path.begin(), path.end());
      std::rotate(row.begin(), row.end() - static_cast<std::ptrdiff_t>(path.size()), row.end());
    }
    pattern_.insert(pattern_.end(), row.begin(), row.end());
    pattern_start_.push_back(static_cast<int>(pattern_.size()));
  }
  int rows = 0, n_values = 0;
  for (int k = 0; k < n_nodes; ++k) {
    nodes_[k].rows = rows;
    nodes_[k].values = n_values;
    rows += n_rows[k];
    n_values += n_rows[k] * nodes_[k].size;
  }
  L_row_.resize(rows);
  L_.resize(n_values);
  row_.assign(2 * static_cast<std::size_t>(n_), 0.0);
  is_prepared_ = true;
}

/// Subtracts a column of L from the row that is being made, and appends the row to the column.
template <int columns, int rows>
void StaticLdl::eliminate(Node& column, Node& row) {
  using Values = Eigen::Array<double, rows, 1>;
  Values y[2] = {Values::Zero(), Values::Zero()};  // per column
  for (int c = 0; c < columns; ++c) {
    Eigen::Map<Values> values(row_.data() + 2 * (column.first + c));
    y[c] = values;
    values.setZero();
  }
  const int* L_row = L_row_.data() + column.rows;
  double* L = L_.data() + column.values;
  for (int p = 0; p < column.filled; ++p) {
    Eigen::Map<Values> target(row_.data() + 2 * L_row[p]);
    if constexpr (columns == 2)
      target -= L[2 * p] * y[0] + L[2 * p + 1] * y[1];
    else
      target -= L[p] * y[0];
  }
  double l[2][2] = {};  // [row][column]
  for (int r = 0; r < rows; ++r) {
    if constexpr (columns == 1) {
      l[r][0] = y[0][r] * column.i_d;
    } else {
      l[r][0] = y[0][r] * column.i_d + y[1][r] * column.i_e;
      l[r][1] = y[0][r] * column.i_e + y[1][r] * column.i_f;
    }
    L_row_[column.rows + column.filled] = row.first + r;
    for (int c = 0; c < columns; ++c) L[column.filled * columns + c] = l[r][c];
    ++column.filled;
  }
  for (int c = 0; c < columns; ++c) {
    row.d -= l[0][c] * y[c][0];
    if constexpr (rows == 2) {
      row.e -= l[1][c] * y[c][0];
      row.f -= l[1][c] * y[c][1];
    }
  }
}

/// Inverse and signs of a pivot. @param magnitude  of the terms of its entries
bool StaticLdl::invert(Node& node, double magnitude) {
  if (node.size == 1) {
    if (!(std::abs(node.d) > kSingular * magnitude) || !std::isfinite(node.d)) return false;
    node.i_d = 1 / node.d;
    n_negative_ += node.d < 0;
    return true;
  }
  const double determinant = node.d * node.f - node.e * node.e;
  if (!(std::abs(determinant) > kSingular * (std::abs(node.d * node.f) + node.e * node.e)) ||
      !std::isfinite(determinant))
    return false;
  node.i_d = node.f / determinant;
  node.i_e = -node.e / determinant;
  node.i_f = node.d / determinant;
  n_negative_ += determinant < 0 ? 1 : (node.d < 0 ? 2 : 0);
  return true;
}

bool StaticLdl::factorise(const double* values, bool with_new_pairs) {
  if (!std::all_of(values, values + given_rows_.size(), [](double value) { return std::isfinite(value); }))
    return false;
  if (is_prepared_ && !with_new_pairs && factorise_in_order(values)) return true;
  if (++n_singular_ % kPatience != 1 && !with_new_pairs) return false;
  for (const bool by_size : {false, true}) {
    prepare(values, by_size);
    if (!factorise_in_order(values)) continue;
    n_singular_ = 0;
    return true;
  }
  return false;
}

bool StaticLdl::factorise_in_order(const double* values) {
  std::ranges::fill(upper_, 0.0);
  for (std::size_t e = 0; e < entry_.size(); ++e) upper_[entry_[e]] += values[e];
  std::ranges::fill(row_, 0.0);
  for (Node& node : nodes_) node.filled = 0;
  n_negative_ = 0;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    Node& node = nodes_[k];
    node.d = node.e = node.f = 0;
    for (int r = 0; r < node.size; ++r) {
      const int column = node.first + r;
      for (int p = upper_start_[column]; p < upper_start_[column + 1]; ++p) {
        const int i = upper_row_[p];
        if (i < node.first)
          row_[2 * i + r] = upper_[p];
        else if (r == 0)
          node.d = upper_[p];
        else
          (i == column ? node.f : node.e) = upper_[p];
      }
    }
    double magnitude = std::abs(node.d);
    for (int q = pattern_start_[k]; q < pattern_start_[k + 1]; ++q) {
      Node& column = nodes_[pattern_[q]];
      if (node.size == 1)
        column.size == 1 ? eliminate<1, 1>(column, node) : eliminate<2, 1>(column, node);
      else
        column.size == 1 ? eliminate<1, 2>(column, node) : eliminate<2, 2>(column, node);
      magnitude = std::max(magnitude, std::abs(node.d));
    }
    if (!invert(node, magnitude)) return false;
  }
  return true;
}

void StaticLdl::substitute(Vector& x) const {
  for (const Node& node : nodes_) {
    const double x_0 = x[node.first], x_1 = node.size == 2 ? x[node.first + 1] : 0;
    const int* row = L_row_.data() + node.rows;
    const double* L = L_.data() + node.values;
    if (node.size == 1)
      for (int p = 0; p < node.filled; ++p) x[row[p]] -= L[p] * x_0;
    else
      for (int p = 0; p < node.filled; ++p) x[row[p]] -= L[2 * p] * x_0 + L[2 * p + 1] * x_1;
  }
  for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
    const int* row = L_row_.data() + node->rows;
    const double* L = L_.data() + node->values;
    if (node->size == 1) {
      double value = x[node->first] * node->i_d;
      for (int p = 0; p < node->filled; ++p) value -= L[p] * x[row[p]];
      x[node->first] = value;
    } else {
      const double x_0 = x[node->first], x_1 = x[node->first + 1];
      double y_0 = node->i_d * x_0 + node->i_e * x_1, y_1 = node->i_e * x_0 + node->i_f * x_1;
      for (int p = 0; p < node->filled; ++p) {
        y_0 -= L[2 * p] * x[row[p]];
        y_1 -= L[2 * p + 1] * x[row[p]];
      }
      x[node->first] = y_0;
      x[node->first + 1] = y_1;
    }
  }
}

void StaticLdl::multiply(const Vector& x, Vector& y) const {
  y.setZero(n_);
  for (int k = 0; k < n_; ++k) {
    const int diagonal = upper_start_[k + 1] - 1;
    double sum = upper_[diagonal] * x[k];
    for (int p = upper_start_[k]; p < diagonal; ++p) {
      const int i = upper_row_[p];
      sum += upper_[p] * x[i];
      y[i] += upper_[p] * x[k];
    }
    y[k] += sum;
  }
}

/// x_ and best_ with K x = b_. @return the residual of best_
double StaticLdl::refine() {
  const double b_size = largest_of(b_);
  x_ = best_ = b_;
  if (b_size == 0) return 0;
  substitute(x_);
  double best = std::numeric_limits<double>::infinity();
  for (int step = 0;; ++step) {
    multiply(x_, residual_);
    residual_ = b_ - residual_;
    const double size = largest_of(residual_) / (b_size + std::min(largest_of(x_), 1e6 * b_size));
    const bool improves = size < best, halves = size < 0.5 * best;
    if (improves) best_ = x_;
    if (improves) best = size;
    if (best <= kResidual || !halves || step == kMaxRefinements) return best;
    substitute(residual_);
    x_ += residual_;
  }
}

double StaticLdl::solve(double* b) {
  b_.resize(n_);
  for (int i = 0; i < n_; ++i) b_[position_[i]] = b[i];
  const double residual = refine();
  for (int i = 0; i < n_; ++i) b[i] = best_[position_[i]];
  return residual;
}

}  // namespace ricochet
