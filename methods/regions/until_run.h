#pragma once

#include <functional>

#include "methods/method.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Whether a run ends: psi = ProblemInfo::until has changed its sign. Methods that follow no regions call it after each
/// step, UntilRun makes the last step again.
class UntilWatch {
 public:
  explicit UntilWatch(const Problem& problem);

  /// To be called after each step. @param t  end of the step [s]
  bool ends(double t, const Vector& q, const Vector& v);
  bool was_called() const { return was_called_; }

  bool has_ended() const { return has_ended_; }
  double begin() const { return begin_; }               ///< of the step in which it vanishes [s]
  double end() const { return end_; }                   ///< of that step [s]
  const Vector& q() const { return q_; }                ///< n_q, at its begin
  const Vector& v() const { return v_; }                ///< n_q, there
  double inside() const { return psi_begin_; }          ///< sigma psi at its begin, > 0
  double outside() const { return psi_end_; }           ///< sigma psi at its end, < 0
  double psi(const Vector& q, const Vector& v);         ///< sigma psi
  double size(const Vector& q, const Vector& v) const;  ///< of the terms of psi there

 private:
  void find_sign(const Vector& q, const Vector& v);

  const Problem& problem_;
  Vector values_, q_, v_;
  double sign_ = 0;  // sigma; 0 while psi is a rounded zero
  double begin_ = 0, end_ = 0, psi_begin_ = 0, psi_end_ = 0;
  bool was_called_ = false, has_ended_ = false;
};

/// Whether the run ends with the step that ends at (t, q, v).
inline bool ends_here(const Settings& settings, double t, const Vector& q, const Vector& v) {
  return settings.until && settings.until->ends(t, q, v);
}

/// A run that ends where ProblemInfo::until vanishes, of a method that follows no regions: the step in which it changes
/// its sign is made again from its begin, shorter, so that
///
///     psi(x(t + h)) = 0                                                                                       (1)
///
/// (border_search.h). The end has the order of the method. A method with a program of its own, which cannot call
/// UntilWatch, runs to the end time, and its grid tells the step. A step that passes two zeros is not noticed.
/// @param run       runs the method on a problem with settings, whose sensitivities are empty
/// @param settings  of the run
Solution run_until(const Problem& problem, const Settings& settings,
                   const std::function<Solution(const Problem&, const Settings&)>& run);

}  // namespace ricochet
