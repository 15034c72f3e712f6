#include "problems/run_pieces.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

constexpr double kDrift = 1e-6;  // of gaps and rates of closed contacts, relative
constexpr double kGrid = 1e-9;   // of a step: on the grid

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

void add_counters(const Counters& part, Counters& sum) {
  for (const auto counter :
       {&Counters::steps, &Counters::elements, &Counters::force_evaluations, &Counters::jacobian_evaluations,
        &Counters::mass_factorizations, &Counters::matrix_factorizations, &Counters::linear_solves,
        &Counters::complementarity_solves, &Counters::inner_iterations, &Counters::pivots, &Counters::events})
    sum.*counter += part.*counter;
}

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
  const auto is_in_one = [&](int i) {
    return std::ranges::any_of(whole.wedges, [&](const auto& w) { return std::ranges::count(w.contacts, i) > 0; });
  };
  for (OpenWedge& wedge : piece.wedges) {
    wedge.t += t;
    if (!std::ranges::all_of(wedge.contacts, is_in_one)) whole.wedges.push_back(std::move(wedge));
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
