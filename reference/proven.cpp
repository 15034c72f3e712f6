#include "reference/proven.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "reference/certified/certified_motion.h"

namespace ricochet::reference {
namespace {

using certified::CertifiedMotion;
using certified::Grade;

constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr double kRounding = 64 * kEps;  // of a scene whose numbers are rounded, where no second proof exists
constexpr int kDigits = 20;              // decimals that are wanted: three more than doubles have
constexpr int kLeastDecimals = 17;

bool is_certain(const CertifiedMotion& motion) {
  return motion.grade <= Grade::assumed && motion.decimals() >= kLeastDecimals;
}

/// The proven numbers, rounded, and the clock of the problem.
Vector rounded(const std::vector<certified::CertifiedNumber>& numbers, int n, double clock) {
  Vector x = Vector::Constant(n, clock);
  for (std::size_t k = 0; k < numbers.size(); ++k) x[static_cast<Eigen::Index>(k)] = std::stod(numbers[k].text);
  return x;
}

double largest_radius(const CertifiedMotion& motion) {
  double radius = 0;
  for (const auto* list : {&motion.q, &motion.v})
    for (const auto& number : *list) radius = std::max(radius, number.radius);
  return radius;
}

bool same_events(const CertifiedMotion& a, const CertifiedMotion& b) {
  return std::ranges::equal(a.events, b.events,
                            [](const auto& x, const auto& y) { return x.kind == y.kind && x.contact == y.contact; });
}

}  // namespace

std::optional<Reference> proven_reference(const Problem& problem, double max_seconds) {
  const CertifiedMotion motion = certified::certified_motion(problem, {.digits = kDigits, .max_seconds = max_seconds});
  if (!is_certain(motion)) return std::nullopt;
  const ProblemInfo& info = problem.info();
  Reference reference;
  reference.solution.q = rounded(motion.q, problem.n_q(), info.end_time);
  reference.solution.v = rounded(motion.v, problem.n_q(), 1);
  const CertifiedMotion other =
      certified::certified_motion(problem, {.digits = kDigits,
                                            .reading = certified::Reading::rounded,
                                            .max_seconds = std::max(0.1, max_seconds - motion.seconds)});
  const bool is_compared = is_certain(other) && same_events(motion, other);
  const double size = reference.size();
  const double moved = is_compared ? final_state_difference(rounded(other.q, problem.n_q(), info.end_time),
                                                            rounded(other.v, problem.n_q(), 1), reference.solution.q,
                                                            reference.solution.v)
                                   : kRounding * size;
  reference.uncertainty = largest_radius(motion) + moved + kEps * size;  // (1)
  reference.is_truth = motion.grade == Grade::proven && is_compared;
  reference.how = fmt::format("{} to {} decimals by Taylor series in ball arithmetic{}",
                              motion.grade == Grade::proven ? "proven" : "proven, but for assumptions,",
                              motion.decimals(), is_compared ? "" : "; the effect of rounded numbers is estimated");
  return reference;
}

Reference best_reference(const Problem& problem) {
  if (auto proven = proven_reference(problem)) return *std::move(proven);
  return make_reference(problem);
}

}  // namespace ricochet::reference
