#pragma once

#include <vector>

#include "methods/time_stepping/common/contact_step.h"

namespace ricochet {

/// The direction of friction in space in a step while slip turns. A contact law of the slip velocity at the end of a
/// step, J_t' v+, has friction in the direction of the end: order 1. A shift of the slip velocity,
///
///   s_t = J_t' (v_wanted - v_last),   v_last: the solution without s_t                       (1)
///
/// has it in the direction of J_t' v_wanted. Only contacts that keep sliding have a shift: those whose slip at v_last
/// is larger than kClearly |s_t|. Others may stop within the step, which the law without shift decides.
class TurningSlip {
 public:
  explicit TurningSlip(const ProblemInfo& info) : info_(info) {
    for (int i = 0; i < info.n_c(); ++i) is_any_ = is_any_ || info.contacts[i].n_t == 2;
    for (auto* x : {&change_, &slip_}) x->setZero(info.n_lambda_t);
    difference_.setZero(info.n_q);
  }

  /// Some contact has friction in space.
  bool is_any() const { return is_any_; }

  /// Adds (1) of the active contacts to the shift, n_lambda_t. @return whether there is any
  bool add(const ContactStep& contacts, const Vector& v_wanted, const Vector& v_last, Vector& shift) {
    bool turns = false;
    difference_ = v_wanted - v_last;
    contacts.slip_velocities(difference_, change_);
    contacts.slip_velocities(v_last, slip_);
    for (const int i : contacts.active()) {
      if (info_.contacts[i].n_t < 2) continue;
      const int at = info_.contacts[i].tangent_index;
      const auto change = change_.segment<2>(at);
      if (slip_.segment<2>(at).squaredNorm() <= kClearly * kClearly * change.squaredNorm()) continue;
      shift.segment<2>(at) += change;
      turns = true;
    }
    return turns;
  }

 private:
  static constexpr double kClearly = 2;  // excludes a stop within the next step, too

  const ProblemInfo& info_;
  bool is_any_ = false;
  Vector change_, slip_, difference_;
};

}  // namespace ricochet
