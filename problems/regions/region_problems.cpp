#include "problems/regions/region_problems.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <mutex>

#include "problems/dense_solve.h"
#include "problems/derivatives/symbolic_problem.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

constexpr double kZero = 1e-13;        // of the terms of a gap or psi_k: a rounded zero
constexpr double kOnBorder = 1e-9;     // of the terms of psi_k: a border that was located
constexpr double kBegin = 1e-12;       // of the time: an impact with which a piece begins
constexpr double kDrift = 1e-6;        // of gaps and rates of closed contacts, relative
constexpr double kGrid = 1e-9;         // of a step: on the grid
constexpr double kSlow = 0.1;          // of leaves_slowly()
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

/// The derivative of psi_k by (q, v), 2 n_q.
Vector slope_at(const Problem& region, int k, const Vector& q, const Vector& v) {
  Matrix D(std::ssize(region.info().region), 2 * q.size() + std::ssize(region.info().parameters));
  region.switching_derivative(q.data(), v.data(), D.data());
  return D.row(k).head(2 * q.size());
}

struct BorderRate {
  double rate, terms;  // psi_k' of (1) in the header, without contact forces; the size of its terms
  Vector of_q, of_v;   // derivatives of psi_k
};

BorderRate rate_at(const Problem& region, int k, const Vector& q, const Vector& v) {
  const Vector slope = slope_at(region, k, q, v), a = region.free_acceleration(q, v);
  const Vector of_q = slope.head(q.size()), of_v = slope.tail(q.size());
  return {.rate = of_q.dot(v) + of_v.dot(a), .terms = of_q.cwiseAbs().dot(v.cwiseAbs()), .of_q = of_q, .of_v = of_v};
}

std::vector<int> with_side(std::vector<int> signs, int k, int sigma) {
  signs[static_cast<std::size_t>(k)] = sigma;
  return signs;
}

/// Whether contact i acts on the functions on which the `region` slides.
bool acts_on_sliding(const Problem& region, int i) {
  const SymbolicProblem* formulas = region.symbolic();
  if (formulas == nullptr) return false;
  const std::vector<int>& acting = formulas->model().acting;
  return i < std::ssize(acting) && acting[static_cast<std::size_t>(i)] != 0;
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
  const Eigen::Index n_s = std::ssize(info.switches);
  Vector psi(n_s);
  problem.switching(q.data(), v.data(), psi.data());
  const Vector size = problem.switching_sizes(q, v);
  const Vector gap_size = problem.normal_jacobian(q).cwiseAbs().transpose() * (1 + q.array().abs()).matrix();
  const bool touches = (problem.gap(q).array() <= kZero * (1 + gap_size.array())).any();
  for (int k = 0; k < n_s; ++k) {
    if (touches || info.switches[k].is_of_time || k == info.until || std::abs(psi[k]) > kZero * size[k]) continue;
    const auto away = [&](int sigma) {  // sigma psi_k', or sigma psi_k''
      const BorderRate at = rate_at(regions.at(with_side(signs, k, sigma)), k, q, v);
      if (!at.of_v.isZero(0) || std::abs(at.rate) > kZero * (at.terms + size[k])) return sigma * at.rate;
      const Problem& region = regions.at(with_side(signs, k, sigma));
      const Vector change =
          (slope_at(region, k, q + kDifference * v, v) - slope_at(region, k, q - kDifference * v, v)).head(q.size()) /
          (2 * kDifference);
      return sigma * (at.of_q.dot(region.free_acceleration(q, v)) + change.dot(v));
    };
    if (away(1) > 0 && away(-1) > 0)
      return fmt::format("the motion is not unique: it begins at {} = 0, and both sides lead away",
                         info.switches[k].formula);
  }
  return {};
}

bool can_slide(const Problem& problem, RegionProblems& regions, const std::vector<int>& signs, int k,
               const std::vector<ContactMode>& modes, std::string& why_not) {
  try {
    const Problem& region = regions.at(with_side(signs, k, 0));
    for (int i = 0; i < std::ssize(modes); ++i) {
      if (!is_closed(modes[static_cast<std::size_t>(i)]) || !acts_on_sliding(region, i)) continue;
      why_not = fmt::format("'{}', which acts on it, is closed", problem.info().contacts[i].name);
      return false;
    }
  } catch (const InputError& e) {
    why_not = e.what();
    return false;
  }
  return true;
}

bool slides(const Problem& problem, RegionProblems& regions, const std::vector<int>& signs, int k, const Vector& q,
            const Vector& v, const std::vector<ContactMode>& modes, std::string& why_not) {
  const double size = problem.switching_sizes(q, v)[k];
  Vector psi(std::ssize(signs));
  problem.switching(q.data(), v.data(), psi.data());
  if (std::abs(psi[k]) > kOnBorder * size) return false;
  for (const int sigma : {1, -1}) {
    const BorderRate at = rate_at(regions.at(with_side(signs, k, sigma)), k, q, v);
    if (at.of_v.isZero(0) || sigma * at.rate >= -kZero * (at.terms + size)) return false;
  }
  return can_slide(problem, regions, signs, k, modes, why_not);
}

bool leaves_slowly(RegionProblems& regions, const std::vector<int>& signs, int k, const Vector& q, const Vector& v) {
  const int side = signs[static_cast<std::size_t>(k)];
  const double here = side * rate_at(regions.at(signs), k, q, v).rate,
               beyond = -side * rate_at(regions.at(with_side(signs, k, -side)), k, q, v).rate;
  return beyond < 0 && std::abs(here) < kSlow * std::abs(beyond);
}

int side_of_exit(RegionProblems& regions, const std::vector<int>& signs, int k, const Vector& q, const Vector& v) {
  const auto away = [&](int sigma) { return sigma * rate_at(regions.at(with_side(signs, k, sigma)), k, q, v).rate; };
  return away(1) > away(-1) ? 1 : -1;
}

void hold_on_borders(RegionProblems& regions, const std::vector<int>& signs, const Vector& q, Vector& v) {
  std::vector<int> inside = signs;  // a region that has psi_k
  std::vector<Eigen::Index> held;
  for (std::size_t k = 0; k < signs.size(); ++k) {
    if (signs[k] != 0) continue;
    held.push_back(static_cast<Eigen::Index>(k));
    inside[k] = 1;
  }
  if (held.empty()) return;
  const Problem& region = regions.at(inside);
  Vector psi(std::ssize(signs));
  for (int iteration = 0; iteration < 2; ++iteration) {
    region.switching(q.data(), v.data(), psi.data());
    Matrix slope(q.size(), std::ssize(held));
    for (Eigen::Index l = 0; l < slope.cols(); ++l)
      slope.col(l) = slope_at(region, static_cast<int>(held[static_cast<std::size_t>(l)]), q, v).tail(q.size());
    const Matrix y = CholeskyFactors(region.mass_matrix(q)).solve_columns(slope);
    v -= y * Eigen::CompleteOrthogonalDecomposition<Matrix>(slope.transpose() * y).solve(Vector(psi(held)));
  }
}

void hold_closed(const Problem& here, const std::vector<ContactMode>& modes, const std::vector<char>& sticks, Vector& q,
                 Vector& v) {
  if (modes.empty()) return;
  const Vector gap = here.gap(q);
  const Matrix J = here.normal_jacobian(q), MJ = here.force_directions(J);
  const Vector size = J.cwiseAbs().transpose() * (1 + q.array().abs()).matrix(),
               speed = J.cwiseAbs().transpose() * (1 + v.array().abs()).matrix(), rate = J.transpose() * v;
  std::vector<Eigen::Index> held, stuck;
  for (int i = 0; i < here.n_c(); ++i) {
    const auto mode = static_cast<std::size_t>(i);
    if (!is_closed(modes[mode]) || std::abs(gap[i]) > kDrift * size[i] || std::abs(rate[i]) > kDrift * speed[i])
      continue;
    held.push_back(i);
    if (!sticks.empty() && sticks[mode] != 0) stuck.push_back(here.info().contacts[mode].tangent_index);
  }
  if (held.empty()) return;
  const CholeskyFactors mass(here.mass_matrix(q));
  const Matrix J_held = J(Eigen::all, held);
  const Matrix W = mass.solve_columns(MJ(Eigen::all, held));
  const Eigen::CompleteOrthogonalDecomposition<Matrix> G(J_held.transpose() * W);
  q -= W * G.solve(Vector(gap(held)));
  if (stuck.empty()) {
    v -= W * G.solve(Vector(rate(held)));
    return;
  }
  const Matrix J_t = here.tangent_jacobian(q), MJ_t = here.force_directions(J_t);
  const auto n_held = std::ssize(held), n = n_held + std::ssize(stuck);
  Matrix J_all(q.size(), n), MJ_all(q.size(), n);
  J_all << J_held, J_t(Eigen::all, stuck);
  MJ_all << MJ(Eigen::all, held), MJ_t(Eigen::all, stuck);
  const Matrix W_all = mass.solve_columns(MJ_all);
  const Eigen::CompleteOrthogonalDecomposition<Matrix> G_all(J_all.transpose() * W_all);
  v -= W_all * G_all.solve(Vector(J_all.transpose() * v));
}

int piece_on_grid(double t, double T, int n, double& until) {
  const double H = T / n, place = t / H;
  const bool is_on_grid = std::abs(place - std::round(place)) < kGrid;
  const auto first = is_on_grid ? std::lround(place) : static_cast<long>(std::floor(place));
  const auto last = static_cast<long>(std::floor(until / H + kGrid));
  if (is_on_grid && last > first) {
    until = last == n ? T : std::min(until, H * static_cast<double>(last));
    return static_cast<int>(last - first);
  }
  until = std::min(until, H * static_cast<double>(first + 1));
  return 1;
}

ActingContact acting_contact(const Problem& region, const Solution& piece) {
  const auto event =
      std::ranges::find_if(piece.events, [&](const Event& e) { return acts_on_sliding(region, e.contact); });
  const bool has_event = event != piece.events.end();
  for (int i = 0; i < std::ssize(piece.initial_modes); ++i) {
    const bool begins_with_event = has_event && event->contact == i && event->t <= kBegin * region.info().end_time;
    if (is_closed(piece.initial_modes[static_cast<std::size_t>(i)]) && acts_on_sliding(region, i) && !begins_with_event)
      return {.contact = i, .t = 0, .is_closed = true};
  }
  return has_event ? ActingContact{.contact = event->contact, .t = event->t, .is_closed = false} : ActingContact();
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
  for (CapturedGroup& capture : piece.captures) {
    capture.t += t;
    whole.captures.push_back(capture);
  }
  for (OpenWedge& wedge : piece.wedges) {
    wedge.t += t;
    whole.wedges.push_back(std::move(wedge));
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
