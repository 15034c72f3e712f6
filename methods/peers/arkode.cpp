#include <arkode/arkode_arkstep.h>
#include <fmt/format.h>

#include "methods/peers/event_located_method.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reference/sundials.h"

namespace ricochet {
namespace {

using reference::Integrator;
using reference::SmoothSystem;
using reference::StepEnd;

// Hermite polynomials through the ends of a step, the highest degree of ARKODE: its dense output and root finding.
constexpr int kInterpolantDegree = ARK_INTERP_MAX_DEGREE;

// Between which root functions are looked at: a step of high order may hold the whole time that a block slips.
constexpr int kPieces = 4;

// Tables by order: ARKODE's defaults, but the pair of Dormand and Prince, and the newest of Kennedy and Carpenter, whose
// error is a hundredth of that of the default, ARK5(4)8L[2]SA, at twice the work.
template <class Table>
struct Pair {
  int order;
  Table table;
};
constexpr Pair<ARKODE_ERKTableID> kExplicit[] = {{2, ARKODE_HEUN_EULER_2_1_2}, {3, ARKODE_BOGACKI_SHAMPINE_4_2_3},
                                                 {4, ARKODE_ZONNEVELD_5_3_4},  {5, ARKODE_DORMAND_PRINCE_7_4_5},
                                                 {6, ARKODE_VERNER_8_5_6},     {8, ARKODE_FEHLBERG_13_7_8}};
constexpr Pair<ARKODE_DIRKTableID> kImplicit[] = {{2, ARKODE_SDIRK_2_1_2},
                                                  {3, ARKODE_ARK324L2SA_DIRK_4_2_3},
                                                  {4, ARKODE_SDIRK_5_3_4},
                                                  {5, ARKODE_ESDIRK547L2SA2_7_4_5}};

/// The table of an order. @throws InputError where there is none
template <class Table, std::size_t n>
Pair<Table> find(const Pair<Table> (&pairs)[n], const std::string& family, const std::string& order) {
  std::string known;
  for (const auto& pair : pairs) {
    if (order == std::to_string(pair.order)) return pair;
    known += (known.empty() ? "" : ", ") + std::to_string(pair.order);
  }
  throw InputError("arkode:" + family + ": order", order, "one of " + known + " is required");
}

/// ARKStep, with everything explicit, or everything implicit and Newton's method with a dense matrix of difference
/// quotients. Not ERKStep: SUNDIALS 6.4 takes every pair whose last abscissa is 1 for one that has the derivative at the
/// end of the step in its last stage, so that those of Verner and Fehlberg lose their order.
class ArkStep final : public reference::SundialsIntegrator {
 public:
  /// One of the tables is none.
  ArkStep(ARKODE_ERKTableID explicit_table, ARKODE_DIRKTableID implicit_table, SmoothSystem& system)
      : SundialsIntegrator(system), is_explicit_(implicit_table == ARKODE_DIRK_NONE) {
    memory_ = ARKStepCreate(explicit_rates(), implicit_rates(), 0, y_, context_);
    ARKStepSetTableNum(memory_, implicit_table, explicit_table);
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
    ARKStepRootInit(memory_, system.n_roots(), roots);
    ARKStepSetNoInactiveRootWarn(memory_);
    ARKStepSetRootDirection(memory_, falling_.data());
  }
  ~ArkStep() override { ARKStepFree(&memory_); }

  void restart(double t, double end, double first_step) override {
    ARKStepReInit(memory_, explicit_rates(), implicit_rates(), t, y_);
    ARKStepSetStopTime(memory_, end);
    ARKStepSetInitStep(memory_, first_step);
    end_ = end;
  }
  StepEnd step(double& t, double longest) override {
    ARKStepSetMaxStep(memory_, longest);
    return ended_with(ARKStepEvolve(memory_, end_, y_, &t, ARK_ONE_STEP));
  }
  int pieces() const override { return kPieces; }
  void roots_found(int* found) const override { ARKStepGetRootInfo(memory_, found); }
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
  ARKRhsFn explicit_rates() const { return is_explicit_ ? rates : nullptr; }
  ARKRhsFn implicit_rates() const { return is_explicit_ ? nullptr : rates; }
  void interpolate(double t, N_Vector y) override { ARKStepGetDky(memory_, t, 0, y); }
  char* flag_name(int flag) const override { return ARKStepGetReturnFlagName(flag); }

  const bool is_explicit_;
  void* memory_ = nullptr;
  double end_ = 0;
};

class ArkodeWithEvents final : public EventLocatedMethod {
 public:
  explicit ArkodeWithEvents(const MethodSpec& spec) : ArkodeWithEvents(spec, choice_of(spec)) {}

 private:
  struct Choice {
    std::string family;
    int order;
    reference::MakeIntegrator integrator;
  };

  ArkodeWithEvents(const MethodSpec& spec, const Choice& choice)
      : EventLocatedMethod({.id = spec.text(),
                            .title = fmt::format("ARKODE {} of order {} with events", choice.family, choice.order),
                            .source = "Reynolds et al., ACM TOMS 49 (2023)",
                            .order_smooth = static_cast<double>(choice.order),
                            .order_impacts = static_cast<double>(choice.order),
                            .is_adaptive = true},
                           choice.integrator) {}

  static Choice choice_of(const MethodSpec& spec) {
    const auto& arguments = spec.arguments();
    const std::string family = arguments.empty() ? "erk" : arguments[0];
    if (family != "erk" && family != "dirk") throw InputError("arkode: family", family, "one of erk, dirk is required");
    const auto integrator = [](ARKODE_ERKTableID explicit_table, ARKODE_DIRKTableID implicit_table) {
      return [=](SmoothSystem& system) { return std::make_unique<ArkStep>(explicit_table, implicit_table, system); };
    };
    if (family == "erk") {
      const auto pair = find(kExplicit, family, arguments.size() < 2 ? "8" : arguments[1]);
      return {family, pair.order, integrator(pair.table, ARKODE_DIRK_NONE)};
    }
    const auto pair = find(kImplicit, family, arguments.size() < 2 ? "5" : arguments[1]);
    return {family, pair.order, integrator(ARKODE_ERK_NONE, pair.table)};
  }
};

const bool registered = register_method<ArkodeWithEvents>({
    .name = "arkode",
    .usage = "arkode:erk:ORDER (2, 3, 4, 5, 6, 8) or arkode:dirk:ORDER (2 to 5), with --tolerance",
    .max_arguments = 2,
    .summary = "SUNDIALS ARKODE, Runge-Kutta pairs restarted at events that its root finding locates",
    .examples = {"arkode:erk:5", "arkode:erk:8", "arkode:dirk:5"},
});

}  // namespace
}  // namespace ricochet
