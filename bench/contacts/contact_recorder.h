#pragma once

#include <optional>
#include <string>

#include "methods/contact_laws/contact_file.h"
#include "methods/contact_laws/contact_observer.h"
#include "methods/contact_laws/solvers/contact_solver.h"

namespace ricochet {

/// Records one contact problem of a run with its guess and its solution: the first one of a given step, or the first
/// one with the most contacts.
class ContactRecorder final : public ContactObserver {
 public:
  /// @param step  from 0; empty: the step with the most contacts
  explicit ContactRecorder(std::optional<std::int64_t> step) : wanted_(step) {}

  void before(std::int64_t step, const ContactProblem& problem, const Vector& guess) override;
  void after(const ContactProblem& problem, const Vector& r, ContactStatus status) override;

  bool found() const { return !stored_.problem.contacts.empty(); }
  std::int64_t step() const { return step_; }  ///< of the problem
  ContactStatus status() const { return status_; }
  /// The problem; its solution is empty if the solver failed.
  StoredContactProblem& stored() { return stored_; }

 private:
  std::optional<std::int64_t> wanted_;
  std::int64_t step_ = -1;
  bool is_recording_ = false;
  ContactStatus status_ = ContactStatus::iteration_limit;
  StoredContactProblem stored_;
};

/// Description of a problem in a file: the number of contacts of each kind, and whether W is symmetric.
std::string math_info(const ContactProblem& problem);

}  // namespace ricochet
