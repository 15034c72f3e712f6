#include "methods/complementarity/mpcc/homotopy.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "problems/input_error.h"

namespace ricochet {

namespace {

constexpr double kFactorRounding = 1e-9;  // of repeated factors
// Most iterations of a crossover that may be tried again with a smaller sigma; one that succeeds takes fewer.
constexpr int kEarlyIterations = 150;

void check(const HomotopyOptions& options) {
  const auto require = [](bool ok, const char* field, double value, const char* allowed) {
    if (!ok) throw InputError(field, value, allowed);
  };
  find_relaxation(options.relaxation);
  require(options.sigma_0 > 0 && options.sigma_0 < kInfinity, "sigma_0", options.sigma_0, "a number > 0 is required");
  require(options.sigma_final > 0 && options.sigma_final <= options.sigma_0, "sigma_final", options.sigma_final,
          "a number > 0 and <= sigma_0 is required");
  require(options.factor > 0 && options.factor < 1, "factor", options.factor, "a number between 0 and 1 is required");
  require(options.power > 1 && options.power < kInfinity, "power", options.power, "a number > 1 is required");
  require(options.tolerance >= 1e-14 && options.tolerance < 1, "tolerance", options.tolerance,
          "a number from 1e-14 to 1 is required");
  require(options.tolerance_per_sigma >= 0 && options.tolerance_per_sigma < kInfinity, "tolerance_per_sigma",
          options.tolerance_per_sigma, "a number >= 0 is required");
  require(options.loosest_tolerance >= options.tolerance && options.loosest_tolerance < 1, "loosest_tolerance",
          options.loosest_tolerance, "a number from the tolerance to 1 is required");
  require(options.sigma_crossover >= 0, "sigma_crossover", options.sigma_crossover, "a number >= 0 is required");
  require(options.sigma_warm > 0 && options.sigma_warm < kInfinity, "sigma_warm", options.sigma_warm,
          "a number > 0 is required");
  require(options.max_iterations >= 1, "max_iterations", options.max_iterations, "a number >= 1 is required");
  require(options.time_limit >= 0, "time_limit", options.time_limit, "a number of seconds >= 0 is required");
  require(options.warm_time_limit >= 0, "warm_time_limit", options.warm_time_limit,
          "a number of seconds >= 0 is required");
  require(options.barrier > 0 && options.barrier < kInfinity, "barrier", options.barrier, "a number > 0 is required");
  require(options.push > 0 && options.push <= 0.5, "push", options.push, "a number from 0 to 1/2 is required");
  require(options.max_branches >= 0, "max_branches", options.max_branches, "a number >= 0 is required");
}

void check_pairs(const Mpcc& mpcc) {
  for (const auto& pair : mpcc.pairs) {
    for (const auto* side : {&pair.G, &pair.H}) {
      for (const int k : *side) {
        const auto& variable = mpcc.nlp.variables[k];
        if (variable.lower != 0)
          throw InputError(fmt::format("pair '{}': lower bound of '{}'", pair.name, variable.name), variable.lower,
                           "0 is required");
      }
    }
  }
}

Status status_of(NlpStatus status) {
  switch (status) {
    case NlpStatus::solved:
    case NlpStatus::acceptable:
      return Status::success;
    case NlpStatus::infeasible:
      return Status::infeasible;
    case NlpStatus::iteration_limit:
      return Status::step_limit;
    case NlpStatus::time_limit:
      return Status::time_limit;
    case NlpStatus::non_finite:
      return Status::non_finite;
    case NlpStatus::failed:
      break;
  }
  return Status::inner_solver_failed;
}

}  // namespace

/// One solve.
class MpccSolver::Run {
 public:
  explicit Run(MpccSolver& solver)
      : mpcc_(solver.mpcc_),
        options_(solver.options_),
        evaluator_(solver.evaluator_),
        relaxation_(solver.relaxation_),
        relaxed_(solver.relaxed_),
        solver_(solver.solver_),
        crossover_(solver.crossover_),
        last_(solver.last_) {
    relaxed_.update();
    point_.x.resize(relaxed_.nlp().n_variables());
    std::ranges::transform(relaxed_.nlp().variables, point_.x.begin(), &Nlp::Variable::guess);
  }

  MpccSolution solve(const Progress& progress) {
    time_limit_ = options_.time_limit;
    follow(options_.sigma_0, options_.descend, progress);
    solution_.seconds = seconds();
    return std::move(solution_);
  }

  MpccSolution resolve(const Progress& progress) {
    time_limit_ = options_.warm_time_limit;
    resume();
    if (!solution_.kept_branch) {
      point_.x.head(mpcc_.nlp.n_variables()) = last_->branch.point.x;
      follow(std::max(options_.sigma_warm, options_.sigma_final), false, progress);
    }
    solution_.seconds = seconds();
    return std::move(solution_);
  }

 private:
  using Clock = std::chrono::steady_clock;
  double seconds() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

  IpoptOptions ipopt_options(double tolerance) const {
    IpoptOptions ipopt;
    ipopt.tolerance = tolerance;
    ipopt.barrier = options_.barrier;
    ipopt.push = options_.push;
    ipopt.max_iterations = options_.max_iterations;
    ipopt.adaptive_barrier = options_.adaptive_barrier;
    ipopt.linear_solver = options_.linear_solver;
    if (time_limit_ > 0) ipopt.time_limit = std::max(time_limit_ - seconds(), 1e-9);
    return ipopt;
  }

  double next(double sigma) const {
    double reduced = options_.factor * sigma;
    if (options_.update == SigmaUpdate::superlinear) reduced = std::min(reduced, std::pow(sigma, options_.power));
    return reduced > options_.sigma_final * (1 + kFactorRounding) ? reduced : options_.sigma_final;
  }

  /// A penalty that does not yet outweigh an objective without a lower bound.
  bool is_too_weak(NlpStatus status) const {
    return relaxation_.is_elastic() && (status == NlpStatus::failed || status == NlpStatus::non_finite);
  }

  void follow(double sigma, bool descend, const Progress& progress) {
    descends_ = descend;
    const bool is_near_solution = follow_relaxations(sigma, progress);
    if (is_near_solution && options_.cross_over) cross_over(true);
    if (is_near_solution && !options_.cross_over && solution_.message.empty()) solution_.status = Status::success;
  }

  /// Until one step fails, or an early crossover succeeds. @return whether there is a point to cross over from
  bool follow_relaxations(double sigma, const Progress& progress) {
    for (;; sigma = next(sigma)) {
      relaxed_.set_sigma(sigma);
      const double per_sigma = std::min(options_.tolerance_per_sigma * sigma, options_.loosest_tolerance);
      IpoptOptions ipopt = ipopt_options(std::max(options_.tolerance, per_sigma));
      // The barrier begins below sigma: it should not undo the last step.
      if (solution_.x.size() > 0) ipopt.barrier = std::min(ipopt.barrier, std::max(sigma * sigma, options_.tolerance));
      const NlpResult result = solver_.solve(start(), ipopt);
      if (is_solved(result.status)) take(result.point);
      record(sigma, result, progress);
      if (is_too_weak(result.status) && sigma > options_.sigma_final) continue;
      if (!is_solved(result.status)) {
        solution_.status = status_of(result.status);
        solution_.message = describe(fmt::format("relaxation with sigma = {:.3g}", sigma), result);
        const bool is_start = solution_.x.size() == 0;
        if (is_start || !options_.cross_over) take(result.point);
        return !is_start && result.status != NlpStatus::time_limit;
      }
      if (sigma <= options_.sigma_final || solution_.complementarity <= options_.tolerance) return true;
      if (sigma <= options_.sigma_crossover * (1 + kFactorRounding)) {
        cross_over(false);
        if (solution_.succeeded()) return false;
        solution_.message.clear();
      }
    }
  }

  NlpPoint start() const {
    return options_.warm_multipliers ? point_ : NlpPoint{.x = point_.x, .lambda = {}, .z_L = {}, .z_U = {}};
  }

  void take(const NlpPoint& point) {
    point_ = point;
    set_x(point.x.head(mpcc_.nlp.n_variables()));
  }

  void set_x(const Vector& x) {
    solution_.x = x;
    solution_.objective = evaluator_.objective(x.data());
    solution_.complementarity = complementarity(mpcc_, x.data()).value;
    solution_.violation = evaluator_.worst_violation(x.data());
  }

  void record(double sigma, const NlpResult& result, const Progress& progress) {
    const double* x = result.point.x.data();
    const HomotopyStep step = {.sigma = sigma,
                               .status = result.status,
                               .iterations = result.iterations,
                               .objective = evaluator_.objective(x),
                               .complementarity = complementarity(mpcc_, x).value,
                               .violation = evaluator_.worst_violation(x).value,
                               .seconds = result.seconds,
                               .derivative_seconds = result.derivative_seconds};
    solution_.steps.push_back(step);
    solution_.iterations += step.iterations;
    solution_.derivative_seconds += step.derivative_seconds;
    if (progress) progress(step);
  }

  /// @param is_last  else it is not worth much
  void cross_over(bool is_last) {
    const auto n = mpcc_.nlp.n_variables(), m = mpcc_.nlp.n_rows();
    const NlpPoint relaxed = {point_.x.head(n), point_.lambda.head(m), point_.z_L.head(n), point_.z_U.head(n)};
    IpoptOptions ipopt = ipopt_options(options_.tolerance);
    if (!is_last) ipopt.max_iterations = std::min(ipopt.max_iterations, kEarlyIterations);
    if (!crossover_) crossover_.emplace(mpcc_);
    const CrossoverResult result = crossover_->run(relaxed, {ipopt, options_.max_branches, is_last, descends_});
    if (accept(result)) return;
    const std::string message =
        describe(fmt::format("crossover, {} branches tried", result.switches + 1), result.branch);
    if (solution_.message.empty()) {
      solution_.status = status_of(result.branch.status);
      solution_.message = message;
    } else {  // far from a solution, a branch without one says little: what ended the relaxations remains the status
      solution_.message += "; " + message;
    }
  }

  /// The branch that the last solution is from.
  void resume() {
    if (!crossover_) crossover_.emplace(mpcc_);
    solution_.kept_branch = accept(crossover_->resume(*last_, ipopt_options(options_.tolerance)));
  }

  /// @return whether its branch is solved
  bool accept(const CrossoverResult& result) {
    solution_.switches = result.switches;
    solution_.iterations += result.iterations;
    solution_.derivative_seconds += result.derivative_seconds;
    if (!is_solved(result.branch.status)) return false;
    solution_.status = Status::success;
    solution_.message.clear();
    solution_.stationarity = result.stationarity;
    solution_.is_b_stationary = result.is_b_stationary;
    solution_.n_biactive = result.n_biactive;
    set_x(result.branch.point.x);
    last_ = result;
    return true;
  }

  /// Describes the failure and the largest violations of the Mpcc at that point.
  std::string describe(const std::string& what, const NlpResult& result) {
    std::string text = fmt::format("{}: {}", what, result.message);
    const double* x = result.point.x.data();
    if (const NamedResidual worst = evaluator_.worst_violation(x); worst.value > options_.tolerance)
      text += fmt::format("; the largest violation is {:.3g}, of {}", worst.value, worst.name);
    if (const NamedResidual worst = complementarity(mpcc_, x); worst.value > options_.tolerance)
      text += fmt::format("; min(G, H) is up to {:.3g}, of {}", worst.value, worst.name);
    return text;
  }

  const Mpcc& mpcc_;
  const HomotopyOptions& options_;
  Clock::time_point begin_ = Clock::now();
  NlpEvaluator& evaluator_;
  const Relaxation& relaxation_;
  RelaxedMpcc& relaxed_;
  IpoptSolver& solver_;
  std::optional<Crossover>& crossover_;
  std::optional<CrossoverResult>& last_;
  bool descends_ = false;
  double time_limit_ = 0;
  NlpPoint point_;
  MpccSolution solution_;
};

MpccSolver::MpccSolver(const Mpcc& mpcc, HomotopyOptions options)
    : mpcc_(mpcc),
      options_((check(options), std::move(options))),
      evaluator_(mpcc.nlp),
      relaxation_(find_relaxation(options_.relaxation)),
      relaxed_(mpcc, relaxation_, options_.sigma_0),
      solver_(relaxed_.nlp()) {
  check_pairs(mpcc);
}

MpccSolution MpccSolver::solve(const Progress& progress) {
  return Run(*this).solve(progress);
}

MpccSolution MpccSolver::resolve(const Progress& progress) {
  return last_ ? Run(*this).resolve(progress) : solve(progress);
}

NlpEvaluator::Work MpccSolver::work() const {
  NlpEvaluator::Work work = solver_.evaluator().work();
  if (crossover_) work += crossover_->work();
  return work;
}

void MpccSolver::set_options(HomotopyOptions options) {
  check(options);
  if (options.relaxation != options_.relaxation)
    throw InputError("relaxation", options.relaxation, options_.relaxation + " is required, that of the solver");
  options_ = std::move(options);
}

Homotopy::Homotopy(HomotopyOptions options) : options_(std::move(options)) {
  check(options_);
}

MpccSolution Homotopy::solve(const Mpcc& mpcc, const Progress& progress) const {
  return MpccSolver(mpcc, options_).solve(progress);
}

}  // namespace ricochet
