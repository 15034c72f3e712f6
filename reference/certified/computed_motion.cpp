#include "reference/certified/computed_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace ricochet::reference::certified {
namespace {

constexpr int kCut = 10;         // decimal places beyond the digits
constexpr int kLeastShare = 2;   // at least half of the digits must agree
constexpr double kOrder = 0.5;   // of a proof: most flights are short
constexpr int kSmallerCut = 20;  // more in the second run

/// The second number with the radius (1).
CertifiedNumber agreed(const CertifiedNumber& first, CertifiedNumber second) {
  const slong bits = static_cast<slong>(4 * std::max(first.text.size(), second.text.size())) + 64;
  Ball x, y;
  arb_set_str(x.get(), first.text.c_str(), bits);
  arb_set_str(y.get(), second.text.c_str(), bits);
  Magnitude radius(Precision{bits, 0}.sub(x, y)), own;
  for (const double part : {first.radius, second.radius}) {
    mag_set_d(own.get(), part);
    mag_add(radius.get(), radius.get(), own.get());
  }
  second.radius = radius.upper();
  if (second.radius > 0) second.decimals = static_cast<int>(std::floor(-std::log10(second.radius) - 1e-9));
  return second;
}

std::vector<CertifiedNumber> agreed(const std::vector<CertifiedNumber>& first,
                                    const std::vector<CertifiedNumber>& second) {
  std::vector<CertifiedNumber> result;
  for (std::size_t k = 0; k < first.size(); ++k) result.push_back(agreed(first[k], second[k]));
  return result;
}

bool is_same(const CertifiedEvent& a, const CertifiedEvent& b) {
  return a.kind == b.kind && a.contact == b.contact && a.modes == b.modes && a.Lambda_n.size() == b.Lambda_n.size();
}

/// The events of the first run with the numbers of both. Before the end of an accumulation, the second run has more
/// impacts and, if accumulations accumulate, more of their ends. @returns nothing if other events differ
std::optional<std::vector<CertifiedEvent>> agreed(const std::vector<CertifiedEvent>& first,
                                                  const std::vector<CertifiedEvent>& second) {
  std::vector<CertifiedEvent> result;
  auto other = second.begin();
  for (const CertifiedEvent& event : first) {
    const auto may_be_left_out = [&](const CertifiedEvent& e) { return e.kind == "impact" || e.kind == "zeno_end"; };
    while (event.kind == "zeno_end" && other != second.end() && !is_same(event, *other) && may_be_left_out(*other))
      ++other;
    if (other == second.end() || !is_same(event, *other)) return std::nullopt;
    result.push_back(event);
    result.back().time = agreed(event.time, other->time);
    result.back().Lambda_n = agreed(event.Lambda_n, other->Lambda_n);
    ++other;
  }
  if (other != second.end()) return std::nullopt;
  return result;
}

}  // namespace

void take_computed(CertifiedMotion& open, const Problem& problem, const Options& options, const TimeLimit& limit) {
  const auto stays_open = [&](const std::string& reason) { open.reason += "; not computed: " + reason; };
  const int cut = options.digits + kCut;
  Options own = options;
  own.order_per_bit = kOrder * options.order_per_bit;
  const Attempt first = attempts(problem, own, limit, cut);
  if (first.motion.grade < Grade::computed) {  // nothing had to be taken as zero
    open = first.motion;
    return;
  }
  if (first.motion.grade != Grade::computed) return stays_open(first.motion.reason);
  Options more = own;
  more.bits = 2 * first.motion.bits;
  more.mean_value_form = first.motion.mean_value_form;
  const Attempt second = attempt(problem, more, limit, cut + kSmallerCut);
  if (second.motion.grade != Grade::computed) return stays_open(second.motion.reason);
  const auto events = agreed(first.motion.events, second.motion.events);
  if (!events || first.motion.modes != second.motion.modes) return stays_open("two runs do not have the same events");
  CertifiedMotion computed = second.motion;
  computed.assumptions = first.motion.assumptions;
  computed.attempts = open.attempts + first.motion.attempts + 1;
  computed.events = *events;
  computed.q = agreed(first.motion.q, second.motion.q);
  computed.v = agreed(first.motion.v, second.motion.v);
  if (kLeastShare * computed.decimals() < options.digits)
    return stays_open(fmt::format("two runs agree to {} decimal places only", computed.decimals()));
  open = std::move(computed);
}

}  // namespace ricochet::reference::certified
