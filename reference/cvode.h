#pragma once

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <vector>

namespace ricochet::reference {

/// CVODE's objects, released in the right order.
class Cvode {
 public:
  /// @param formulas  CV_ADAMS or CV_BDF; @param n  unknowns; the root functions are watched for falling through zero
  Cvode(int formulas, int n, void* user_data, CVRhsFn rhs, CVRootFn roots, int n_roots, CVEwtFn error_weights) {
    SUNContext_Create(nullptr, &context_);
    y_ = N_VNew_Serial(n, context_);
    memory_ = CVodeCreate(formulas, context_);
    CVodeInit(memory_, rhs, 0, y_);
    CVodeWFtolerances(memory_, error_weights);
    CVodeSetUserData(memory_, user_data);
    CVodeSetMaxNumSteps(memory_, 10'000'000);
    CVodeSetMaxErrTestFails(memory_, 30);
    CVodeSetErrHandlerFn(
        memory_, [](int, const char*, const char*, char*, void*) {}, nullptr);  // statuses say it
    if (formulas == CV_ADAMS) {
      nonlinear_ = SUNNonlinSol_FixedPoint(y_, 0, context_);
      CVodeSetNonlinearSolver(memory_, nonlinear_);
    } else {
      matrix_ = SUNDenseMatrix(n, n, context_);
      linear_ = SUNLinSol_Dense(y_, matrix_, context_);
      CVodeSetLinearSolver(memory_, linear_, matrix_);
    }
    if (n_roots > 0) {
      CVodeRootInit(memory_, n_roots, roots);
      CVodeSetNoInactiveRootWarn(memory_);
      std::vector<int> falling(static_cast<std::size_t>(n_roots), -1);
      CVodeSetRootDirection(memory_, falling.data());
    }
  }
  ~Cvode() {
    CVodeFree(&memory_);
    if (nonlinear_) SUNNonlinSolFree(nonlinear_);
    if (linear_) SUNLinSolFree(linear_);
    if (matrix_) SUNMatDestroy(matrix_);
    N_VDestroy(y_);
    SUNContext_Free(&context_);
  }
  Cvode(const Cvode&) = delete;
  Cvode& operator=(const Cvode&) = delete;

  void* memory() const { return memory_; }
  N_Vector y() const { return y_; }

 private:
  SUNContext context_ = nullptr;
  N_Vector y_ = nullptr;
  SUNMatrix matrix_ = nullptr;
  SUNLinearSolver linear_ = nullptr;
  SUNNonlinearSolver nonlinear_ = nullptr;
  void* memory_ = nullptr;
};

}  // namespace ricochet::reference
