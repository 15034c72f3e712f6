#pragma once

#include "methods/contact_laws/contact_scales.h"
#include "methods/method_spec.h"
#include "problems/problem.h"

namespace ricochet {

/// The option capture_height of methods whose groups of contacts come to rest: the height delta of group_rest.h [m].
/// Without it, delta is the tolerance times the size of the gap (contact_scales.h (1)).
///
/// The longest height is a tenth of the smallest length of the scene: the radius of a sphere, a disc or a capsule of its
/// geometry; in scenes without one, the size of a gap at the start,
///
///   |J_n|' (|q| + H |v| + H^2 |w|),   H a tenth of the end time                                        (1)
///
/// The last check of a step (step_check.h) allows gaps below zero of 1000 tolerances: where contacts sink deeper, as with
/// a height of some hundred tolerances, it ends the run.
class CaptureHeight {
 public:
  explicit CaptureHeight(const MethodSpec& spec);

  bool is_stated() const { return height_ > 0; }
  /// Sets the height of a run in its scales. @throws InputError if it is too large for the problem
  void set(const Problem& problem, double tolerance, ContactScales& scales) const;

  static constexpr const char* kName = "capture_height";

 private:
  double height_;  // [m]; 0: it follows from the tolerance
};

}  // namespace ricochet
