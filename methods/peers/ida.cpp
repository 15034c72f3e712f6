#include <ida/ida.h>

#include "methods/peers/event_located_method.h"
#include "methods/registry.h"
#include "reference/sundials.h"

namespace ricochet {
namespace {

using reference::Integrator;
using reference::SmoothSystem;
using reference::StepEnd;

/// IDA: backward differences of variable order up to 5 in fixed-leading-coefficient form, for
///
///   0 = F(y, y') = y' - f(y)                                                             (6)
///
/// with the contact forces eliminated by (5) of reference/contact_dynamics.h. At t_n, with k steps before it, y' is the
/// derivative of a polynomial through them,
///
///   sum_{i=0}^k alpha_{n,i} y_{n-i} = h_n y_n'                                           (7)
///   (dF/dy + alpha_{n,0} / h_n dF/dy') (y_n^+ - y_n) = -F                                (8)
///
/// (7) in (6) is solved by Newton's method, whose step from y_n to y_n^+ is (8). The DAE itself, with the forces among
/// the unknowns, would change its size with every event, and its forces, of index 2 in the stabilised form, would have
/// to be left out of the error control that locates the events of friction. At events IDA starts anew.
class Ida final : public reference::SundialsIntegrator {
 public:
  explicit Ida(SmoothSystem& system) : SundialsIntegrator(system), y_dot_(N_VClone(y_)) {
    memory_ = IDACreate(context_);
    IDAInit(memory_, residual, 0, y_, y_dot_);
    IDAWFtolerances(memory_, error_weights);
    IDASetUserData(memory_, self());
    IDASetMaxNumSteps(memory_, kMaxSteps);
    IDASetMaxErrTestFails(memory_, kMaxErrorTestFailures);
    IDASetErrHandlerFn(memory_, say_nothing, nullptr);
    make_linear_solver();
    IDASetLinearSolver(memory_, linear_, matrix_);
    if (falling_.empty()) return;
    IDARootInit(memory_, system.n_roots(), roots_of_residual);
    IDASetNoInactiveRootWarn(memory_);
    IDASetRootDirection(memory_, falling_.data());
  }
  ~Ida() override {
    IDAFree(&memory_);
    N_VDestroy(y_dot_);
  }

  void restart(double t, double end, double first_step) override {
    system_.rates(N_VGetArrayPointer(y_), N_VGetArrayPointer(y_dot_));  // where it fails, the first step does
    IDAReInit(memory_, t, y_, y_dot_);
    IDASetStopTime(memory_, end);
    IDASetInitStep(memory_, first_step);
    end_ = end;
  }
  StepEnd step(double& t, double longest) override {
    IDASetMaxStep(memory_, longest);
    IDASetStopTime(memory_, stop_time(t, longest, end_));
    return ended_with(IDASolve(memory_, end_, &t, y_, y_dot_, IDA_ONE_STEP));
  }
  double planned_step() const override {
    double h = 0;
    IDAGetCurrentStep(memory_, &h);
    return h;
  }
  int degree() const override {
    int order = 1;
    IDAGetLastOrder(memory_, &order);
    return order;
  }
  void roots_found(int* found) const override { IDAGetRootInfo(memory_, found); }
  Work work() const override {
    Work work;
    IDAGetNumSteps(memory_, &work.steps);
    IDAGetNumNonlinSolvIters(memory_, &work.iterations);
    IDAGetNumLinSolvSetups(memory_, &work.factorizations);
    return work;
  }
  std::string name() const override { return "IDA"; }

 private:
  static int residual(realtype t, N_Vector y, N_Vector y_dot, N_Vector r, void* self) {
    if (rates(t, y, r, self) != 0) return -1;
    N_VLinearSum(1, y_dot, -1, r, r);  // (1)
    return 0;
  }
  static int roots_of_residual(realtype t, N_Vector y, N_Vector, realtype* values, void* self) {
    return roots(t, y, values, self);
  }

  void interpolate(double t, int order, N_Vector y) override { IDAGetDky(memory_, t, order, y); }
  char* flag_name(int flag) const override { return IDAGetReturnFlagName(flag); }

  void* memory_ = nullptr;
  N_Vector y_dot_ = nullptr;
  double end_ = 0;
};

class IdaWithEvents final : public EventLocatedMethod {
 public:
  explicit IdaWithEvents(const MethodSpec& spec)
      : EventLocatedMethod({.id = spec.text(),
                            .title = "IDA with events",
                            .source = "Hindmarsh et al., ACM TOMS 31 (2005)",
                            .order_smooth = 5,
                            .order_impacts = 5,
                            .is_adaptive = true},
                           [](SmoothSystem& system) { return std::make_unique<Ida>(system); }) {}
};

const bool registered = register_method<IdaWithEvents>({
    .name = "ida",
    .usage = "ida, with --tolerance",
    .summary = "SUNDIALS IDA, restarted at events that its root finding locates",
    .examples = {"ida"},
});

}  // namespace
}  // namespace ricochet
