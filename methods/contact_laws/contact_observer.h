#pragma once

#include <cstdint>

#include "problems/problem.h"

namespace ricochet {

struct ContactProblem;
enum class ContactStatus;

/// Observer of the contact problems of a time-stepping method, see TimeSteppingMethod::set_contact_observer().
class ContactObserver {
 public:
  virtual ~ContactObserver() = default;

  /// @param step  from 0; a step may have several contact problems, or none
  /// @param guess  start of the solver, G.n_rows() or more
  virtual void before(std::int64_t step, const ContactProblem& problem, const Vector& guess) = 0;
  /// @param r  result of the solver
  virtual void after(const ContactProblem& problem, const Vector& r, ContactStatus status) = 0;
};

}  // namespace ricochet
