#pragma once

#include <cstdint>

#include "problems/problem.h"

namespace ricochet {

struct ContactProblem;
enum class ContactStatus;

/// Is shown the contact problems that a time-stepping method meets, TimeSteppingMethod::set_contact_observer().
class ContactObserver {
 public:
  virtual ~ContactObserver() = default;

  /// @param step  from 0; a step may have several contact problems, or none
  /// @param guess  what the solver starts from, G.n_rows() or more
  virtual void before(std::int64_t step, const ContactProblem& problem, const Vector& guess) = 0;
  /// @param r  what the solver ends with
  virtual void after(const ContactProblem& problem, const Vector& r, ContactStatus status) = 0;
};

}  // namespace ricochet
