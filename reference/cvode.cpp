#include "reference/cvode.h"

#include <cvode/cvode.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include "reference/sundials.h"

namespace ricochet::reference {
namespace {

class Cvode final : public SundialsIntegrator {
 public:
  /// @param formulas  CV_ADAMS or CV_BDF
  Cvode(int formulas, SmoothSystem& system) : SundialsIntegrator(system) {
    memory_ = CVodeCreate(formulas, context_);
    CVodeInit(memory_, rates, 0, y_);
    CVodeWFtolerances(memory_, error_weights);
    CVodeSetUserData(memory_, self());
    CVodeSetMaxNumSteps(memory_, kMaxSteps);
    CVodeSetMaxErrTestFails(memory_, kMaxErrorTestFailures);
    CVodeSetErrHandlerFn(memory_, say_nothing, nullptr);
    if (formulas == CV_ADAMS) {
      nonlinear_ = SUNNonlinSol_FixedPoint(y_, 0, context_);
      CVodeSetNonlinearSolver(memory_, nonlinear_);
    } else {
      make_linear_solver();
      CVodeSetLinearSolver(memory_, linear_, matrix_);
    }
    if (falling_.empty()) return;
    CVodeRootInit(memory_, system.n_roots(), roots);
    CVodeSetNoInactiveRootWarn(memory_);
    CVodeSetRootDirection(memory_, falling_.data());
  }
  ~Cvode() override {
    CVodeFree(&memory_);
    if (nonlinear_) SUNNonlinSolFree(nonlinear_);
  }

  void restart(double t, double end, double first_step) override {
    CVodeReInit(memory_, t, y_);
    CVodeSetStopTime(memory_, end);
    CVodeSetInitStep(memory_, first_step);
    end_ = end;
  }
  StepEnd step(double& t, double longest) override {
    CVodeSetMaxStep(memory_, longest);
    CVodeSetStopTime(memory_, stop_time(t, longest, end_));
    return ended_with(CVode(memory_, end_, y_, &t, CV_ONE_STEP));
  }
  double planned_step() const override {
    double h = 0;
    CVodeGetCurrentStep(memory_, &h);
    return h;
  }
  int degree() const override {
    int order = 1;
    CVodeGetLastOrder(memory_, &order);
    return order;
  }
  void roots_found(int* found) const override { CVodeGetRootInfo(memory_, found); }
  Work work() const override {
    Work work;
    CVodeGetNumSteps(memory_, &work.steps);
    CVodeGetNumNonlinSolvIters(memory_, &work.iterations);
    if (linear_) CVodeGetNumLinSolvSetups(memory_, &work.factorizations);
    return work;
  }
  std::string name() const override { return "CVODE"; }

 private:
  void interpolate(double t, int order, N_Vector y) override { CVodeGetDky(memory_, t, order, y); }
  char* flag_name(int flag) const override { return CVodeGetReturnFlagName(flag); }

  void* memory_ = nullptr;
  SUNNonlinearSolver nonlinear_ = nullptr;
  double end_ = 0;
};

}  // namespace

std::unique_ptr<Integrator> adams(SmoothSystem& system) {
  return std::make_unique<Cvode>(CV_ADAMS, system);
}

std::unique_ptr<Integrator> bdf(SmoothSystem& system) {
  return std::make_unique<Cvode>(CV_BDF, system);
}

}  // namespace ricochet::reference
