#include "problems/regions/region_problems.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "problems/derivatives/symbolic_problem.h"

namespace ricochet {
namespace {

constexpr double kZero = 1e-13;        // of the terms of a gap or psi_k: a rounded zero
constexpr double kDifference = 1e-5;   // [s], along which slopes of psi_k are compared
constexpr double kPenetration = 1e-6;  // of a gap that jumps below zero, relative to 1 + |q|

void add_counters(const Counters& part, Counters& sum) {
  for (const auto counter :
       {&Counters::steps, &Counters::elements, &Counters::force_evaluations, &Counters::jacobian_evaluations,
        &Counters::mass_factorizations, &Counters::matrix_factorizations, &Counters::linear_solves,
        &Counters::complementarity_solves, &Counters::inner_iterations, &Counters::pivots, &Counters::events})
    sum.*counter += part.*counter;
}

/// The larger residual of each equation. @param t  begin of the piece [s]
void add_residuals(const std::vector<Residual>& part, double t, std::vector<Residual>& all) {
  for (Residual residual : part) {
    residual.t += t;
    const auto same = std::ranges::find(all, residual.name, &Residual::name);
    if (same == all.end()) {
      all.push_back(residual);
      continue;
    }
    residual.impossible += same->impossible;
    if (residual.value > same->value)
      *same = residual;
    else
      same->impossible = residual.impossible;
  }
}

/// Adds events of contacts whose modes at the begin of the `piece` are not those before it.
void add_changes(const ProblemInfo& info, const Solution& piece, const std::vector<ContactMode>& before,
                 Solution& whole) {
  if (before.empty() || piece.initial_modes.empty()) return;
  for (const int i : info.unilateral) {
    const auto kind = event_kind(before[i], piece.initial_modes[i], false);
    const bool is_known = std::ranges::any_of(piece.events, [&](const Event& e) { return e.contact == i && e.t == 0; });
    if (!kind || is_known) continue;
    ++whole.counters.events;
    whole.events.push_back({.t = whole.t,
                            .kind = *kind,
                            .contact = i,
                            .q = whole.q,
                            .v_minus = whole.v,
                            .v_plus = whole.v,
                            .Lambda_n = Vector::Zero(info.n_c()),
                            .Lambda_t = Vector::Zero(info.n_lambda_t),
                            .modes = piece.initial_modes,
                            .dt = {}});
  }
}

}  // namespace

RegionProblems::~RegionProblems() {
  const std::lock_guard lock(formulas_mutex());
  made_.clear();
}

Problem& RegionProblems::at(const std::vector<int>& signs) {
  auto& region = made_[signs];
  if (!region) {
    const std::lock_guard lock(formulas_mutex());
    region = problem_.in_region(signs);
  }
  return *region;
}

std::string jumped_gap(const Problem& region, const Vector& q, const SwitchInfo& psi) {
  const Vector gap = region.gap(q),
               size = region.normal_jacobian(q).cwiseAbs().transpose() * (1 + q.array().abs()).matrix();
  for (const int i : region.info().unilateral) {
    if (gap[i] < -kPenetration * (1 + size[i]))
      return fmt::format("the gap of '{}' jumps to {:.3g} m where {} = 0", region.info().contacts[i].name, gap[i],
                         psi.formula);
  }
  return {};
}

std::string ambiguous_start(const Problem& problem, RegionProblems& regions, const std::vector<int>& signs) {
  const ProblemInfo& info = problem.info();
  const Vector &q = info.q0, &v = info.v0;
  const Eigen::Index n = q.size(), n_s = std::ssize(info.switches);
  Vector psi(n_s);
  problem.switching(q.data(), v.data(), psi.data());
  const Vector size = problem.switching_sizes(q, v);
  const Vector gap_size = problem.normal_jacobian(q).cwiseAbs().transpose() * (1 + q.array().abs()).matrix();
  const bool touches = (problem.gap(q).array() <= kZero * (1 + gap_size.array())).any();
  for (Eigen::Index k = 0; k < n_s; ++k) {
    if (touches || info.switches[k].is_of_time || k == info.until || std::abs(psi[k]) > kZero * size[k]) continue;
    const auto away = [&](int sigma) {  // sigma psi_k', or sigma psi_k''
      std::vector<int> side = signs;
      side[k] = sigma;
      const Problem& region = regions.at(side);
      const auto slope_at = [&](const Vector& at_q) {
        Matrix D(n_s, 2 * n + std::ssize(info.parameters));
        region.switching_derivative(at_q.data(), v.data(), D.data());
        return Vector(D.row(k).head(2 * n));
      };
      const Vector slope = slope_at(q), a = region.free_acceleration(q, v);
      const Vector of_q = slope.head(n), of_v = slope.tail(n);
      const double rate = of_q.dot(v) + of_v.dot(a), terms = of_q.cwiseAbs().dot(v.cwiseAbs()) + size[k];
      if (!of_v.isZero(0) || std::abs(rate) > kZero * terms) return sigma * rate;
      const Vector change = (slope_at(q + kDifference * v) - slope_at(q - kDifference * v)).head(n) / (2 * kDifference);
      return sigma * (of_q.dot(a) + change.dot(v));
    };
    if (away(1) > 0 && away(-1) > 0)
      return fmt::format("the motion is not unique: it begins at {} = 0, and both sides lead away",
                         info.switches[k].formula);
  }
  return {};
}

void append(const ProblemInfo& info, Solution piece, Solution& whole, std::vector<ContactMode>& modes) {
  const double t = whole.t;
  if (whole.initial_modes.empty()) whole.initial_modes = piece.initial_modes;
  add_changes(info, piece, modes, whole);
  if (!piece.initial_modes.empty()) modes = piece.initial_modes;
  for (Event& event : piece.events) {
    event.t += t;
    if (!event.modes.empty()) modes = event.modes;
    whole.events.push_back(std::move(event));
  }
  for (Sample& sample : piece.samples) {
    sample.t += t;
    whole.samples.push_back(std::move(sample));
  }
  whole.motion.append(piece.motion, t);
  add_counters(piece.counters, whole.counters);
  add_residuals(piece.residuals, t, whole.residuals);
  whole.status = piece.status;
  whole.message = std::move(piece.message);
  whole.reason = std::move(piece.reason);
  whole.q = std::move(piece.q);
  whole.v = std::move(piece.v);
  whole.t += piece.t;
}

}  // namespace ricochet
