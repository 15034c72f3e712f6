#pragma once

#include <optional>
#include <string>

#include "methods/contact_laws/contact_file.h"
#include "methods/contact_laws/contact_observer.h"
#include "methods/contact_laws/solvers/contact_solver.h"

namespace ricochet {

/// Keeps one contact problem of a run, its guess and its solution: the first one of a step, or the first one with the
/// most contacts.
class ContactRecorder final : public ContactObserver {
 public:
  /// @param step  from 0; empty: that with the most contacts
  explicit ContactRecorder(std::optional<std::int64_t> step) : wanted_(step) {}

  void before(std::int64_t step, const ContactProblem& problem, const Vector& guess) override;
  void after(const ContactProblem& problem, const Vector& r, ContactStatus status) override;

  bool found() const { return !stored_.problem.contacts.empty(); }
  std::int64_t step() const { return step_; }  ///< of the problem
  ContactStatus status() const { return status_; }
  /// Its solution is empty where the solver did not find it.
  StoredContactProblem& stored() { return stored_; }

 private:
  std::optional<std::int64_t> wanted_;
  std::int64_t step_ = -1;
  bool is_recording_ = false;
  ContactStatus status_ = ContactStatus::iteration_limit;
  StoredContactProblem stored_;
};

/// What a file says about a problem beside its numbers: how many contacts of which kind, whether W is symmetric.
std::string math_info(const ContactProblem& problem);

}  // namespace ricochet
