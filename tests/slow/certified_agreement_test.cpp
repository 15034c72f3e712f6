// Proofs and event-located integration share no equations: where both have an answer, they agree.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "problems/registry.h"
#include "reference/agreement.h"
#include "reference/certified/certified_motion.h"

namespace ricochet::reference::certified {
namespace {

double value(const CertifiedNumber& number) {
  return std::strtod(number.text.c_str(), nullptr);
}

double distance_to_nearest(double t, const std::vector<double>& times) {
  double nearest = HUGE_VAL;
  for (const double other : times) nearest = std::min(nearest, std::abs(other - t));
  return nearest;
}

/// Largest difference of the final state and of the times of events. One list may have several events where the other
/// has one: a contact that opens in an impact of another one.
double difference(const CertifiedMotion& proven, const Solution& solution) {
  double largest = 0;
  for (std::size_t k = 0; k < proven.q.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    largest =
        std::max({largest, std::abs(value(proven.q[k]) - solution.q[i]), std::abs(value(proven.v[k]) - solution.v[i])});
  }
  // References resolve fewer impacts that accumulate, and claim nothing of their times.
  if (!proven.events.empty() && proven.events.back().kind == "zeno_end") return largest;
  std::vector<double> times, others;
  for (const auto& event : proven.events) times.push_back(value(event.time));
  for (const auto& event : solution.events) others.push_back(event.t);
  for (const double t : times) largest = std::max(largest, distance_to_nearest(t, others));
  for (const double t : others) largest = std::max(largest, distance_to_nearest(t, times));
  return largest;
}

/// On all compiled scenes whose motion is proven, references are right within their claim. Numbers are doubles, as in
/// the references.
TEST(CertifiedAgreement, ReferencesAreRightWithinTheirClaim) {
  if (!can_certify()) GTEST_SKIP() << "built without Arb";
  int n_compared = 0;
  for (const auto& scene : scenes()) {
    const auto problem = make_problem(scene.id);
    Options options;
    options.digits = 20;
    options.max_seconds = 3;
    options.reading = Reading::rounded;
    const CertifiedMotion proven = certified_motion(*problem, options);
    if (proven.grade == Grade::open) continue;
    Reference reference;
    try {
      reference = make_reference(*problem);
    } catch (const std::runtime_error&) {  // no reference
      continue;
    }
    EXPECT_LE(difference(proven, reference.solution), reference.uncertainty) << scene.id;
    ++n_compared;
  }
  EXPECT_GE(n_compared, 18);
}

}  // namespace
}  // namespace ricochet::reference::certified
