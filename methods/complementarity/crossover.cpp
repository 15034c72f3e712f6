#include "methods/complementarity/crossover.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "methods/complementarity/relaxation.h"

namespace ricochet {

namespace {

// An interior-point method leaves a variable whose multiplier is zero about sqrt(tolerance) away from its bound, and
// the multiplier as far from zero. Below this multiple of it, both are zero.
constexpr double kZero = 10;
// A branch is better when its objective is so by more than the solves are exact to, relatively.
constexpr double kDescent = 1e-8;
// Near the solution: iterations are few, and the start is not pushed away far.
constexpr double kBarrier = 1e-6;

enum class Side { G, H };

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

class Crossover {
 public:
  Crossover(const Mpcc& mpcc, const CrossoverOptions& options)
      : mpcc_(mpcc), options_(options), program_(borrow(mpcc.nlp)), solver_(program_) {
    options_.ipopt.multipliers_of_fixed = true;
    options_.ipopt.barrier = kBarrier;
    zero_ = kZero * std::sqrt(options_.ipopt.tolerance);
  }

  CrossoverResult run(const NlpPoint& relaxed) {
    for (const auto& pair : mpcc_.pairs)
      sides_.push_back(sum(pair.G, relaxed.x.data()) <= sum(pair.H, relaxed.x.data()) ? Side::G : Side::H);
    solved_here_too_ = sides_.size();
    result_.branch = solve(sides_, relaxed);
    if (!is_solved(result_.branch.status)) find_solvable_branch(relaxed);
    if (!is_solved(result_.branch.status)) return result_;
    descend();
    classify();
    return result_;
  }

 private:
  bool may_switch() const {
    return result_.switches < options_.max_switches &&
           (options_.ipopt.time_limit <= 0 || result_.seconds < options_.ipopt.time_limit);
  }

  /// The branch (1).
  NlpResult solve(const std::vector<Side>& sides, NlpPoint start) {
    program_.variables = mpcc_.nlp.variables;
    for (std::size_t i = 0; i < sides.size(); ++i)
      for (const int k : held(mpcc_.pairs[i], sides[i])) program_.variables[k].upper = start.x[k] = 0;
    IpoptOptions ipopt = options_.ipopt;
    if (ipopt.time_limit > 0) ipopt.time_limit = std::max(ipopt.time_limit - result_.seconds, 1e-9);
    NlpResult branch = solver_.solve(start, ipopt);
    result_.iterations += branch.iterations;
    result_.seconds += branch.seconds;
    result_.derivative_seconds += branch.derivative_seconds;
    return branch;
  }

  NlpResult solve_switched(std::size_t pair, const NlpPoint& start) {
    ++result_.switches;
    std::vector<Side> sides = sides_;
    sides[pair] = other(sides[pair]);
    return solve(sides, start);
  }

  void accept(std::size_t pair, NlpResult branch) {
    sides_[pair] = other(sides_[pair]);
    result_.branch = std::move(branch);
    solved_here_too_ = sides_.size();
  }

  /// Least clear pairs first: those whose larger side is the smallest.
  void find_solvable_branch(const NlpPoint& relaxed) {
    std::vector<std::size_t> order(sides_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {},
                             [&](std::size_t i) { return sum(free(mpcc_.pairs[i], sides_[i]), relaxed.x.data()); });
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
      if (i == sides_.size()) return;
      tried.insert(i);
      NlpResult branch = solve_switched(i, result_.branch.point);
      const double here = result_.branch.objective;
      if (!is_solved(branch.status)) continue;
      if (branch.objective < here - kDescent * (1 + std::abs(here))) {
        accept(i, std::move(branch));
        tried.clear();
      } else if ((branch.point.x - result_.branch.point.x).cwiseAbs().maxCoeff() < zero_) {
        solved_here_too_ = i;
      }
    }
  }

  double value(int k) const { return result_.branch.point.x[k]; }
  double multiplier(int k) const { return result_.branch.point.z_L[k] - result_.branch.point.z_U[k]; }
  bool is_biactive(std::size_t i) const {
    return std::ranges::all_of(free(mpcc_.pairs[i], sides_[i]), [&](int k) { return value(k) < zero_; });
  }

  /// Of the biactive pairs that are not in `tried`; the number of pairs when no multiplier is negative.
  std::size_t most_negative_pair(const std::set<std::size_t>& tried) const {
    std::size_t found = sides_.size();
    double least = -zero_;
    for (std::size_t i = 0; i < sides_.size(); ++i) {
      if (tried.contains(i) || !is_biactive(i)) continue;
      for (const int k : held(mpcc_.pairs[i], sides_[i])) {
        if (multiplier(k) >= least) continue;
        least = multiplier(k);
        found = i;
      }
    }
    return found;
  }

  void classify() {
    result_.stationarity = Stationarity::S;
    for (std::size_t i = 0; i < sides_.size(); ++i) {
      if (!is_biactive(i)) continue;
      ++result_.n_biactive;
      for (const int v : mpcc_.pairs[i].G)
        for (const int w : mpcc_.pairs[i].H)
          result_.stationarity = std::min(result_.stationarity, stationarity(multiplier(v), multiplier(w)));
    }
    // One biactive pair: its two branches are all there are.
    result_.is_b_stationary =
        result_.stationarity == Stationarity::S ||
        (result_.n_biactive == 1 && solved_here_too_ < sides_.size() && is_biactive(solved_here_too_));
  }

  Stationarity stationarity(double nu_v, double nu_w) const {
    const bool is_zero = std::abs(nu_v) <= zero_ || std::abs(nu_w) <= zero_;
    if (nu_v >= -zero_ && nu_w >= -zero_) return Stationarity::S;  // (5)
    if (is_zero) return Stationarity::M;                           // (4): both positive is S
    return nu_v * nu_w > 0 ? Stationarity::C : Stationarity::W;    // (3), (2)
  }

  const Mpcc& mpcc_;
  CrossoverOptions options_;
  double zero_ = 0;
  Nlp program_;
  IpoptSolver solver_;
  std::vector<Side> sides_;          // held at zero
  std::size_t solved_here_too_ = 0;  // pair whose other branch ends at the same point; their number for none
  CrossoverResult result_;
};

}  // namespace

const char* to_string(Stationarity stationarity) {
  switch (stationarity) {
    case Stationarity::W:
      return "W";
    case Stationarity::C:
      return "C";
    case Stationarity::M:
      return "M";
    case Stationarity::S:
      return "S";
    default:
      return "unknown";
  }
}

NamedResidual complementarity(const Mpcc& mpcc, const double* x) {
  NamedResidual worst;
  for (const auto& pair : mpcc.pairs) {
    const double residual = std::min(sum(pair.G, x), sum(pair.H, x));
    if (residual > worst.value) worst = {residual, "pair '" + pair.name + "'"};
  }
  return worst;
}

CrossoverResult cross_over(const Mpcc& mpcc, const NlpPoint& relaxed, const CrossoverOptions& options) {
  return Crossover(mpcc, options).run(relaxed);
}

}  // namespace ricochet
