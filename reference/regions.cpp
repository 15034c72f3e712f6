#include "reference/regions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/regions/region_problems.h"
#include "problems/run_pieces.h"
#include "reference/stop.h"

namespace ricochet::reference {
namespace {

constexpr double kTimeShare = 1e-12;  // of the end time: borders at one time, and zeros of functions of time
constexpr double kRoundedZero = 1e-13, kLargestOffset = 1e-3;  // of the terms of psi_k, (1)
constexpr double kLeftOffset = 1e-9;                           // likewise, of a border on which the motion has slid
constexpr double kNegligible = 0.01;                           // of the tolerance
constexpr double kChatter = 1e-6;  // of the end time: a border is passed to and fro, because of the offset (1)
constexpr int kMostCrossings = 40, kFewCrossings = 6;  // of them
constexpr int kClockSpans = 128;                       // of the clock, that are bounded first

/// The values of all functions at a state of the whole problem, or of a region.
Vector functions_at(const Problem& problem, const Vector& q, const Vector& v) {
  Vector psi(std::ssize(problem.info().switches) + std::ssize(problem.info().region));  // one of them is empty
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

/// Sets delta of (1), and the limits of (2), infinite where delta is the least, for a run from the initial state of the
/// region `here`. Beyond psi_k = 0 another function may vanish together with psi_k, as in max(max(q, 0) (1 + v), 0): so
/// the formulas of the `whole` problem count, too.
/// @param is_passed  whether borders are passed again and again
/// @param is_sliding(k)  whether the motion slides on psi_k = 0, @param across(k)  the region beyond psi_k = 0
void set_borders(const Problem& whole, const Problem& here, bool is_passed, const auto& is_sliding, const auto& across,
                 EventLocatedSettings& settings) {
  const Vector &q = here.info().q0, &v = here.info().v0;
  const Eigen::Index n = q.size(), n_s = std::ssize(here.info().region);
  Matrix D(n_s, 2 * n + std::ssize(here.info().parameters));
  here.switching_derivative(q.data(), v.data(), D.data());
  const Vector size = here.switching_sizes(q, v);
  Vector &offsets = settings.border_offset, &limits = settings.border_limit;
  Vector psi(n_s);
  here.switching(q.data(), v.data(), psi.data());
  offsets = std::max(kRoundedZero, 0.1 * settings.tolerance) * size;
  limits = Vector::Constant(n_s, std::numeric_limits<double>::infinity());
  if (!is_passed) return;
  for (Eigen::Index k = 0; k < n_s; ++k) {
    const Vector slope = D.row(k).head(2 * n);
    if (!(slope.squaredNorm() > 0) || k == whole.info().until || is_sliding(static_cast<int>(k))) continue;
    const Problem& beyond = across(static_cast<int>(k));
    for (double delta = kLargestOffset * size[k]; delta > offsets[k] && delta >= std::abs(psi[k]); delta *= 0.1) {
      bool is_negligible = true;
      for (const double to : {-delta, delta}) {  // the nearest states with psi_k = to
        const double way = (to - psi[k]) / slope.squaredNorm();
        const Vector at_q = q + way * slope.head(n), at_v = v + way * slope.tail(n);
        const Vector a = here.free_acceleration(at_q, at_v);
        const double least = kNegligible * settings.tolerance * a.norm();
        for (const Problem* other : {&beyond, &whole})
          is_negligible = is_negligible && (a - other->free_acceleration(at_q, at_v)).norm() <= least;
        is_negligible = is_negligible && have_same_contacts(here, beyond, at_q);
      }
      if (!is_negligible) continue;
      offsets[k] = delta;
      limits[k] = 2 * delta;
      break;
    }
  }
}

}  // namespace

Solution integrate_by_regions(const Problem& problem, const EventLocatedSettings& settings) {
  const ProblemInfo& info = problem.info();
  const double T = info.end_time;
  RegionProblems regions(problem);
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
  if (const std::string why = ambiguous_start(problem, regions, signs); !why.empty())
    stop(whole, Status::infeasible, 0, why);
  bool starts_at_end = false;  // the function that ends the run is zero at the start
  if (info.until >= 0)
    starts_at_end = std::abs(functions_at(problem, whole.q, whole.v)[info.until]) <=
                    kRoundedZero * problem.switching_sizes(whole.q, whole.v)[info.until];
  std::vector<ContactMode> modes;
  std::vector<char> in_flight;
  std::string why_not;  // a motion that slides is not followed
  const auto goes_on_sliding = [&](int k) {
    return slides(problem, regions, signs, k, whole.q, whole.v, modes, why_not);
  };
  const Vector at_start = functions_at(problem, whole.q, whole.v), size = problem.switching_sizes(whole.q, whole.v);
  for (int k = 0; k < at_start.size() && whole.succeeded(); ++k) {
    const bool is_border = !info.switches[k].is_of_time && k != info.until;
    if (is_border && std::abs(at_start[k]) <= kRoundedZero * size[k] && goes_on_sliding(k)) signs[k] = 0;
  }
  bool has_ended = false;  // by EventLocatedSettings::ends
  auto next_time = times.begin();
  int crossings = 0;
  double last_crossing = -1;
  int left = -1;  // the border on which the motion slid before this piece: psi = O(t^2)
  while (whole.t < T && whole.succeeded()) {
    Problem& here = regions.at(signs);
    const double begin = whole.t, until = next_time == times.end() ? T : *next_time;
    here.set_initial_state(whole.q, whole.v);
    here.set_end_time(until - begin);
    EventLocatedSettings of_region = settings;
    if (settings.ends) {
      of_region.ends = [&](const Solution& so_far, std::span<const ContactMode> of_contacts) {
        return has_ended = settings.ends(so_far, of_contacts);
      };
    }
    const auto across = [&](int k) -> const Problem& {
      std::vector<int> beyond = signs;
      beyond[static_cast<std::size_t>(k)] *= -1;
      return regions.at(beyond);
    };
    const auto is_sliding = [&](int k) { return signs[static_cast<std::size_t>(k)] == 0; };
    set_borders(problem, here, crossings > kFewCrossings, is_sliding, across, of_region);
    if (left >= 0) of_region.border_offset[left] = kLeftOffset * here.switching_sizes(whole.q, whole.v)[left];
    left = -1;
    of_region.in_flight = in_flight;
    RegionPiece piece = integrate_in_region(here, of_region);
    in_flight = std::move(piece.in_flight);
    const int border = piece.solution.exit.function;
    const ActingContact acting = acting_contact(here, piece.solution);
    if (acting.is_closed) {
      stop(whole, Status::infeasible, whole.t,
           fmt::format("the motion slides where a formula jumps, and '{}', which acts on that, is closed",
                       info.contacts[acting.contact].name));
      break;
    }
    if (acting.contact >= 0) {  // up to its impact, which happens in the region of one side
      here.set_end_time(acting.t);
      piece = integrate_in_region(here, of_region);
      in_flight = std::move(piece.in_flight);
      append(info, std::move(piece.solution), whole, modes);
      const Vector psi = functions_at(problem, whole.q, whole.v);
      for (std::size_t k = 0; k < signs.size(); ++k) {
        if (signs[k] == 0) signs[k] = psi[static_cast<Eigen::Index>(k)] < 0 ? -1 : 1;
      }
      continue;
    }
    append(info, std::move(piece.solution), whole, modes);
    if (!whole.succeeded() || has_ended) break;
    if (border < 0) {
      whole.t = until;
      if (next_time != times.end()) ++next_time;
      const std::vector<int> before = signs;
      set_signs(true);
      if (info.until >= 0 && signs[info.until] != before[info.until]) break;
      continue;
    }
    const double psi = here.info().region[border] * functions_at(here, whole.q, whole.v)[border];
    if (psi > of_region.border_offset[border]) {  // (2)
      crossings = 0;
      continue;
    }
    if (border == info.until && (!starts_at_end || whole.t > kChatter * T)) break;
    crossings = last_crossing >= 0 && whole.t - last_crossing <= kChatter * T ? crossings + 1 : 1;
    last_crossing = whole.t;
    if (crossings > 2 * std::ssize(signs) + kMostCrossings) {
      stop(whole, Status::infeasible, whole.t,
           fmt::format("the motion slides on {} = 0, where a formula jumps, or impacts accumulate there{}",
                       info.switches[border].formula, why_not.empty() ? "" : ": " + why_not));
      break;
    }
    hold_on_borders(regions, signs, whole.q, whole.v);
    if (signs[border] == 0) {
      signs[border] = side_of_exit(regions, signs, border, whole.q, whole.v);
      left = border;
    } else {
      signs[border] = goes_on_sliding(border) ? 0 : -signs[border];
    }
    hold_on_borders(regions, signs, whole.q, whole.v);
    const Problem& next = regions.at(signs);
    const std::string jump = jumped_gap(next, whole.q, info.switches[border]);
    if (!jump.empty()) stop(whole, Status::infeasible, whole.t, jump);
  }
  return whole;
}

}  // namespace ricochet::reference
