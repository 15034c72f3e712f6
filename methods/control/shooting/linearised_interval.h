#pragma once

#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "methods/control/shooting/plant_motion.h"
#include "methods/fesd/sensitivity.h"

namespace ricochet {

/// Derivatives of one control interval, x_k+1 = F(x_k, u_k, H) with x = (q, v), and of all its stages by
///
///   theta = (q_k, v_k, u_k, H),   2 n_q + n_u + 1.                                                           (1)
///
/// They are those of Sensitivity (../../fesd/sensitivity.h), through impacts and switches. The state at the start is varied
/// within the contacts that the interval before has closed, by projection: other variations cannot occur, and a closed
/// contact would resist them with a force of the size 1 / h^2. In the first interval x_k is given: its columns are zero.
struct LinearisedInterval {
  LinearisedInterval() = default;
  LinearisedInterval(LinearisedInterval&&) = default;

  Matrix x;  ///< 2 n_q x theta: of the state at the end
  /// Per element: stages below each other, as in Sensitivity::ElementDerivatives.
  std::span<Sensitivity::ElementDerivatives> elements;
  std::vector<Sensitivity::ElementDerivatives> storage;  ///< of them, and of more if the interval had more before
};

/// Linearises motions, interval by interval. A motion with the modes and the numbers of elements of one before is linearised
/// without allocations.
class MotionLineariser {
 public:
  /// @param runner  whose motions are linearised; must outlive this object
  explicit MotionLineariser(PlantRunner& runner);

  Eigen::Index n_theta() const { return sensitivity_.dt_final().size(); }

  /// @param motion  solved. @return empty, or the reason why there are no derivatives
  std::string linearise(const PlantMotion& motion);
  /// Ends linearise() before an interval at which this returns true. @param is_interrupted  empty for never
  void set_interrupt(std::function<bool()> is_interrupted) { is_interrupted_ = std::move(is_interrupted); }
  const std::vector<LinearisedInterval>& intervals() const { return intervals_; }

  const PointVariation& point() const { return sensitivity_.point(); }
  long factorisations() const { return sensitivity_.factorisations(); }  ///< one per element at most, so far

 private:
  PlantRunner& runner_;
  Sensitivity sensitivity_;
  std::vector<LinearisedInterval> intervals_;
  std::function<bool()> is_interrupted_;
};

}  // namespace ricochet
