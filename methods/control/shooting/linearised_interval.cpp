#include "methods/control/shooting/linearised_interval.h"

#include <fmt/format.h>

namespace ricochet {

MotionLineariser::MotionLineariser(PlantRunner& runner)
    : runner_(runner), sensitivity_(VariedProblem::of_step(runner.plant()), runner.tableau()) {}

std::string MotionLineariser::linearise(const PlantMotion& motion) {
  const Eigen::Index n_q = runner_.plant().n_q(), n = n_theta();
  intervals_.resize(motion.steps.size());
  for (std::size_t k = 0; k < motion.steps.size(); ++k) {
    const FesdStep& step = motion.steps[k];
    const auto refuse = [&](const std::string& reason) {
      return fmt::format("interval {} of {}: {}", k + 1, motion.steps.size(), reason);
    };
    if (is_interrupted_ && is_interrupted_()) return refuse("interrupted");
    if (step.has_impact_sequence()) return refuse(VariedProblem::kNoDerivative);
    runner_.plant().set_control(motion.u.col(static_cast<Eigen::Index>(k)));
    LinearisedInterval& interval = intervals_[k];
    sensitivity_.restart(k > 0 ? &motion.steps[k - 1] : nullptr);
    sensitivity_.write_elements(&interval.storage);
    sensitivity_.add(step, sensitivity_.dt_final());
    interval.elements = {interval.storage.data(), static_cast<std::size_t>(step.n_elements)};
    interval.x.resize(2 * n_q, n);
    interval.x << sensitivity_.dq(), sensitivity_.dv();
    if (k == 0) {
      interval.x.leftCols(2 * n_q).setZero();
      for (auto& element : interval.elements) {  // x_0 is given
        for (Matrix* values :
             {&element.q, &element.v, &element.forces, &element.v_minus, &element.start_q, &element.start_v})
          values->leftCols(2 * n_q).setZero();
        element.h.head(2 * n_q).setZero();
      }
    }
    if (!interval.x.allFinite()) return refuse("a contact grazes, and the motion has no derivative there");
  }
  return {};
}

}  // namespace ricochet
