#include "methods/complementarity/mpcc/ipopt_solver.h"

#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>

#include "methods/complementarity/mpcc/ipopt_ldl.h"
#include "problems/input_error.h"

namespace ricochet {

namespace {

using Ipopt::Index, Ipopt::Number;

/// Distance by which a warm start is pushed away from bounds: less than its first barrier parameter.
constexpr double kWarmPush = 1e-9;

/// Unknowns of the rows in Ipopt's systems. Variables with equal bounds are constraints with `multipliers_of_fixed`.
int n_rows_of_systems(const Nlp& nlp, bool multipliers_of_fixed) {
  const auto is_fixed = [](const Nlp::Variable& variable) { return variable.lower == variable.upper; };
  return nlp.n_rows() + (multipliers_of_fixed ? static_cast<int>(std::ranges::count_if(nlp.variables, is_fixed)) : 0);
}

/// The program as Ipopt asks for it.
class IpoptProgram : public Ipopt::TNLP {
 public:
  IpoptProgram(NlpEvaluator& evaluator, const NlpPoint& start, double time_limit)
      : evaluator_(evaluator), nlp_(evaluator.nlp()), start_(start), time_limit_(time_limit), result_(start) {}

  const NlpPoint& result() const { return result_; }
  double seconds() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }
  bool is_out_of_time() const { return is_out_of_time_; }
  int iterations() const { return iterations_; }
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

  bool get_nlp_info(Index& n, Index& m, Index& n_jacobian, Index& n_hessian, IndexStyleEnum& style) override {
    n = nlp_.n_variables();
    m = nlp_.n_rows();
    n_jacobian = evaluator_.jacobian_pattern().size();
    n_hessian = evaluator_.hessian_pattern().size();
    style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* x_L, Number* x_U, Index m, Number* g_L, Number* g_U) override {
    for (Index k = 0; k < n; ++k) {
      x_L[k] = nlp_.variables[k].lower;
      x_U[k] = nlp_.variables[k].upper;
    }
    for (Index i = 0; i < m; ++i) {
      g_L[i] = nlp_.rows[i].lower;
      g_U[i] = nlp_.rows[i].upper;
    }
    return true;
  }

  bool get_starting_point(Index, bool with_x, Number* x, bool with_z, Number* z_L, Number* z_U, Index, bool with_lambda,
                          Number* lambda) override {
    const auto copy = [](const Vector& from, Number* to) { std::copy(from.begin(), from.end(), to); };
    if (with_x) copy(start_.x, x);
    if (with_z) copy(start_.z_L, z_L);
    if (with_z) copy(start_.z_U, z_U);
    if (with_lambda) copy(start_.lambda, lambda);
    return true;
  }

  bool eval_f(Index, const Number* x, bool, Number& f) override {
    return guarded([&] { f = evaluator_.objective(x); });
  }
  bool eval_grad_f(Index, const Number* x, bool, Number* gradient) override {
    return guarded([&] { evaluator_.gradient(x, gradient); });
  }
  bool eval_g(Index, const Number* x, bool, Index, Number* g) override {
    return guarded([&] { evaluator_.constraints(x, g); });
  }
  bool eval_jac_g(Index, const Number* x, bool, Index, Index, Index* rows, Index* columns, Number* values) override {
    if (!values) return copy_pattern(evaluator_.jacobian_pattern(), rows, columns);
    return guarded([&] { evaluator_.jacobian(x, values); });
  }
  bool eval_h(Index, const Number* x, bool, Number objective_weight, Index, const Number* lambda, bool, Index,
              Index* rows, Index* columns, Number* values) override {
    if (!values) return copy_pattern(evaluator_.hessian_pattern(), rows, columns);
    return guarded([&] { evaluator_.hessian(x, objective_weight, lambda, values); });
  }

  bool intermediate_callback(Ipopt::AlgorithmMode, Index iteration, Number, Number, Number, Number, Number, Number,
                             Number, Number, Index, const Ipopt::IpoptData*,
                             Ipopt::IpoptCalculatedQuantities*) override {
    iterations_ = iteration;
    is_out_of_time_ = time_limit_ > 0 && seconds() > time_limit_;
    return !is_out_of_time_ && !error_;
  }

  void finalize_solution(Ipopt::SolverReturn, Index n, const Number* x, const Number* z_L, const Number* z_U, Index m,
                         const Number*, const Number* lambda, Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    result_ = {Vector::Map(x, n), Vector::Map(lambda, m), Vector::Map(z_L, n), Vector::Map(z_U, n)};
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// Ipopt must not see exceptions; the first one is kept, and ends the solve.
  template <class Evaluation>
  bool guarded(Evaluation evaluate) {
    if (error_) return false;
    try {
      evaluate();
    } catch (...) {
      error_ = std::current_exception();
    }
    return !error_;
  }

  static bool copy_pattern(const SparsityPattern& pattern, Index* rows, Index* columns) {
    std::copy(pattern.rows.begin(), pattern.rows.end(), rows);
    std::copy(pattern.columns.begin(), pattern.columns.end(), columns);
    return true;
  }

  NlpEvaluator& evaluator_;
  const Nlp& nlp_;
  const NlpPoint& start_;
  double time_limit_;
  NlpPoint result_;
  Clock::time_point begin_ = Clock::now();
  int iterations_ = 0;
  bool is_out_of_time_ = false;
  std::exception_ptr error_;
};

void check(const IpoptOptions& options) {
  const auto require = [](bool ok, const char* field, double value, const char* allowed) {
    if (!ok) throw InputError(field, value, allowed);
  };
  require(options.tolerance >= 1e-14 && options.tolerance < 1, "tolerance", options.tolerance,
          "a number from 1e-14 to 1 is required");
  require(options.acceptable_factor >= 1, "acceptable_factor", options.acceptable_factor, "a number >= 1 is required");
  require(options.max_iterations >= 0, "max_iterations", options.max_iterations, "a number >= 0 is required");
  require(options.time_limit >= 0, "time_limit", options.time_limit, "a number of seconds >= 0 is required");
  require(options.barrier > 0 && options.barrier < kInfinity, "barrier", options.barrier, "a number > 0 is required");
  require(options.push > 0 && options.push <= 0.5, "push", options.push, "a number from 0 to 1/2 is required");
}

void set_options(const IpoptOptions& options, bool is_warm, bool multipliers_of_fixed, Ipopt::OptionsList& list) {
  list.SetIntegerValue("print_level", 0);
  list.SetStringValue("sb", "yes");  // no banner
  const bool is_ldl = options.linear_solver == LinearSolver::ldl;
  list.SetStringValue("linear_solver", is_ldl ? IpoptLdl::ipopt_name : "mumps");
  list.SetNumericValue("bound_relax_factor", 0);
  list.SetStringValue("fixed_variable_treatment", multipliers_of_fixed ? "make_constraint" : "make_parameter");
  list.SetNumericValue("tol", options.tolerance);
  list.SetNumericValue("constr_viol_tol", options.tolerance);
  const double acceptable = options.acceptable_factor * options.tolerance;
  list.SetNumericValue("acceptable_tol", acceptable);
  list.SetNumericValue("acceptable_constr_viol_tol", acceptable);
  list.SetIntegerValue("max_iter", options.max_iterations);
  list.SetNumericValue("mu_init", options.barrier);
  list.SetStringValue("mu_strategy", options.adaptive_barrier ? "adaptive" : "monotone");
  list.SetStringValue("warm_start_init_point", is_warm ? "yes" : "no");
  for (const char* push : {"bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac"})
    list.SetNumericValue(push, options.push);
  for (const char* push : {"warm_start_bound_push", "warm_start_bound_frac", "warm_start_slack_bound_push",
                           "warm_start_slack_bound_frac", "warm_start_mult_bound_push"})
    list.SetNumericValue(push, kWarmPush);
}

struct Outcome {
  NlpStatus status;
  const char* message;
};

Outcome outcome(Ipopt::ApplicationReturnStatus status) {
  switch (status) {
    case Ipopt::Solve_Succeeded:
    case Ipopt::Feasible_Point_Found:
      return {NlpStatus::solved, ""};
    case Ipopt::Solved_To_Acceptable_Level:
      return {NlpStatus::acceptable, "solved to the acceptable tolerance only"};
    case Ipopt::Infeasible_Problem_Detected:
      return {NlpStatus::infeasible, "converged to a point where the violation is stationary"};
    case Ipopt::Search_Direction_Becomes_Too_Small:
      return {NlpStatus::failed, "the search direction became too small"};
    case Ipopt::Diverging_Iterates:
      return {NlpStatus::failed, "the iterates diverge; the problem may be unbounded"};
    case Ipopt::User_Requested_Stop:
    case Ipopt::Maximum_CpuTime_Exceeded:
      return {NlpStatus::time_limit, "the time limit is over"};
    case Ipopt::Maximum_Iterations_Exceeded:
      return {NlpStatus::iteration_limit, "the iteration limit is reached"};
    case Ipopt::Restoration_Failed:
      return {NlpStatus::failed, "the restoration phase failed"};
    case Ipopt::Error_In_Step_Computation:
      return {NlpStatus::failed, "no search direction could be computed"};
    case Ipopt::Not_Enough_Degrees_Of_Freedom:
      return {NlpStatus::failed, "there are fewer free variables than equality rows"};
    case Ipopt::Invalid_Number_Detected:
      return {NlpStatus::non_finite, "a function or derivative is not finite"};
    case Ipopt::Invalid_Problem_Definition:
      return {NlpStatus::failed, "Ipopt rejects the problem: crossed bounds, or a start that cannot be evaluated"};
    default:
      return {NlpStatus::failed, "Ipopt failed internally"};
  }
}

}  // namespace

const Names<LinearSolver>& linear_solver_names() {
  static const Names<LinearSolver> names = {{"mumps", LinearSolver::mumps}, {"ldl", LinearSolver::ldl}};
  return names;
}

struct IpoptSolver::Application {
  Ipopt::SmartPtr<Ipopt::IpoptApplication> ipopt = new Ipopt::IpoptApplication(false);
  Ipopt::ApplicationReturnStatus status = ipopt->Initialize("");  // "": reads no file of options
};

IpoptSolver::IpoptSolver(const Nlp& nlp) : evaluator_(nlp), application_(std::make_unique<Application>()) {}

IpoptSolver::~IpoptSolver() = default;

NlpResult IpoptSolver::solve(const IpoptOptions& options) {
  NlpPoint start;
  start.x.resize(evaluator_.nlp().n_variables());
  std::ranges::transform(evaluator_.nlp().variables, start.x.begin(), &Nlp::Variable::guess);
  return solve(start, options);
}

NlpResult IpoptSolver::solve(const NlpPoint& start, const IpoptOptions& options) {
  check(options);
  const bool is_warm = start.z_L.size() == start.x.size() && start.lambda.size() == evaluator_.nlp().n_rows() &&
                       start.z_U.size() == start.x.size();
  const double derivative_seconds = evaluator_.work().derivative_seconds;

  const auto run = [&](const Ipopt::SmartPtr<IpoptProgram>& program, bool multipliers_of_fixed) {
    if (application_->status != Ipopt::Solve_Succeeded) return application_->status;
    set_options(options, is_warm, multipliers_of_fixed, *application_->ipopt->Options());
    std::optional<IpoptLdl> ldl;
    if (options.linear_solver == LinearSolver::ldl)
      ldl.emplace(n_rows_of_systems(evaluator_.nlp(), multipliers_of_fixed));
    return application_->ipopt->OptimizeTNLP(GetRawPtr(program));
  };
  const Ipopt::SmartPtr<IpoptProgram> program = new IpoptProgram(evaluator_, start, options.time_limit);
  Ipopt::ApplicationReturnStatus ipopt_status = run(program, options.multipliers_of_fixed);
  // More rows than free variables, which may be consistent all the same: without constraints of their own, Ipopt turns
  // fixed variables into bounded ones then.
  if (ipopt_status == Ipopt::Not_Enough_Degrees_Of_Freedom && options.multipliers_of_fixed)
    ipopt_status = run(program, false);
  program->rethrow();

  NlpResult result;
  const auto [status, message] = outcome(ipopt_status);
  result.status = status;
  result.message = message;
  result.point = program->result();
  result.iterations = program->iterations();
  result.seconds = program->seconds();
  result.derivative_seconds = evaluator_.work().derivative_seconds - derivative_seconds;
  result.objective = evaluator_.objective(result.point.x.data());
  result.violation = evaluator_.worst_violation(result.point.x.data());
  return result;
}

}  // namespace ricochet
