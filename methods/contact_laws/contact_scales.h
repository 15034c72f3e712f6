#pragma once

#include <algorithm>
#include <limits>

#include "problems/packed_column.h"
#include "problems/problem.h"

namespace ricochet {

/// Bounds below which quantities of a contact count as zero. A quantity is zero if it is no larger than the rounding
/// errors of its terms. It is compared with a size that does not vanish with it: per contact, the largest value so far
/// in a run of
///
///   gap       |J_n|' |q| + H (2),   at the start of a run H^2 |J_n|' |w|, and the distance that a
///             surface moves by itself, whose terms cancel in the gap but are not in J_n               [m]   (1)
///   approach  |J_n|' |v|, |J_n|' p, h lambda_n G_nn,   at the start of a run H |J_n|' |w|           [m/s]   (2)
///   slip      |J_t|' |v|, |J_t|' p + mu Lambda_n G_tt,   at the start of a run
///             H (|J_t|' |w| + mu (4) G_tt)                                                          [m/s]   (3)
///   force     lambda_n, |J_n|' |w| / G_nn                                                           [N]     (4)
///
/// with v before and after an impact, p the velocities of its impulses, which may cancel, w the acceleration by the load
/// alone, H the length of the step, G_nn = J_n' M^-1 J_n and G_tt the larger J_t' M^-1 J_t of the contact. So a body at
/// rest is compared with the motion that brought it there, or with the motion that its load would cause. Only coordinates
/// in the support of the contact enter: bodies elsewhere and other units change nothing.
class ContactScales {
 public:
  explicit ContactScales(const Problem& problem);

  /// Starts a new run: discards all records.
  void restart();
  /// Sets delta / (1) of capture_height(). 0: groups are not captured.
  void set_capture(double relative_height) { set_capture(relative_height, 0, 0); }
  /// Sets delta itself, the same for all contacts. @param tolerance  relative, of positions
  /// @param relative  height / (1), the largest
  void set_capture(double tolerance, double height, double relative) {
    relative_height_ = tolerance;
    height_ = height;
    redundant_ = kRedundantHeights * std::max(tolerance, relative);
  }
  /// (1) at the left end of a step of length H. @param is_first  of a run
  void begin_step(const double* q, const double* v, double H, bool is_first);
  /// Records a contact that touches. @param J_n  packed; a curved contact may have other entries than where the run
  /// began
  /// @param G_nn, G_tt  of (2), (3)
  void record_contact(int contact, const double* J_n, double G_nn, double G_tt);

  void record_approach(int contact, double speed) {
    raise(approach_[contact], speed);
    raise(gap_[contact], H_ * speed);
  }
  void record_slip(int contact, double speed) { raise(slip_[contact], speed); }
  void record_force(int contact, double force) { raise(force_[contact], force); }

  double gap(int contact) const { return gap_[contact]; }
  double approach(int contact) const { return approach_[contact]; }
  double slip(int contact) const { return slip_[contact]; }
  double force(int contact) const { return force_[contact]; }

  /// Largest gap that counts as closed: a few dozen additions of numbers of the size of q.
  double touching(int contact) const { return kGapRounding * gap_[contact]; }
  /// Largest gap of a contact that its equation keeps closed: rounding accumulates over many steps (StageEquations
  /// removes it from 1e-13 on). A flight that is no higher cannot be followed.
  double nearly_touching(int contact) const { return kClosedGapRounding * gap_[contact]; }
  /// delta of group_rest.h: bounces of a group that are no higher count as rest [m].
  double capture_height(int contact) const { return height_ > 0 ? height_ : relative_height_ * gap_[contact]; }
  /// Largest part of their terms by which equations of redundant contacts may differ: a group at rest holds its gaps up
  /// to the tolerance, so that they depend on each other up to that, too.
  double redundant() const { return redundant_; }
  /// The gap that rounding of positions of size 1 + |q| makes, the size that tolerances are relative to. @param J_n  packed
  static double of_positions(const ContactInfo& contact, const double* J_n, const Vector& q) {
    return kGapRounding * packed_terms(contact, J_n + contact.normal_begin, 1 + q.array().abs());
  }
  /// Largest normal velocity at the left end of an element that counts as zero.
  double no_approach(int contact) const { return kVelocityRounding * approach_[contact]; }
  /// After an element, velocities carry the rounding of its stage equations: across a contact, and along it.
  double no_drift(int contact) const { return kStageRounding * approach_[contact]; }
  double no_slip(int contact) const { return kStageRounding * slip_[contact]; }
  /// Forces carry it, too.
  double no_force(int contact) const { return kStageRounding * force_[contact]; }

  double normal_delassus(int contact) const { return G_nn_[contact]; }
  double tangential_delassus(int contact) const { return G_tt_[contact]; }

  static constexpr double kGapRounding = 64 * std::numeric_limits<double>::epsilon();
  static constexpr double kVelocityRounding = 64 * std::numeric_limits<double>::epsilon();
  static constexpr double kStageRounding = 1e-12;
  static constexpr double kRedundantHeights = 100;

 private:
  static constexpr double kClosedGapRounding = 2e-13;

  static void raise(double& size, double value) {
    if (value > size) size = value;
  }

  const Problem& problem_;
  double H_ = 0, relative_height_ = 0, height_ = 0, redundant_ = 0;
  Vector normal_;                         // |J_n|, packed
  Vector load_;                           // n_q, |w| at the start of the run
  Vector G_nn_, G_tt_;                    // n_c, at the last touch
  Vector gap_, approach_, slip_, force_;  // n_c
};

}  // namespace ricochet
