#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "reference/certified/certified_motion.h"

namespace ricochet::reference::certified {
namespace {

bool have_same_events(const CertifiedMotion& a, const CertifiedMotion& b) {
  return std::ranges::equal(a.events, b.events,
                            [](const auto& x, const auto& y) { return x.kind == y.kind && x.contact == y.contact; });
}

/// In extended precision, where the processor has it.
double largest_difference(const std::vector<CertifiedNumber>& a, const std::vector<CertifiedNumber>& b) {
  long double largest = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    const long double x = std::strtold(a[k].text.c_str(), nullptr), y = std::strtold(b[k].text.c_str(), nullptr);
    largest = std::max(largest, std::abs(x - y));
  }
  return static_cast<double>(largest);
}

}  // namespace

std::optional<double> moved_by_rounding(const Problem& problem, const CertifiedMotion& motion, Options options) {
  if (motion.grade > Grade::assumed) return std::nullopt;
  options.reading = Reading::rounded;
  options.with_steps = false;
  options.with_sensitivities = false;
  options.may_compute = false;
  const CertifiedMotion rounded = certified_motion(problem, options);
  if (rounded.grade > Grade::assumed || !have_same_events(motion, rounded)) return std::nullopt;
  return std::max(largest_difference(motion.q, rounded.q), largest_difference(motion.v, rounded.v));
}

}  // namespace ricochet::reference::certified
