#include "reference/certified/certified_motion.h"

#include "reference/certified/computed_motion.h"

namespace ricochet::reference::certified {

CertifiedMotion certified_motion(const Problem& problem, const Options& options) {
  const TimeLimit limit(options.max_seconds);
  Attempt last = attempts(problem, options, limit);
  const bool is_tie = last.motion.grade == Grade::open && (last.accumulates || last.is_undecided);
  if (is_tie && options.may_compute) take_computed(last.motion, problem, options, limit);
  if (options.with_sensitivities && last.motion.sensitivities.empty() && last.motion.no_sensitivities.empty())
    last.motion.no_sensitivities = std::string("the motion is ") + name_of(last.motion.grade);
  last.motion.reading = options.reading;
  last.motion.seconds = limit.seconds();
  return last.motion;
}

bool can_certify() {
  return true;
}

}  // namespace ricochet::reference::certified
