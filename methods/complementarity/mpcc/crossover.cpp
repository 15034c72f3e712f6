#include "methods/complementarity/mpcc/crossover.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numeric>
#include <set>

#include "methods/complementarity/mpcc/relaxation.h"

namespace ricochet {

namespace {

// An interior-point method leaves a variable whose multiplier is zero about sqrt(tolerance) away from its bound, and
// the multiplier as far from zero. Below this multiple of it, both are zero.
constexpr double kZero = 10;
// A branch is better when its objective is so by more than the solves are exact to, relatively.
constexpr double kDescent = 1e-8;
// A branch whose rows hold to this multiple of the tolerance is solved where its objective does not matter.
constexpr double kRounding = 100;
// Near the solution: iterations are few, and the start is not pushed away far.
constexpr double kBarrier = 1e-6;
// Barrier and most iterations at a solution whose bounds have moved a little: Newton's method takes three to twenty
// iterations, or does not converge.
constexpr double kResumedBarrier = 1e-9;
constexpr int kResumedIterations = 50;

double sum(const std::vector<int>& variables, const double* x) {
  return std::accumulate(variables.begin(), variables.end(), 0.0, [x](double sum, int k) { return sum + x[k]; });
}

const std::vector<int>& held(const Mpcc::Pair& pair, Side side) {
  return side == Side::G ? pair.G : pair.H;
}
const std::vector<int>& free(const Mpcc::Pair& pair, Side side) {
  return side == Side::G ? pair.H : pair.G;
}
Side other(Side side) {
  return side == Side::G ? Side::H : Side::G;
}

/// One run of the Crossover.
class Run {
 public:
  /// @param program  that `solver` solves: the Mpcc without its pairs
  Run(const Mpcc& mpcc, const CrossoverOptions& options, Nlp& program, IpoptSolver& solver)
      : mpcc_(mpcc), options_(options), program_(program), solver_(solver) {
    options_.ipopt.multipliers_of_fixed = true;
    options_.ipopt.barrier = kBarrier;
    zero_ = kZero * std::sqrt(options_.ipopt.tolerance);
  }

  CrossoverResult from(const NlpPoint& relaxed) {
    choose_sides(relaxed.x.data());
    result_.branch = solve(result_.sides, relaxed);
    if (!is_solved(result_.branch.status) && options_.search_branches) find_solvable_branch(relaxed);
    if (!is_solved(result_.branch.status) || !options_.descend) return std::move(result_);
    descend();
    classify();
    return std::move(result_);
  }

  CrossoverResult resume(const CrossoverResult& earlier) {
    options_.ipopt.barrier = kResumedBarrier;
    options_.ipopt.adaptive_barrier = false;
    options_.ipopt.max_iterations = std::min(options_.ipopt.max_iterations, kResumedIterations);
    result_.sides = earlier.sides;
    // Rows of a branch may depend on each other: multipliers are not unique then, and old ones stall.
    result_.branch = solve(result_.sides, {.x = earlier.branch.point.x, .lambda = {}, .z_L = {}, .z_U = {}});
    return std::move(result_);
  }

 private:
  using Clock = std::chrono::steady_clock;
  double seconds() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

  bool may_switch() const {
    return result_.switches < options_.max_branches &&
           (options_.ipopt.time_limit <= 0 || seconds() < options_.ipopt.time_limit);
  }

  double remaining_time() const {
    const double limit = options_.ipopt.time_limit;
    return limit > 0 ? std::max(limit - seconds(), 1e-9) : 0;
  }

  /// The smaller ones, the clearest pairs first. A side that those hold already is taken in any case: where pairs share
  /// variables, holding both sides of an unclear one may leave too few variables for the rows.
  void choose_sides(const double* x) {
    const auto& pairs = mpcc_.pairs;
    result_.sides.resize(pairs.size());
    std::vector<std::size_t> order(pairs.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, std::greater{},
                             [&](std::size_t i) { return std::max(sum(pairs[i].G, x), sum(pairs[i].H, x)); });
    std::vector<char> is_held(mpcc_.nlp.variables.size(), false);
    const auto holds = [&](const std::vector<int>& side) {
      return std::ranges::all_of(side, [&](int k) { return is_held[k]; });
    };
    for (const std::size_t i : order) {
      const auto& [G, H, name, bias] = pairs[i];
      result_.sides[i] = holds(G) ? Side::G : holds(H) ? Side::H : sum(G, x) <= bias * sum(H, x) ? Side::G : Side::H;
      for (const int k : held(pairs[i], result_.sides[i])) is_held[k] = true;
    }
  }

  /// The branch (1).
  NlpResult solve(const std::vector<Side>& sides, NlpPoint start) {
    copy_bounds(mpcc_.nlp, program_);
    for (std::size_t i = 0; i < sides.size(); ++i)
      for (const int k : held(mpcc_.pairs[i], sides[i])) program_.variables[k].upper = start.x[k] = 0;
    IpoptOptions ipopt = options_.ipopt;
    ipopt.time_limit = remaining_time();
    NlpResult branch = solver_.solve(start, ipopt);
    for (std::size_t i = 0; i < sides.size(); ++i)  // to rounding they are
      for (const int k : held(mpcc_.pairs[i], sides[i])) branch.point.x[k] = 0;
    branch.objective = solver_.evaluator().objective(branch.point.x.data());
    branch.violation = solver_.evaluator().worst_violation(branch.point.x.data());
    // Rounding of a degenerate branch; without descent every point of it will do.
    if (!options_.descend && branch.violation.value <= kRounding * ipopt.tolerance)
      branch.status = NlpStatus::acceptable;
    result_.iterations += branch.iterations;
    result_.derivative_seconds += branch.derivative_seconds;
    return branch;
  }

  NlpResult solve_switched(std::size_t pair, const NlpPoint& start) {
    ++result_.switches;
    std::vector<Side> sides = result_.sides;
    sides[pair] = other(sides[pair]);
    return solve(sides, start);
  }

  void accept(std::size_t pair, NlpResult branch) {
    result_.sides[pair] = other(result_.sides[pair]);
    result_.branch = std::move(branch);
    other_branch_ends_here_ = false;
  }

  /// Least clear pairs first: those whose larger side is the smallest.
  void find_solvable_branch(const NlpPoint& relaxed) {
    std::vector<std::size_t> order(result_.sides.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(
        order, {}, [&](std::size_t i) { return sum(free(mpcc_.pairs[i], result_.sides[i]), relaxed.x.data()); });
    for (const std::size_t i : order) {
      if (!may_switch()) return;
      NlpResult branch = solve_switched(i, relaxed);
      if (is_solved(branch.status)) return accept(i, std::move(branch));
    }
  }

  void descend() {
    std::set<std::size_t> tried;  // since the last descent
    while (may_switch()) {
      const auto i = most_negative_pair(tried);
      if (i == result_.sides.size() || (tried.empty() && is_S())) return;
      tried.insert(i);
      NlpResult branch = solve_switched(i, result_.branch.point);
      const double here = result_.branch.objective;
      if (!is_solved(branch.status)) continue;
      if (branch.objective < here - kDescent * (1 + std::abs(here))) {
        accept(i, std::move(branch));
        tried.clear();
      } else if ((branch.point.x - result_.branch.point.x).cwiseAbs().maxCoeff() < zero_) {
        other_branch_ends_here_ = true;
      }
    }
  }

  bool is_zero(int k) const { return result_.branch.point.x[k] <= zero_; }
  double multiplier(int k) const { return result_.branch.point.z_L[k] - result_.branch.point.z_U[k]; }

  /// The biactive pair, not in `tried`, with the most negative multiplier; the number of pairs when none is negative.
  std::size_t most_negative_pair(const std::set<std::size_t>& tried) const {
    std::size_t found = result_.sides.size();
    double least = -zero_;
    for (std::size_t i = 0; i < result_.sides.size(); ++i) {
      const auto& pair = mpcc_.pairs[i];
      if (tried.contains(i) || !std::ranges::all_of(free(pair, result_.sides[i]), [&](int k) { return is_zero(k); }))
        continue;
      for (const int k : held(pair, result_.sides[i])) {
        if (multiplier(k) >= least) continue;
        least = multiplier(k);
        found = i;
      }
    }
    return found;
  }

  bool is_S() const { return StationarityTest(mpcc_, result_.branch.point.x, zero_).is_S(stationarity_options()); }

  void classify() {
    StationarityTest test(mpcc_, result_.branch.point.x, zero_);
    result_.n_biactive = static_cast<int>(test.biactive().size());
    result_.stationarity = test.classify(stationarity_options());
    // The two branches of a single biactive pair are all there are.
    result_.is_b_stationary =
        result_.stationarity == Stationarity::S ||
        (result_.stationarity != Stationarity::unknown && result_.n_biactive == 1 && other_branch_ends_here_);
  }

  IpoptOptions stationarity_options() const {
    IpoptOptions ipopt;
    ipopt.tolerance = options_.ipopt.tolerance;
    ipopt.linear_solver = options_.ipopt.linear_solver;
    ipopt.time_limit = remaining_time();
    return ipopt;
  }

  const Mpcc& mpcc_;
  const Clock::time_point begin_ = Clock::now();
  CrossoverOptions options_;
  double zero_ = 0;
  Nlp& program_;
  IpoptSolver& solver_;
  bool other_branch_ends_here_ = false;
  CrossoverResult result_;
};

}  // namespace

NamedResidual complementarity(const Mpcc& mpcc, const double* x) {
  NamedResidual worst;
  for (const auto& pair : mpcc.pairs) {
    const double residual = std::min(sum(pair.G, x), sum(pair.H, x));
    if (residual > worst.value) worst = {residual, "pair '" + pair.name + "'"};
  }
  return worst;
}

Crossover::Crossover(const Mpcc& mpcc) : mpcc_(mpcc), program_(borrow(mpcc.nlp)), solver_(program_) {}

CrossoverResult Crossover::run(const NlpPoint& relaxed, const CrossoverOptions& options) {
  return Run(mpcc_, options, program_, solver_).from(relaxed);
}

CrossoverResult Crossover::resume(const CrossoverResult& earlier, const IpoptOptions& ipopt) {
  const CrossoverOptions options{.ipopt = ipopt, .max_branches = 0, .search_branches = false, .descend = false};
  return Run(mpcc_, options, program_, solver_).resume(earlier);
}

CrossoverResult cross_over(const Mpcc& mpcc, const NlpPoint& relaxed, const CrossoverOptions& options) {
  return Crossover(mpcc).run(relaxed, options);
}

}  // namespace ricochet
