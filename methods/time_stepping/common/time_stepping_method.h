#pragma once

#include <string>

#include "methods/contact_laws/contact_observer.h"
#include "methods/contact_laws/solvers/contact_solver.h"
#include "methods/method.h"
#include "methods/method_spec.h"

namespace ricochet {

/// A method that solves a contact problem in each step (contact_step.h): everything but the formulas of the individual
/// methods.
class TimeSteppingMethod : public Method {
 public:
  /// Sets the observer of the contact problems of later runs. @param observer  must outlive them; null: none
  void set_contact_observer(ContactObserver* observer) { observer_ = observer; }

 protected:
  /// @param contact_tolerance  of contact solvers that iterate, where the user gives none
  explicit TimeSteppingMethod(const MethodSpec& spec, double contact_tolerance = kContactTolerance)
      : id_(spec.text()), solver_(contact_solver_argument(spec, contact_tolerance)) {}

  const std::string id_;
  const ContactSolverOptions solver_;
  ContactObserver* observer_ = nullptr;
};

}  // namespace ricochet
