#include "bench/studies/verify/promises.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace ricochet {

bool same_bits(const Vector& a, const Vector& b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())) == 0;
}

namespace {

/// List of violations, in the order in which they are found.
class Findings {
 public:
  template <class... Values>
  void require(bool is_kept, fmt::format_string<Values...> text, Values&&... values) {
    if (!is_kept) broken_.push_back(fmt::format(text, std::forward<Values>(values)...));
  }
  std::vector<std::string> take() { return std::move(broken_); }

 private:
  std::vector<std::string> broken_;
};

void check_end(const Solution& s, const ProblemInfo& info, Findings& findings) {
  findings.require(s.q.size() == info.n_q && s.v.size() == info.n_q, "q and v have {} and {} entries, n_q is {}",
                   s.q.size(), s.v.size(), info.n_q);
  findings.require(s.q.allFinite() && s.v.allFinite(), "the final state is not finite");
  findings.require(s.status != Status::non_finite, "the status is non_finite: a step is to be refused before");
  if (s.succeeded()) {
    findings.require(s.message.empty(), "a success has the message '{}'", s.message);
    findings.require(s.t == info.end_time, "it ends at t = {}, not at {}", s.t, info.end_time);
  } else {
    findings.require(!s.message.empty(), "a failure has no reason");
    findings.require(s.t < info.end_time, "it fails at t = {}, which is the end", s.t);
  }
}

void check_events(const Solution& s, const ProblemInfo& info, Findings& findings) {
  double t = 0;
  for (const Event& e : s.events) {
    findings.require(e.t >= t, "an event at t = {} follows one at {}", e.t, t);
    t = e.t;
    const bool is_contact = e.contact >= 0 && e.contact < info.n_c() && !info.contacts[e.contact].is_bilateral;
    findings.require(is_contact, "an event at t = {} is of contact {}, which is no unilateral one", e.t, e.contact);
    if (!is_contact) return;
    if (e.Lambda_n.size() != info.n_c()) {
      findings.require(false, "an event at t = {} has {} normal impulses, n_c is {}", e.t, e.Lambda_n.size(),
                       info.n_c());
      return;
    }
    if (e.kind == EventKind::impact)
      findings.require(e.Lambda_n[e.contact] > 0, "an impact at t = {} has the impulse {}", e.t, e.Lambda_n[e.contact]);
    for (const int i : info.unilateral)
      findings.require(e.Lambda_n[i] >= 0, "at t = {} contact {} pulls with {}", e.t, info.contacts[i].name,
                       e.Lambda_n[i]);
  }
}

/// Requires that the motion gains no energy. Methods of first order may gain 5 % of the kinetic energy: they gain O(h) on
/// curved constraints and through explicit forces. Others may gain 1e-3 of it: Kane's pendulum gains 0.018 J with Newton's
/// law and any method. Surfaces with a prescribed motion may do work.
void check_energy(const Solution& s, const Problem& problem, bool is_first_order, Findings& findings) {
  const ProblemInfo& info = problem.info();
  const auto before = info.clock < 0 ? problem.energy(info.q0, info.v0) : std::nullopt;
  if (!before) return;
  double moved = problem.kinetic_energy(info.q0, info.v0);
  for (const auto& sample : s.samples) moved = std::max(moved, problem.kinetic_energy(sample.q, sample.v_plus));
  const double allowed = (is_first_order ? 0.05 : 1e-3) * moved + 1e-12;
  for (const auto& sample : s.samples) {
    const double gained = *problem.energy(sample.q, sample.v_plus) - *before;
    if (gained <= allowed) continue;
    findings.require(false, "at t = {} it has gained {:.2e} J, {:.2e} are allowed", sample.t, gained, allowed);
    return;
  }
}

/// The clock must be the time, to the rounding of thousands of additions.
void check_clock(const Solution& s, const ProblemInfo& info, double rounding, Findings& findings) {
  if (info.clock < 0) return;
  for (const auto& sample : s.samples) {
    const double q = sample.q[info.clock], v = sample.v_plus[info.clock];
    const bool is_time = std::abs(q - sample.t) <= 10 * rounding * std::max(1.0, info.end_time);
    if (is_time && std::abs(v - 1) <= rounding) continue;
    findings.require(false, "at t = {} the clock shows {} and runs with {}", sample.t, q, v);
    return;
  }
}

void check_again(const Solution& s, const Solution& again, Findings& findings) {
  findings.require(same_bits(s.q, again.q) && same_bits(s.v, again.v), "a second run has other bits");
  findings.require(s.counters.force_evaluations == again.counters.force_evaluations,
                   "a second run evaluates forces {} times, the first one {} times", again.counters.force_evaluations,
                   s.counters.force_evaluations);
  findings.require(s.counters.events == again.counters.events, "a second run has {} events, the first one {}",
                   again.counters.events, s.counters.events);
  findings.require(s.counters.events == static_cast<std::int64_t>(s.events.size()), "{} events are counted, {} told",
                   s.counters.events, s.events.size());
}

/// @param unwatched  the same run, of which only the final state is recorded  @param bound  PromiseBounds::recording
void check_unwatched(const Solution& s, const Solution& unwatched, double bound, Findings& findings) {
  findings.require(unwatched.events.empty() && unwatched.samples.empty(),
                   "where the final state alone is asked for, events or samples are recorded");
  if (bound == 0) {
    findings.require(same_bits(s.q, unwatched.q) && same_bits(s.v, unwatched.v),
                     "a run that records less has other bits");
    findings.require(s.counters.force_evaluations == unwatched.counters.force_evaluations,
                     "a run that records less evaluates forces {} times, the other {} times",
                     unwatched.counters.force_evaluations, s.counters.force_evaluations);
  } else if (s.q.size() == unwatched.q.size() && s.v.size() == unwatched.v.size()) {
    const double size = std::max({1.0, s.q.lpNorm<Eigen::Infinity>(), s.v.lpNorm<Eigen::Infinity>()});
    const double difference =
        std::max((s.q - unwatched.q).lpNorm<Eigen::Infinity>(), (s.v - unwatched.v).lpNorm<Eigen::Infinity>());
    findings.require(difference <= bound * size, "a run that records less ends elsewhere, by {:.1e}", difference);
  }
  findings.require(s.counters.events == unwatched.counters.events,
                   "a run that records less has {} events, the other {}", unwatched.counters.events, s.counters.events);
}

}  // namespace

PromisedRun run_as_promised(const Method& method, const Problem& problem, Settings settings, PromiseBounds bounds) {
  settings.recording = Recording::grid;
  PromisedRun run{method.solve(problem, settings), {}};
  const Solution& s = run.solution;
  const ProblemInfo& info = problem.info();
  const MethodInfo about = method.info();
  Findings findings;
  check_end(s, info, findings);
  check_events(s, info, findings);
  check_energy(s, problem, !about.is_adaptive && about.order_impacts <= 1, findings);
  check_clock(s, info, bounds.clock, findings);

  const Solution again = bounds.recording > 0 ? method.solve(problem, settings) : s;
  settings.recording = Recording::final_state;
  const Solution unwatched = method.solve(problem, settings);  // where it has the same bits, it is the second run, too
  // A slow machine may end one of them.
  const auto is_slow = [](const Solution& x) { return x.status == Status::time_limit; };
  if (!is_slow(s) && !is_slow(again) && !is_slow(unwatched)) {
    check_again(s, again, findings);
    check_unwatched(s, unwatched, bounds.recording, findings);
  }
  run.broken = findings.take();
  return run;
}

}  // namespace ricochet
