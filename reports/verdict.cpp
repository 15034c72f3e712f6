#include "reports/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace ricochet {
namespace {

/// Whether the contact laws give no motion at `contact`, or more than one.
bool is_paradox_at(const std::string& contact, const FailureReason& reason) {
  return reason.code != FailureCode::not_stated && reason.code != FailureCode::impacts_accumulate &&
         std::ranges::find(reason.contacts, contact) != reason.contacts.end();
}

}  // namespace

CaseVerdict verdict(const CaseLimits& limits, const Run& run) {
  if (run.status == "crashed") return CaseVerdict::crashed;        // (1)
  if (run.status == "killed") return CaseVerdict::killed;          // (2)
  if (run.status == "declined") return CaseVerdict::declined;      // (3)
  if (run.status == "time_limit") return CaseVerdict::time_limit;  // (4)
  if (run.status == "not_finite") return CaseVerdict::not_finite;  // (5)
  if (!run.succeeded())
    return is_paradox_at(limits.paradox, run.reason) ? CaseVerdict::refuses : CaseVerdict::fails;  // (6), (7)
  // A comparison with a limit or a number that is not there is false.
  const double loss = limits.conserves_energy ? -run.value("energy_change") : kNoNumber;
  if (run.value("energy_gain") > limits.energy || loss > limits.energy) return CaseVerdict::violates_energy;  // (8)
  if (run.value("penetration") > limits.penetration) return CaseVerdict::penetrates;                          // (8)
  if (run.value("momentum") > limits.momentum) return CaseVerdict::changes_momentum;                          // (8)
  if (run.value("cone") > limits.cone) return CaseVerdict::leaves_cone;                                       // (8)
  const bool is_accurate = run.error <= limits.error;
  if (!limits.paradox.empty()) return is_accurate ? CaseVerdict::resolves : CaseVerdict::wrong;  // (9), (10)
  if (std::isnan(run.error)) return CaseVerdict::keeps;                                          // (11)
  if (run.error <= limits.exact) return CaseVerdict::exact;                                      // (12)
  return is_accurate ? CaseVerdict::accurate : CaseVerdict::inaccurate;                          // (13), (14)
}

const VerdictText& text_of(CaseVerdict verdict) {
  static constexpr std::array<VerdictText, 17> texts{{
      {"exact", "error of the size of rounding", Grade::good},
      {"ok", "error within the case's tolerance", Grade::good},
      {"keeps", "keeps all limits of a case without a true motion", Grade::good},
      {"refuses", "ends with a status that names the contact without a unique force", Grade::good},
      {"resolves", "takes an impulse or one of several forces where no unique force continues, and says nothing of it",
       Grade::good},
      {"declined", "the method does not take this problem, with a reason", Grade::neutral},
      {"off", "error above the case's tolerance", Grade::poor},
      {"energy", "energy above the initial one, or lost where none can be, by more than the case allows", Grade::poor},
      {"sinks", "penetration deeper than the case allows", Grade::poor},
      {"momentum", "changes the momentum of a free system", Grade::poor},
      {"cone", "impulse outside of the friction cone", Grade::poor},
      {"fails", "ends with a status and a reason", Grade::poor},
      {"time", "ends at the time limit", Grade::poor},
      {"wrong", "success with none of the motions that exist", Grade::bad},
      {"NaN", "success with a number that is not finite", Grade::bad},
      {"hang", "did not end and had to be killed", Grade::bad},
      {"crash", "its process died", Grade::bad},
  }};
  return texts[static_cast<std::size_t>(verdict)];
}

std::string decisive_number(CaseVerdict verdict, const Run& run) {
  switch (verdict) {
    case CaseVerdict::violates_energy:
      return fmt::format("energy {:+.2e} J at most, {:+.2e} J at the end", run.value("energy_gain"),
                         run.value("energy_change"));
    case CaseVerdict::penetrates:
      return fmt::format("penetration {:.2e} m", run.value("penetration"));
    case CaseVerdict::keeps:
      return fmt::format("energy {:+.2e} J at most", run.value("energy_gain"));
    case CaseVerdict::changes_momentum:
      return fmt::format("momentum {:.2e} N s", run.value("momentum"));
    case CaseVerdict::leaves_cone:
      return fmt::format("beyond the cone by {:.2e} N s", run.value("cone"));
    case CaseVerdict::time_limit:
    case CaseVerdict::killed:
      return run.has_time() ? fmt::format("after {:.1f} s, at t = {:.3g} s", run.timing.median, run.value("t"))
                            : "at its limit";
    case CaseVerdict::refuses:
    case CaseVerdict::fails:
    case CaseVerdict::declined:
    case CaseVerdict::crashed:
    case CaseVerdict::not_finite:
      return run.message;
    case CaseVerdict::exact:
    case CaseVerdict::accurate:
    case CaseVerdict::resolves:
    case CaseVerdict::inaccurate:
    case CaseVerdict::wrong:
      break;
  }
  return fmt::format("error {:.2e}", run.error);
}

}  // namespace ricochet
