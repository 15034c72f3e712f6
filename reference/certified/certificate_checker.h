#pragma once

#include <memory>
#include <stdexcept>

#include "reference/certified/certificate.h"
#include "reference/certified/decisions.h"

/// @file
/// CertificateChecker: verifies statements (1) to (7) of a Certificate, step after step.

namespace ricochet::reference::certified {

/// A statement of a certificate is not verified.
struct Refused : std::runtime_error {
  using std::runtime_error::runtime_error;  ///< With the inequality that does not hold.
};

/// Follows the steps of a certificate. It searches for nothing: no length of a step, no time of an event, no precision.
/// It computes with kMoreBits more bits than the certificate states.
class CertificateChecker {
 public:
  /// Reads the scene of a `certificate`, which must outlive the checker. @throws InputError, Refused, Unsupported
  CertificateChecker(const Certificate& certificate, const TimeLimit& limit);

  /// Verifies everything. @throws Refused, Undecided, Unsupported, OutOfTime
  void run();
  int step() const { return step_; }  ///< The step that is being verified; -1 before the first one.

  static constexpr long kMoreBits = 32;  ///< of the checker

 private:
  // Beginning and end.
  void begin();
  void assume(const std::string& what);
  void check_end();
  void require_number(const CertifiedNumber& number, const Ball& ball, const std::string& what) const;

  // Steps.
  void enter(const CertifiedStep& stated);
  void take(const CertifiedStep& stated);
  void require_remainders(const ModeMotion& motion, const CertifiedStep& stated);
  void require_no_event(const ModeMotion& motion, const CertifiedStep& stated, const Ball& end,
                        const EventFunction* expected);
  int vanishing(const EventFunction& event) const;

  // Events.
  const CertificateEvent* event_at_end_of(int step) const;
  const EventFunction* function_of(const CertificateEvent& event, const ModeMotion& motion) const;
  void apply(const EventFunction& function, const CertificateEvent& stated);
  void require_impulses(const ImpactOutcome& outcome, const CertificateEvent& stated) const;
  void require_event(const CertificateEvent& stated, const std::string& kind, const std::string& contact) const;

  const Certificate& certificate_;
  const TimeLimit& limit_;
  std::unique_ptr<Problem> problem_;
  SeriesProgram p_;
  SceneFormulas scene_;
  TaylorStep taylor_;
  Decisions decisions_;
  ContactStates states_;
  ModeMotion motion_;  ///< of the step; its pivots are those at the last event
  bool modes_are_new_ = true;
  std::vector<Ball> x_;  ///< where the motion is, by what is verified
  Ball t_;               ///< when
  std::vector<std::string> assumptions_;
  int step_ = -1;
};

/// Reads a ball as Arb dumps it. @throws InputError
Ball ball_of_text(const std::string& text);
/// The number that a certificate states of a ball, with the `digits` that were wanted.
CertifiedNumber stated_number(const Ball& ball, int digits);

}  // namespace ricochet::reference::certified
