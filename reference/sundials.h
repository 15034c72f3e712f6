#pragma once

#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "reference/integrator.h"

namespace ricochet::reference {

/// Common part of the packages of SUNDIALS: objects, released in the right order, the functions that they call, and
/// flags.
class SundialsIntegrator : public Integrator {
 public:
  SundialsIntegrator(const SundialsIntegrator&) = delete;
  SundialsIntegrator& operator=(const SundialsIntegrator&) = delete;
  ~SundialsIntegrator() override {
    if (linear_) SUNLinSolFree(linear_);
    if (matrix_) SUNMatDestroy(matrix_);
    N_VDestroy(within_);
    N_VDestroy(y_);
    SUNContext_Free(&context_);
  }

  using Integrator::state;
  double* state() final { return N_VGetArrayPointer(y_); }
  const double* derivative(double t, int order) final {
    interpolate(t, order, within_);
    return N_VGetArrayPointer(within_);
  }
  std::string failure() const final {
    const std::unique_ptr<char, decltype(&std::free)> text(flag_name(flag_), &std::free);
    return text.get();
  }

 protected:
  // Limits that only endless runs reach; the event-located run has its own.
  static constexpr long kMaxSteps = 10'000'000;
  static constexpr int kMaxErrorTestFailures = 30;

  explicit SundialsIntegrator(SmoothSystem& system) : system_(system), falling_(system.n_roots(), -1) {
    SUNContext_Create(nullptr, &context_);
    y_ = N_VNew_Serial(system.size(), context_);
    within_ = N_VClone(y_);
  }

  virtual void interpolate(double t, int order, N_Vector y) = 0;
  virtual char* flag_name(int flag) const = 0;

  void make_linear_solver() {
    matrix_ = SUNDenseMatrix(system_.size(), system_.size(), context_);
    linear_ = SUNLinSol_Dense(y_, matrix_, context_);
  }

  /// Time at which the next step must stop. Its length was chosen before, and the packages apply a limit only to later
  /// steps. @param longest  longest next step [s]; 0: no limit
  double stop_time(double t, double longest, double end) const {
    return longest > 0 && planned_step() > longest ? std::min(end, t + longest) : end;
  }
  /// Flags with the same meaning in all packages.
  StepEnd ended_with(int flag) {
    constexpr int kRootReturn = 2, kIllInput = -22;
    flag_ = flag;
    return flag == kRootReturn ? StepEnd::root
           : flag >= 0         ? StepEnd::regular
           : flag == kIllInput ? StepEnd::stuck_at_root
                               : StepEnd::failed;
  }

  static int rates(realtype, N_Vector y, N_Vector y_dot, void* self) {
    return system(self).rates(N_VGetArrayPointer(y), N_VGetArrayPointer(y_dot)) ? 0 : -1;
  }
  static int roots(realtype, N_Vector y, realtype* values, void* self) {
    return system(self).roots(N_VGetArrayPointer(y), values) ? 0 : -1;
  }
  static int error_weights(N_Vector y, N_Vector weights, void* self) {
    system(self).error_weights(N_VGetArrayPointer(y), N_VGetArrayPointer(weights));
    return 0;
  }
  /// Discards messages: a status reports the failure.
  static void say_nothing(int, const char*, const char*, char*, void*) {}

  static SmoothSystem& system(void* self) { return static_cast<SundialsIntegrator*>(self)->system_; }
  /// The user data of those functions.
  void* self() { return this; }

  SmoothSystem& system_;
  std::vector<int> falling_;  // direction of every root function
  SUNContext context_ = nullptr;
  N_Vector y_ = nullptr, within_ = nullptr;
  SUNMatrix matrix_ = nullptr;
  SUNLinearSolver linear_ = nullptr;
  int flag_ = 0;
};

}  // namespace ricochet::reference
