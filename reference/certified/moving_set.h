#pragma once

#include "reference/certified/ball_matrix.h"
#include "reference/certified/taylor_step.h"

/// @file
/// MovingSet: the set of states that a motion may have, as a box or in mean value form.

namespace ricochet::reference::certified {

/// The states (q, v) that contain the true one. As a box, each component is a ball; the radius grows like exp(L t). In
/// mean value form (Lohner) the set is
///
///     x in c + Q r,   r a box, c in its middle                                                                  (1)
///
/// and a step of the flow phi gives phi(x) in phi(c) + DPhi([x]) Q r, where [x] is a box of the whole set. Q is made of
/// the directions of DPhi Q, orthonormal, those that are longest first; this avoids the wrapping of boxes.
class MovingSet {
 public:
  MovingSet(const SceneFormulas& scene, SeriesProgram& program, TaylorStep& step, bool mean_value_form);

  const std::vector<Ball>& box() const { return box_; }  ///< q, then v.
  void set_box(std::vector<Ball> box);                   ///< Begins again with a box.
  bool mean_value_form() const { return form_; }         ///< Not a box.
  void take_mean_value_form();                           ///< From the present box on.

  /// Prepares steps of a `motion`.
  void begin(const ModeMotion& motion);
  /// Series of the motion from the set at time t.
  void expand(const ModeMotion& motion, const Ball& t);
  /// Proves the remainders on [0, h].
  bool validate(const ModeMotion& motion, double h);
  /// Moves the set to tau h. @param at_event  begin again with a box there  @throws Undecided
  void advance(const ModeMotion& motion, const Ball& t, double h, const Ball& tau, bool at_event);

 private:
  void reset();
  void turn(const BallMatrix& B, const std::vector<Ball>& image);

  const SceneFormulas& scene_;
  SeriesProgram& p_;
  TaylorStep& step_;
  bool form_ = false;
  bool varies_ = false;  ///< this motion has a variational equation; the start of slip in space has none
  std::vector<Ball> box_, center_, r_;
  BallMatrix Q_;
  std::vector<std::vector<Node>> phi_;
  Variation variation_;
};

}  // namespace ricochet::reference::certified
