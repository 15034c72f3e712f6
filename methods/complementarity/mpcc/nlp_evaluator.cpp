#include "methods/complementarity/mpcc/nlp_evaluator.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <stdexcept>
#include <utility>

namespace ricochet {

namespace {

constexpr int kProbes = 3;

/// Adds the time of its life to `seconds`.
class Stopwatch {
 public:
  explicit Stopwatch(double& seconds, double* also = nullptr) : seconds_(seconds), also_(also) {}
  ~Stopwatch() {
    const double elapsed = std::chrono::duration<double>(Clock::now() - begin_).count();
    seconds_ += elapsed;
    if (also_) *also_ += elapsed;
  }

 private:
  using Clock = std::chrono::steady_clock;
  double& seconds_;
  double* also_;
  Clock::time_point begin_ = Clock::now();
};

/// A point around the guess, at its scale. Bounds do not matter: they may change, and what is undefined beyond them is
/// not a number, hence not zero.
std::vector<double> random_point(const Nlp& nlp, std::mt19937& generator) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> x;
  x.reserve(nlp.variables.size());
  for (const auto& variable : nlp.variables)
    x.push_back(variable.guess + uniform(generator) * std::max(1.0, std::abs(variable.guess)));
  return x;
}

std::string name_of(const Nlp& nlp, const NlpBlock& block) {
  return block.rows.empty() ? "the objective" : "row '" + nlp.rows[block.rows[0]].name + "'";
}

/// Numbers positions of a matrix by column, then row.
class PatternBuilder {
 public:
  void add(int row, int column) { positions_.push_back({column, row}); }
  SparsityPattern build() {
    std::ranges::sort(positions_);
    positions_.erase(std::unique(positions_.begin(), positions_.end()), positions_.end());
    SparsityPattern pattern;
    for (const auto& [column, row] : positions_) {
      pattern.rows.push_back(row);
      pattern.columns.push_back(column);
    }
    return pattern;
  }
  int index(int row, int column) const {
    return static_cast<int>(std::ranges::lower_bound(positions_, std::pair{column, row}) - positions_.begin());
  }

 private:
  std::vector<std::pair<int, int>> positions_;  // column, row
};

}  // namespace

NlpEvaluator::Work& NlpEvaluator::Work::operator+=(const Work& other) {
  objectives += other.objectives;
  constraints += other.constraints;
  gradients += other.gradients;
  jacobians += other.jacobians;
  hessians += other.hessians;
  seconds += other.seconds;
  derivative_seconds += other.derivative_seconds;
  return *this;
}

NlpEvaluator::NlpEvaluator(const Nlp& nlp) : nlp_(nlp), structures_(nlp.blocks.size()) {
  std::size_t n = 0, m = 1;
  for (const auto& block : nlp.blocks) {
    n = std::max(n, block->variables.size());
    m = std::max(m, block->rows.size());
  }
  x_.resize(n);
  outputs_.resize(m);
  matrix_.resize(std::max(m * n, n * n));
  find_structure();
}

const double* NlpEvaluator::gather(const NlpBlock& block, const double* x) {
  for (std::size_t k = 0; k < block.variables.size(); ++k) x_[k] = x[block.variables[k]];
  return x_.data();
}

void NlpEvaluator::find_structure() {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> uniform(0.5, 1.5);
  std::vector<std::vector<double>> probes;
  for (int k = 0; k < kProbes; ++k) probes.push_back(random_point(nlp_, generator));

  PatternBuilder jacobian, hessian;
  std::vector<char> is_nonzero;
  const auto collect = [&](std::size_t size) {
    for (std::size_t k = 0; k < size; ++k) is_nonzero[k] |= matrix_[k] != 0;
  };
  for (std::size_t b = 0; b < nlp_.blocks.size(); ++b) {
    const NlpBlock& block = *nlp_.blocks[b];
    const std::size_t n = block.variables.size(), m = static_cast<std::size_t>(block.n_outputs());

    is_nonzero.assign(m * n, block.is_piecewise());
    for (const auto& probe : probes) {
      std::fill_n(matrix_.begin(), m * n, 0.0);
      block.jacobian(gather(block, probe.data()), matrix_.data());
      collect(m * n);
    }
    for (std::size_t k = 0; k < m * n; ++k) {
      if (!is_nonzero[k]) continue;
      structures_[b].jacobian.push_back({static_cast<int>(k), 0});
      if (!block.rows.empty()) jacobian.add(block.rows[k % m], block.variables[k / m]);
    }

    is_nonzero.assign(n * n, block.is_piecewise());
    for (const auto& probe : probes) {
      std::fill_n(matrix_.begin(), n * n, 0.0);
      for (std::size_t i = 0; i < m; ++i) outputs_[i] = uniform(generator);
      block.hessian(gather(block, probe.data()), outputs_.data(), matrix_.data());
      collect(n * n);
    }
    for (std::size_t k = 0; k < n * n; ++k) {
      const int row = block.variables[k % n], column = block.variables[k / n];
      if (!is_nonzero[k] || row < column) continue;  // the lower triangle
      structures_[b].hessian.push_back({static_cast<int>(k), 0});
      hessian.add(row, column);
    }
  }

  jacobian_pattern_ = jacobian.build();
  hessian_pattern_ = hessian.build();
  for (std::size_t b = 0; b < nlp_.blocks.size(); ++b) {
    const NlpBlock& block = *nlp_.blocks[b];
    const int n = static_cast<int>(block.variables.size()), m = block.n_outputs();
    for (auto& [local, global] : structures_[b].jacobian)
      global = block.rows.empty() ? block.variables[local]
                                  : jacobian.index(block.rows[local % m], block.variables[local / m]);
    for (auto& [local, global] : structures_[b].hessian)
      global = hessian.index(block.variables[local % n], block.variables[local / n]);
  }
}

void NlpEvaluator::scatter(const NlpBlock& block, const std::vector<Entry>& entries, bool is_hessian,
                           double* values) const {
  std::size_t k = 0;
  const auto require_zeros_up_to = [&](std::size_t end) {
    const std::size_t n = block.variables.size();
    for (; k < end; ++k) {
      if (matrix_[k] == 0 || (is_hessian && block.variables[k % n] < block.variables[k / n])) continue;
      throw std::logic_error("the derivatives of " + name_of(nlp_, block) +
                             " left their structure: its block must say is_piecewise()");
    }
  };
  for (const auto& [local, global] : entries) {
    require_zeros_up_to(static_cast<std::size_t>(local));
    values[global] += matrix_[k++];
  }
  const std::size_t n = block.variables.size();
  require_zeros_up_to(is_hessian ? n * n : n * static_cast<std::size_t>(block.n_outputs()));
}

double NlpEvaluator::objective(const double* x) {
  const Stopwatch stopwatch(work_.seconds);
  ++work_.objectives;
  double sum = 0;
  for (const auto& block : nlp_.blocks) {
    if (!block->rows.empty()) continue;
    block->evaluate(gather(*block, x), outputs_.data());
    sum += outputs_[0];
  }
  return sum;
}

void NlpEvaluator::constraints(const double* x, double* g) {
  const Stopwatch stopwatch(work_.seconds);
  ++work_.constraints;
  std::fill_n(g, nlp_.rows.size(), 0.0);
  for (const auto& block : nlp_.blocks) {
    if (block->rows.empty()) continue;
    block->evaluate(gather(*block, x), outputs_.data());
    for (std::size_t i = 0; i < block->rows.size(); ++i) g[block->rows[i]] += outputs_[i];
  }
}

void NlpEvaluator::gradient(const double* x, double* gradient) {
  const Stopwatch stopwatch(work_.seconds, &work_.derivative_seconds);
  ++work_.gradients;
  std::fill_n(gradient, nlp_.variables.size(), 0.0);
  for (std::size_t b = 0; b < nlp_.blocks.size(); ++b) {
    const NlpBlock& block = *nlp_.blocks[b];
    if (!block.rows.empty()) continue;
    std::fill_n(matrix_.begin(), block.variables.size(), 0.0);
    block.jacobian(gather(block, x), matrix_.data());
    scatter(block, structures_[b].jacobian, false, gradient);
  }
}

void NlpEvaluator::jacobian(const double* x, double* values) {
  const Stopwatch stopwatch(work_.seconds, &work_.derivative_seconds);
  ++work_.jacobians;
  std::fill_n(values, jacobian_pattern_.size(), 0.0);
  for (std::size_t b = 0; b < nlp_.blocks.size(); ++b) {
    const NlpBlock& block = *nlp_.blocks[b];
    if (block.rows.empty()) continue;
    std::fill_n(matrix_.begin(), block.rows.size() * block.variables.size(), 0.0);
    block.jacobian(gather(block, x), matrix_.data());
    scatter(block, structures_[b].jacobian, false, values);
  }
}

void NlpEvaluator::hessian(const double* x, double objective_weight, const double* lambda, double* values) {
  const Stopwatch stopwatch(work_.seconds, &work_.derivative_seconds);
  ++work_.hessians;
  std::fill_n(values, hessian_pattern_.size(), 0.0);
  for (std::size_t b = 0; b < nlp_.blocks.size(); ++b) {
    const NlpBlock& block = *nlp_.blocks[b];
    if (structures_[b].hessian.empty()) continue;  // linear
    outputs_[0] = objective_weight;
    for (std::size_t i = 0; i < block.rows.size(); ++i) outputs_[i] = lambda[block.rows[i]];
    std::fill_n(matrix_.begin(), block.variables.size() * block.variables.size(), 0.0);
    block.hessian(gather(block, x), outputs_.data(), matrix_.data());  // (1)
    scatter(block, structures_[b].hessian, true, values);
  }
}

NamedResidual NlpEvaluator::worst_violation(const double* x) {
  NamedResidual worst;
  // A value that is not a number violates everything.
  const auto compare = [&](double value, double lower, double upper, const char* kind, const std::string& name) {
    const double violation = std::isnan(value) ? kInfinity : std::max({lower - value, value - upper, 0.0});
    if (violation > worst.value) worst = {violation, std::string(kind) + " '" + name + "'"};
  };
  std::vector<double> g(nlp_.rows.size());
  constraints(x, g.data());
  for (std::size_t i = 0; i < g.size(); ++i)
    compare(g[i], nlp_.rows[i].lower, nlp_.rows[i].upper, "row", nlp_.rows[i].name);
  for (std::size_t k = 0; k < nlp_.variables.size(); ++k)
    compare(x[k], nlp_.variables[k].lower, nlp_.variables[k].upper, "bound of", nlp_.variables[k].name);
  return worst;
}

}  // namespace ricochet
