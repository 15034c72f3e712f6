#pragma once

#include <functional>
#include <memory>
#include <string>

namespace ricochet::reference {

/// y' = f(y), n equations, and root functions, whose downward zero crossings end a step.
class SmoothSystem {
 public:
  virtual ~SmoothSystem() = default;

  virtual int size() const = 0;  ///< n
  virtual int n_roots() const = 0;
  virtual bool rates(const double* y, double* y_dot) = 0;  ///< false if y' is not determined
  virtual bool roots(const double* y, double* values) = 0;
  /// n: reciprocals of the admissible errors of a step in y.
  virtual void error_weights(const double* y, double* weights) const = 0;
};

/// How a step ended. stuck_at_root: a root at the start of the step is still zero, so that no step is possible.
enum class StepEnd { regular, root, stuck_at_root, failed };

/// Integrates a SmoothSystem step by step, with its own choice of steps and its own root finding. One small class per
/// package: cvode.h here, the others in methods/peers/.
class Integrator {
 public:
  /// Work since the last restart.
  struct Work {
    long steps = 0, iterations = 0, factorizations = 0;
  };

  virtual ~Integrator() = default;

  /// n: the state at the end of the last step, and to be filled before a restart.
  virtual double* state() = 0;
  const double* state() const { return const_cast<Integrator*>(this)->state(); }

  /// Restarts without history. @param end  limit of all steps [s]; @param first_step  0: chosen by the integrator [s]
  virtual void restart(double t, double end, double first_step) = 0;
  /// @param t  in: start of the step, out: its end or the root [s]; @param longest  longest step, 0: no limit [s]
  virtual StepEnd step(double& t, double longest) = 0;
  /// Length of the next step [s]; 0 if it is not known yet.
  virtual double planned_step() const = 0;
  /// Whether steps are independent of each other and of high order, so that a step may contain a whole contact mode.
  virtual bool takes_long_steps() const { return false; }
  /// Degree of the polynomials that interpolate within the last step.
  virtual int degree() const = 0;
  /// Derivative of this order, at most degree(), of the polynomials at t in the last step, n; until the next call.
  virtual const double* derivative(double t, int order) = 0;
  /// State at t within the last step, n; valid until the next call.
  const double* at(double t) { return derivative(t, 0); }
  /// The root functions that vanish at the end of the last step. @param found  n_roots, not zero for such a function
  virtual void roots_found(int* found) const = 0;

  virtual Work work() const = 0;
  virtual std::string name() const = 0;     ///< for messages
  virtual std::string failure() const = 0;  ///< why the last step failed, in the words of the package
};

using MakeIntegrator = std::function<std::unique_ptr<Integrator>(SmoothSystem&)>;

}  // namespace ricochet::reference
