#pragma once

#include <functional>
#include <memory>
#include <string>

namespace ricochet::reference {

/// y' = f(y), n equations, and root functions that are watched for falling through zero.
class SmoothSystem {
 public:
  virtual ~SmoothSystem() = default;

  virtual int size() const = 0;  ///< n
  virtual int n_roots() const = 0;
  virtual bool rates(const double* y, double* y_dot) = 0;  ///< false where y' is not determined
  virtual bool roots(const double* y, double* values) = 0;
  /// n: reciprocals of the errors that a step may make in y.
  virtual void error_weights(const double* y, double* weights) const = 0;
};

/// What a step of an Integrator ended with. A root that is where the step begins, and still zero, lets no step pass.
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

  /// Forgets what lies behind. @param end  no step passes it; @param first_step  0 is the integrator's own choice [s]
  virtual void restart(double t, double end, double first_step) = 0;
  /// @param t  in: begin of the step, out: its end or that of the root [s]; @param longest  0 is no limit [s]
  virtual StepEnd step(double& t, double longest) = 0;
  /// Length of the step that it would take next [s]; 0 where it is not decided.
  virtual double planned_step() const = 0;
  /// Steps of high order that know nothing of those before may hold a whole mode of a contact.
  virtual bool takes_long_steps() const { return false; }
  /// Degree of the polynomials by which it interpolates within the last step.
  virtual int degree() const = 0;
  /// Derivative of those polynomials of this order, at most degree(), at t within the last step, n; until the next call.
  virtual const double* derivative(double t, int order) = 0;
  /// State at t within the last step, n; until the next call.
  const double* at(double t) { return derivative(t, 0); }
  /// Which root functions the last step found. @param found  n_roots, not zero where one is
  virtual void roots_found(int* found) const = 0;

  virtual Work work() const = 0;
  virtual std::string name() const = 0;     ///< for messages
  virtual std::string failure() const = 0;  ///< why the last step failed, in the words of the package
};

using MakeIntegrator = std::function<std::unique_ptr<Integrator>(SmoothSystem&)>;

}  // namespace ricochet::reference
