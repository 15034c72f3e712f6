#include <arkode/arkode_arkstep.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "methods/peers/event_located_method.h"
#include "methods/registry.h"
#include "methods/runge_kutta/embedded_tableau.h"
#include "problems/input_error.h"
#include "reference/sundials.h"

namespace ricochet {
namespace {

using reference::Integrator;
using reference::SmoothSystem;
using reference::StepEnd;

// Degree of ARKODE's Hermite polynomials through the ends of a step, its highest: for dense output and root finding.
constexpr int kInterpolantDegree = ARK_INTERP_MAX_DEGREE;

/// Tables by order: ARKODE's defaults, but for order 5 the pair of Dormand and Prince, and the newest of Kennedy and
/// Carpenter, whose error is a hundredth of that of the default, ARK5(4)8L[2]SA, at twice the work.
template <class Table>
using TablesByOrder = std::map<int, Table>;

const TablesByOrder<ARKODE_ERKTableID>& explicit_tables() {
  static const TablesByOrder<ARKODE_ERKTableID> tables = {
      {2, ARKODE_HEUN_EULER_2_1_2},     {3, ARKODE_BOGACKI_SHAMPINE_4_2_3}, {4, ARKODE_ZONNEVELD_5_3_4},
      {5, ARKODE_DORMAND_PRINCE_7_4_5}, {6, ARKODE_VERNER_8_5_6},           {8, ARKODE_FEHLBERG_13_7_8}};
  return tables;
}

const TablesByOrder<ARKODE_DIRKTableID>& implicit_tables() {
  static const TablesByOrder<ARKODE_DIRKTableID> tables = {{2, ARKODE_SDIRK_2_1_2},
                                                           {3, ARKODE_ARK324L2SA_DIRK_4_2_3},
                                                           {4, ARKODE_SDIRK_5_3_4},
                                                           {5, ARKODE_ESDIRK547L2SA2_7_4_5}};
  return tables;
}

/// "2, 3, 4"
template <class Table>
std::string orders(const TablesByOrder<Table>& tables) {
  std::vector<int> list;
  for (const auto& [order, table] : tables) list.push_back(order);
  return fmt::format("{}", fmt::join(list, ", "));
}

using ButcherTable = std::shared_ptr<ARKodeButcherTableMem>;

ButcherTable owned(ARKodeButcherTable table) {
  return {table, ARKodeButcherTable_Free};
}

/// One of our pairs for ARKODE. @throws InputError for one with two estimates, which ARKODE does not know
ButcherTable table_of(const EmbeddedTableau& pair) {
  if (pair.e_2.size() > 0) throw InputError("arkode:erk: pair", pair.id, "a pair with one error estimate is required");
  ButcherTable table = owned(ARKodeButcherTable_Alloc(pair.n_s, 1));
  table->q = pair.order;
  table->p = pair.error_order;
  for (int i = 0; i < pair.n_s; ++i) {
    for (int j = 0; j < pair.n_s; ++j) table->A[i][j] = pair.A(i, j);
    table->b[i] = pair.b[i];
    table->c[i] = pair.c[i];
    table->d[i] = pair.b[i] - pair.e[i];
  }
  return table;
}

/// ARKStep, with everything explicit, or everything implicit and Newton's method with a dense matrix of difference
/// quotients. Not ERKStep: SUNDIALS 6.4 takes every pair whose last abscissa is 1 for one that has the derivative at the
/// end of the step in its last stage, so that those of Verner and Fehlberg lose their order.
class ArkStep final : public reference::SundialsIntegrator {
 public:
  ArkStep(const ARKodeButcherTableMem& table, bool is_explicit, SmoothSystem& system)
      : SundialsIntegrator(system),
        is_explicit_(is_explicit),
        degree_(std::min(kInterpolantDegree, std::max(1, table.q))),
        before_(N_VClone(y_)),
        y_dot_(N_VClone(y_)),
        found_(falling_.size(), 0),
        values_(falling_.size(), 0) {
    memory_ = ARKStepCreate(explicit_rates(), implicit_rates(), 0, y_, context_);
    const auto copied = const_cast<ARKodeButcherTable>(&table);
    ARKStepSetTables(memory_, table.q, table.p, is_explicit ? nullptr : copied, is_explicit ? copied : nullptr);
    ARKStepSetInterpolantType(memory_, ARK_INTERP_HERMITE);
    ARKStepSetInterpolantDegree(memory_, kInterpolantDegree);
    ARKStepWFtolerances(memory_, error_weights);
    ARKStepSetUserData(memory_, self());
    ARKStepSetMaxNumSteps(memory_, kMaxSteps);
    ARKStepSetMaxErrTestFails(memory_, kMaxErrorTestFailures);
    ARKStepSetErrHandlerFn(memory_, say_nothing, nullptr);
    if (!is_explicit_) {
      make_linear_solver();
      ARKStepSetLinearSolver(memory_, linear_, matrix_);
      // The rate of convergence that ARKODE keeps from stage to stage vanishes where the equations are linear, and then
      // it accepts the first iterate, whatever its Jacobian. With this factor a correction has to be below the tolerance.
      ARKStepSetNonlinCRDown(memory_, 1);
    }
    if (falling_.empty()) return;
    ARKStepRootInit(memory_, system_.n_roots(), watched_roots);
    ARKStepSetNoInactiveRootWarn(memory_);
    ARKStepSetRootDirection(memory_, falling_.data());
  }
  ~ArkStep() override {
    ARKStepFree(&memory_);
    for (const N_Vector y : {before_, y_dot_}) N_VDestroy(y);
  }

  void restart(double t, double end, double first_step) override {
    ARKStepReInit(memory_, explicit_rates(), implicit_rates(), t, y_);
    ARKStepSetStopTime(memory_, end);
    ARKStepSetInitStep(memory_, first_step);
    end_ = end;
    is_repeated_ = false;
  }
  StepEnd step(double& t, double longest) override {
    ARKStepSetMaxStep(memory_, longest);
    if (is_repeated_) begin_at(t, end_);  // its root functions were not watched
    ARKStepSetStopTime(memory_, stop_time(t, longest, end_));
    is_repeated_ = false;
    begin_ = t;
    N_VScale(1, y_, before_);
    const StepEnd end = ended_with(ARKStepEvolve(memory_, end_, y_, &t, ARK_ONE_STEP));
    return end == StepEnd::root ? step_to_root(t) : end;
  }
  double planned_step() const override {
    double h = 0;
    ARKStepGetCurrentStep(memory_, &h);
    return h;
  }
  bool takes_long_steps() const override { return true; }
  int degree() const override { return degree_; }
  void roots_found(int* found) const override { std::ranges::copy(found_, found); }
  Work work() const override {
    Work work;
    ARKStepGetNumSteps(memory_, &work.steps);
    if (is_explicit_) return work;
    ARKStepGetNumNonlinSolvIters(memory_, &work.iterations);
    ARKStepGetNumLinSolvSetups(memory_, &work.factorizations);
    return work;
  }
  std::string name() const override { return "ARKODE"; }

 private:
  static int watched_roots(realtype t, N_Vector y, realtype* values, void* self) {
    const auto& step = static_cast<const ArkStep&>(*static_cast<SundialsIntegrator*>(self));
    if (!step.is_repeated_) return roots(t, y, values, self);
    std::fill_n(values, step.found_.size(), 1.0);
    return 0;
  }

  void begin_at(double t, double end) {
    ARKStepReset(memory_, t, y_);
    ARKStepSetStopTime(memory_, end);
  }

  /// Takes the step once more, to the root instead of past it, and Newton's method for where that is: ARKODE's own root
  /// is one of its dense output, whose degree is too low for pairs of high order. @param t  of that root, then better
  StepEnd step_to_root(double& t) {
    ARKStepGetRootInfo(memory_, found_.data());
    const auto k = std::ranges::find_if(found_, [](int is_found) { return is_found != 0; }) - found_.begin();
    const double length = t - begin_, seen = t;
    is_repeated_ = true;
    for (int repetition = 0; repetition < kRepetitions; ++repetition) {
      double reached = begin_;
      N_VScale(1, before_, y_);
      begin_at(begin_, t);
      const StepEnd end = ended_with(ARKStepEvolve(memory_, t, y_, &reached, ARK_ONE_STEP));
      if (end == StepEnd::failed || reached < t) {  // cut short by the error test, before the root
        t = reached;
        return end;
      }
      const double change = newton_step(static_cast<std::size_t>(k), length);
      const bool is_near = std::abs(t + change - seen) <= kNear * length;  // else nothing that dense output saw
      if (!is_near || std::abs(change) <= kRounding * length || repetition + 1 == kRepetitions) break;
      t += change;
    }
    return StepEnd::root;
  }

  /// Newton step for root function k along the motion. @param length  of the step [s]
  double newton_step(std::size_t k, double length) {
    constexpr double kDifference = 1e-6;  // of the step: three digits of the slope are plenty
    if (!system_.roots(state(), values_.data()) || !system_.rates(state(), N_VGetArrayPointer(y_dot_))) return NAN;
    const double value = values_[k];
    N_VLinearSum(1, y_, kDifference * length, y_dot_, y_dot_);
    if (!system_.roots(N_VGetArrayPointer(y_dot_), values_.data())) return NAN;
    return -value * kDifference * length / (values_[k] - value);
  }

  ARKRhsFn explicit_rates() const { return is_explicit_ ? rates : nullptr; }
  ARKRhsFn implicit_rates() const { return is_explicit_ ? nullptr : rates; }
  void interpolate(double t, int order, N_Vector y) override { ARKStepGetDky(memory_, t, order, y); }
  char* flag_name(int flag) const override { return ARKStepGetReturnFlagName(flag); }

  // Limits of a step: repetitions to its root; rounding and error of dense output, relative to its length.
  static constexpr int kRepetitions = 4;
  static constexpr double kRounding = 1e-14, kNear = 0.1;

  const bool is_explicit_;
  const int degree_;  // of its dense output
  void* memory_ = nullptr;
  N_Vector before_, y_dot_;  // state at the begin of the step
  double begin_ = 0, end_ = 0;
  bool is_repeated_ = false;  // the last step was taken to its root
  std::vector<int> found_;
  std::vector<double> values_;  // of the root functions
};

/// ARKODE, Runge-Kutta pairs with error control, on the equations of motion between events, y' = f(y) with y = (q, v).
/// Their forces are (5) of reference/contact_dynamics.h. A step of length h from y_n has the stages
///
///   z_i = y_n + h sum_j A_ij f(z_j)                                                                     (6)
///   y_{n+1} = y_n + h sum_i b_i f(z_i),   e = h sum_i (b_i - b^_i) f(z_i)                               (7)
///
/// with j < i of an explicit pair, and j <= i of an implicit one, for which Newton's method with difference quotients
/// solves (6). The step is accepted where the root mean square over the n unknowns, s_i their tolerances, is
///
///   sqrt(1/n sum_i (e_i / s_i)^2) <= 1                                                                  (8)
///
/// An event is a root of a function g(y), a gap, a force, a slip velocity. Where its dense output has passed one, the
/// step is taken again to the root instead of past it, and Newton's method corrects where that is,
///
///   t <- t - g / g'                                                                                     (9)
///
/// then the laws of an instant give the velocities and modes after it, and ARKODE starts anew.
class ArkodeWithEvents final : public EventLocatedMethod {
 public:
  explicit ArkodeWithEvents(const MethodSpec& spec) : ArkodeWithEvents(spec, choice_of(spec)) {}

 private:
  struct Choice {
    bool is_explicit;
    ButcherTable table;
  };

  ArkodeWithEvents(const MethodSpec& spec, const Choice& choice)
      : EventLocatedMethod({.id = spec.text(),
                            .title = fmt::format("ARKODE, {} pair of order {}({}), with events",
                                                 choice.is_explicit ? "explicit" : "diagonally implicit",
                                                 choice.table->q, choice.table->p),
                            .source = "Reynolds et al., ACM TOMS 49 (2023)",
                            .order_smooth = static_cast<double>(choice.table->q),
                            .order_impacts = static_cast<double>(choice.table->q),
                            .is_adaptive = true},
                           [choice](SmoothSystem& system) {
                             return std::make_unique<ArkStep>(*choice.table, choice.is_explicit, system);
                           }) {}

  static Choice choice_of(const MethodSpec& spec) {
    const auto& arguments = spec.arguments();
    const std::string family = arguments.empty() ? "erk" : arguments[0];
    const std::string which = arguments.size() < 2 ? "5" : arguments[1];
    if (family == "erk") {
      if (const auto table = find(explicit_tables(), which)) return {true, owned(ARKodeButcherTable_LoadERK(*table))};
      if (std::ranges::count(embedded_tableau_names(), which) > 0) return {true, table_of(embedded_tableau(which))};
      throw InputError("arkode:erk: pair", which,
                       fmt::format("an order, one of {}, or a pair, one of {}, is required", orders(explicit_tables()),
                                   fmt::join(embedded_tableau_names(), ", ")));
    }
    if (family != "dirk") throw InputError("arkode: family", family, "one of erk, dirk is required");
    if (const auto table = find(implicit_tables(), which)) return {false, owned(ARKodeButcherTable_LoadDIRK(*table))};
    throw InputError("arkode:dirk: order", which, fmt::format("one of {} is required", orders(implicit_tables())));
  }

  template <class Table>
  static std::optional<Table> find(const TablesByOrder<Table>& tables, const std::string& order) {
    for (const auto& [known, table] : tables) {
      if (order == std::to_string(known)) return table;
    }
    return std::nullopt;
  }
};

const bool registered = register_method<ArkodeWithEvents>({
    .name = "arkode",
    .usage =
        "arkode:erk:ORDER (2, 3, 4, 5, 6, 8) or :PAIR (of event_driven), arkode:dirk:ORDER (2 to 5), with --tolerance",
    .max_arguments = 2,
    .summary = "SUNDIALS ARKODE, Runge-Kutta pairs restarted at events that its root finding locates",
    .examples = {"arkode:erk:5", "arkode:erk:8", "arkode:erk:prince-dormand-8-7", "arkode:dirk:5"},
});

}  // namespace
}  // namespace ricochet
