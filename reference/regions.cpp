#include "reference/regions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>

#include "problems/dense_solve.h"
#include "problems/derivatives/symbolic_problem.h"
#include "reference/stop.h"

namespace ricochet::reference {
namespace {

constexpr double kTimeShare = 1e-12;  // of the end time: borders at one time, and zeros of functions of time
constexpr double kRoundedZero = 1e-13, kLargestOffset = 1e-3;  // of the terms of psi_k, (1)
constexpr double kNegligible = 0.01;                           // of the tolerance
constexpr double kPenetration = 1e-6;                          // of a gap that jumps below zero, relative to 1 + |q|
constexpr double kChatter = 1e-6;   // of the end time: a border is passed to and fro, because of the offset (1)
constexpr int kMostCrossings = 40;  // of them
constexpr int kClockSpans = 128;    // of the clock, that are bounded first

/// The regions of a problem, made when they are entered.
class Regions {
 public:
  explicit Regions(const Problem& problem) : problem_(problem) {}
  ~Regions() {
    const std::lock_guard lock(formulas_mutex());
    made_.clear();
  }
  Regions(const Regions&) = delete;
  Regions& operator=(const Regions&) = delete;

  Problem& operator()(const std::vector<int>& signs) {
    auto& region = made_[signs];
    if (!region) {
      const std::lock_guard lock(formulas_mutex());
      region = problem_.in_region(signs);
    }
    return *region;
  }

 private:
  const Problem& problem_;
  std::map<std::vector<int>, std::unique_ptr<Problem>> made_;
};

/// The values of all functions at a state of the whole problem.
Vector functions_at(const Problem& problem, const Vector& q, const Vector& v) {
  Vector psi(std::ssize(problem.info().switches));
  problem.switching(q.data(), v.data(), psi.data());
  return psi;
}

/// Sorted times at which functions of time alone change their sign, from the begin of the run [s]. A span that may
/// have a zero by bounds is divided until it is shorter than what kTimeShare resolves.
std::vector<double> time_switches(const Problem& problem) {
  const ProblemInfo& info = problem.info();
  std::vector<double> times;
  if (info.clock < 0 || std::ranges::none_of(info.switches, &SwitchInfo::is_of_time)) return times;
  const double T = info.end_time, start = info.start_time();
  std::vector<Interval> q(info.q0.data(), info.q0.data() + info.n_q), v(info.v0.data(), info.v0.data() + info.n_q),
      bounds(info.switches.size());
  Vector place = info.q0;
  const auto psi = [&](double t) {
    place[info.clock] = start + t;
    return functions_at(problem, place, info.v0);
  };
  const auto search = [&](const auto& self, double a, double b) -> void {
    q[info.clock] = {start + a, start + b};
    problem.switching_bounds(q.data(), v.data(), bounds.data());
    bool may_vanish = false;
    for (std::size_t k = 0; k < bounds.size(); ++k)
      may_vanish = may_vanish || (info.switches[k].is_of_time && bounds[k].lower <= 0 && bounds[k].upper >= 0);
    if (!may_vanish) return;
    if (b - a > kTimeShare * T) {
      const double middle = 0.5 * (a + b);
      self(self, a, middle);
      self(self, middle, b);
      return;
    }
    const Vector before = psi(a - kTimeShare * T), after = psi(b + kTimeShare * T);
    for (Eigen::Index k = 0; k < before.size(); ++k) {
      if (!info.switches[k].is_of_time || before[k] * after[k] > 0) continue;
      double left = a - kTimeShare * T, right = b + kTimeShare * T;
      for (double m = 0.5 * (left + right); m > left && m < right; m = 0.5 * (left + right))
        (psi(m)[k] * before[k] > 0 ? left : right) = m;
      if (right > kTimeShare * T && right < (1 - kTimeShare) * T &&
          (times.empty() || right > times.back() + 4 * kTimeShare * T))
        times.push_back(right);
    }
  };
  for (int n = 0; n < kClockSpans; ++n) search(search, T * n / kClockSpans, T * (n + 1) / kClockSpans);
  return times;
}

/// Whether gaps and directions of contacts do not change at the border.
bool have_same_contacts(const Problem& here, const Problem& beyond, const Vector& q) {
  return here.gap(q) == beyond.gap(q) && here.normal_jacobian(q) == beyond.normal_jacobian(q) &&
         here.tangent_jacobian(q) == beyond.tangent_jacobian(q);
}

/// delta of (1) at a state of a region. @param across(k)  the region beyond psi_k = 0
Vector offsets_of(const Problem& here, const Vector& q, const Vector& v, double tolerance, const auto& across) {
  const Eigen::Index n = q.size(), n_s = std::ssize(here.info().region);
  Matrix D(n_s, 2 * n + std::ssize(here.info().parameters));
  here.switching_derivative(q.data(), v.data(), D.data());
  const auto acceleration = [](const Problem& problem, const Vector& at_q, const Vector& at_v) {
    return Vector(CholeskyFactors(problem.mass_matrix(at_q)).solve(problem.force(at_q, at_v)));
  };
  Vector offsets(n_s);
  for (Eigen::Index k = 0; k < n_s; ++k) {
    const Vector slope = D.row(k).head(2 * n);
    const double size = slope.head(n).cwiseAbs().dot((1 + q.array().abs()).matrix()) +
                        slope.tail(n).cwiseAbs().dot((1 + v.array().abs()).matrix());
    offsets[k] = std::max(kRoundedZero, 0.1 * tolerance) * size;
    if (!(slope.squaredNorm() > 0)) continue;
    Vector psi(n_s);
    here.switching(q.data(), v.data(), psi.data());
    const Problem& beyond = across(static_cast<int>(k));
    for (double delta = kLargestOffset * size; delta > offsets[k]; delta *= 0.1) {
      bool is_negligible = true;
      for (const double to : {-delta, delta}) {  // the nearest states with psi_k = to
        const double way = (to - psi[k]) / slope.squaredNorm();
        const Vector at_q = q + way * slope.head(n), at_v = v + way * slope.tail(n);
        const Vector a = acceleration(here, at_q, at_v), jump = a - acceleration(beyond, at_q, at_v);
        is_negligible = is_negligible && jump.norm() <= kNegligible * tolerance * a.norm() &&
                        have_same_contacts(here, beyond, at_q);
      }
      if (!is_negligible) continue;
      offsets[k] = delta;
      break;
    }
  }
  return offsets;
}

/// Adds a piece that begins at t. @param modes  at the end of the piece before it
void append(const Problem& problem, double t, std::vector<ContactMode>& modes, Solution& piece, Solution& whole) {
  if (whole.initial_modes.empty()) whole.initial_modes = piece.initial_modes;
  for (int i = 0; i < problem.n_c() && !modes.empty() && !piece.initial_modes.empty(); ++i) {  // changes at the border
    const auto kind = event_kind(modes[i], piece.initial_modes[i], false);
    if (!kind || std::ranges::any_of(piece.events, [&](const Event& e) { return e.contact == i && e.t == 0; }))
      continue;
    whole.events.push_back({.t = t,
                            .kind = *kind,
                            .contact = i,
                            .q = whole.q,
                            .v_minus = whole.v,
                            .v_plus = whole.v,
                            .Lambda_n = Vector::Zero(problem.n_c()),
                            .Lambda_t = Vector::Zero(problem.info().n_lambda_t),
                            .modes = piece.initial_modes,
                            .dt = {}});
  }
  if (!piece.initial_modes.empty()) modes = piece.initial_modes;
  for (Event& event : piece.events) {
    event.t += t;
    if (!event.modes.empty()) modes = event.modes;
    whole.events.push_back(std::move(event));
  }
  whole.motion.append(piece.motion, t);
  Counters& sum = whole.counters;
  sum.steps += piece.counters.steps;
  sum.elements += piece.counters.elements;
  sum.force_evaluations += piece.counters.force_evaluations;
  sum.mass_factorizations += piece.counters.mass_factorizations;
  sum.matrix_factorizations += piece.counters.matrix_factorizations;
  sum.inner_iterations += piece.counters.inner_iterations;
  sum.events = std::ssize(whole.events);
  whole.status = piece.status;
  whole.message = std::move(piece.message);
  whole.reason = std::move(piece.reason);
  whole.q = piece.q;
  whole.v = piece.v;
  whole.t = t + piece.t;
}

}  // namespace

Solution integrate_by_regions(const Problem& problem, const EventLocatedSettings& settings) {
  const ProblemInfo& info = problem.info();
  const double T = info.end_time;
  Regions regions(problem);
  Solution whole;
  whole.q = info.q0;
  whole.v = info.v0;
  const std::vector<double> times = time_switches(problem);
  std::vector<int> signs(info.switches.size(), 1);
  const auto set_signs = [&](bool of_time_only) {
    Vector q = whole.q;
    if (info.clock >= 0) q[info.clock] += 2 * kTimeShare * T;
    const Vector here = functions_at(problem, whole.q, whole.v), later = functions_at(problem, q, whole.v);
    for (std::size_t k = 0; k < signs.size(); ++k) {
      const bool is_of_time = info.switches[k].is_of_time;
      if (is_of_time || !of_time_only)
        signs[k] = (is_of_time ? later : here)[static_cast<Eigen::Index>(k)] < 0 ? -1 : 1;
    }
  };
  set_signs(false);
  std::vector<ContactMode> modes;
  auto next_time = times.begin();
  int crossings = 0;
  double last_crossing = -1;
  while (whole.t < T && whole.succeeded()) {
    Problem& here = regions(signs);
    const double begin = whole.t, until = next_time == times.end() ? T : *next_time;
    here.set_initial_state(whole.q, whole.v);
    here.set_end_time(until - begin);
    EventLocatedSettings of_region = settings;
    of_region.border_offset = offsets_of(here, whole.q, whole.v, settings.tolerance, [&](int k) -> const Problem& {
      std::vector<int> beyond = signs;
      beyond[static_cast<std::size_t>(k)] *= -1;
      return regions(beyond);
    });
    Solution piece = integrate_in_region(here, of_region);
    const int border = piece.exit.function;
    append(problem, begin, modes, piece, whole);
    if (!whole.succeeded()) break;
    if (border < 0) {
      whole.t = until;
      if (next_time != times.end()) ++next_time;
      set_signs(true);
      continue;
    }
    crossings = last_crossing >= 0 && whole.t - last_crossing <= kChatter * T ? crossings + 1 : 1;
    last_crossing = whole.t;
    if (crossings > 2 * std::ssize(signs) + kMostCrossings) {
      stop(whole, Status::infeasible, whole.t,
           fmt::format("the motion slides on {} = 0, where a formula jumps, or impacts accumulate there",
                       info.switches[border].formula));
      break;
    }
    signs[border] = -signs[border];
    const Problem& next = regions(signs);
    const Vector gap = next.gap(whole.q),
                 size = next.normal_jacobian(whole.q).cwiseAbs().transpose() * (1 + whole.q.array().abs()).matrix();
    for (const int i : next.info().unilateral) {
      if (gap[i] < -kPenetration * (1 + size[i]))
        stop(whole, Status::infeasible, whole.t,
             fmt::format("the gap of '{}' jumps to {:.3g} m where {} = 0", info.contacts[i].name, gap[i],
                         info.switches[border].formula));
    }
  }
  return whole;
}

}  // namespace ricochet::reference
