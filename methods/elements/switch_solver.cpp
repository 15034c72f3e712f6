#include "methods/elements/switch_solver.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

constexpr int kMaxSwitchNewton = 30;

}  // namespace

SwitchSolver::SwitchSolver(ElementSystem& system, double tolerance)
    : system_(system), function_(system), affine_(system, function_, tolerance), tolerance_(tolerance) {
  dq_ = dv_ = stage_dq_ = stage_dv_ = Matrix::Zero(system.problem.n_q(), 2);
}

/// One Newton step of an element: how the unknowns respond to the residual and to the variation of the left end, and
/// what that makes of the right end.
void SwitchSolver::linearize(const Element& e, Matrix& response) {
  const Problem& problem = system_.problem;
  const StageTableau& tableau = system_.tableau;
  const ActiveSet& active = system_.active;
  StageWorkspace& work = system_.work;
  const int n_q = problem.n_q(), n_s = tableau.n_s, n_x = active.n_unknowns();
  const double h = k_.h;
  const StageDerivatives& K = work.K;
  const ProblemInfo::Structure& structure = problem.info().structure;
  rhs_.resize(n_s * n_x, 2);
  system_.equations.derivatives(k_, e, work);
  for (int j = 0; j < n_s; ++j) {  // (3), (4), (7) at fixed accelerations
    stage_dv_ = dv_;
    stage_dv_.col(1).noalias() += e.a.lazyProduct(tableau.A.row(j).transpose());
    stage_dq_ = dq_ + k_.h_rows[j] * dv_;
    stage_dq_.col(1) += tableau.rows[j] * e.v0;
    stage_dq_.col(1).noalias() += (2 * h) * e.a.lazyProduct(tableau.A2.row(j).transpose());
    auto dynamics = rhs_.middleRows(j * n_x, n_q);
    if (K.has_dynamics) {
      dynamics.noalias() = K.Dq[j].lazyProduct(stage_dq_);
      if (structure.force_uses_position || structure.force_uses_velocity)
        dynamics.noalias() += K.Dv[j].lazyProduct(stage_dv_);
    } else {
      dynamics.setZero();
    }
    dynamics.col(0) += work.r.segment(j * n_x, n_q);
    if (active.empty()) continue;
    auto laws = rhs_.middleRows(j * n_x + n_q, active.n_rows());
    for (const ActiveContact& contact : active.closed()) {
      const auto& support = problem.info().contacts[contact.contact].support;
      const double *Rq = K.Rq[j].data() + contact.entry, *Rv = K.Rv[j].data() + contact.entry;
      for (int row = contact.row; row < contact.row + contact.n_rows; ++row) {
        double by_q[2]{0, 0}, by_v[2]{0, 0};
        for (const int at : support) {
          for (int c = 0; c < 2; ++c) {
            by_q[c] += *Rq * stage_dq_(at, c);
            by_v[c] += *Rv * stage_dv_(at, c);
          }
          ++Rq;
          ++Rv;
        }
        const double r = work.r[j * n_x + n_q + row];
        laws(row, 0) = by_q[0] + by_v[0] + r;
        laws(row, 1) = by_q[1] + by_v[1] - active.row_power(row) / h * r;
      }
    }
  }
  if (!active.empty()) system_.unknowns.gather_forces(e, work.x);
  system_.newton.solve_once(k_, K, rhs_, work.x, response);

  dq_ += h * dv_;  // (5)
  dq_.col(1) += e.v0;
  for (int l = 0; l < n_s; ++l) {
    const auto dw = response.middleRows(l * n_x, n_q);
    dq_ += k_.h2bA[l] * dw;
    dv_ += k_.hb[l] * dw;
    dq_.col(1) += (2 * h * tableau.bA[l]) * e.a.col(l);
    dv_.col(1) += tableau.b[l] * e.a.col(l);
  }
}

/// An element starts where the one before ends. The last one ends with the switch.
void SwitchSolver::hand_over(std::span<Element> run, std::size_t m) const {
  system_.active.set_slip_end(m + 1 == run.size() ? slip_end_ : SlipEnd{});
  run[m].h = k_.h;
  if (m == 0) return;
  run[m].q0 = run[m - 1].q1;
  run[m].v0 = run[m - 1].v1;
}

/// Newton's correction of all unknowns and of h. @return false when it asks for no finite length
bool SwitchSolver::iterate(std::span<Element> run, const Switch& end, double h, Progress& progress,
                           bool& is_contradictory) {
  StageEquations& equations = system_.equations;
  StageWorkspace& work = system_.work;
  k_.set(system_.tableau, h);
  dq_.setZero();
  dv_.setZero();
  for (std::size_t m = 0; m < run.size(); ++m) {
    hand_over(run, m);
    equations.set_initial_values(run[m], h, work);
    equations.set_stages(k_, run[m], work);
    equations.residual(k_, run[m], work);
    linearize(run[m], responses_[m]);
    is_contradictory = system_.is_redundant() && !system_.is_consistent(run[m], h);
    system_.set_right_end(k_, run[m]);
    if (run[m].is_projected) system_.end.project_variations(run[m], dq_, dv_, system_.end_work);
    if (m + 1 == run.size()) system_.set_end_forces(run[m]);
  }
  ++system_.counters.inner_iterations;
  Eigen::RowVector2d slope;
  const RunResponse response{dq_, dv_, responses_[run.size() - 1]};
  const double value = function_.deflated(run.back(), end, h, response, slope);
  progress.full_dh = -(value + slope[0]) / slope[1];
  if (!std::isfinite(progress.full_dh)) {
    // A body at rest and a guess without accelerations: these come first.
    if (!progress.is_first) return false;
    progress.full_dh = 0;
  }
  progress.dh = std::clamp(progress.full_dh, -0.7 * h, 2 * h);  // keeps h positive on the way

  progress.correction = 0;
  for (std::size_t m = 0; m < run.size(); ++m) {
    correction_ = responses_[m].col(0) + progress.dh * responses_[m].col(1);
    const double correction = system_.unknowns.correct(correction_.data(), h, work.K, run[m]),
                 scale = system_.unknowns.velocity_scale(run[m], h, work.load);
    progress.correction = std::max(progress.correction, scale > 0 ? correction / scale : 0.0);
  }
  return true;
}

/// The values of a run whose unknowns and length are known.
void SwitchSolver::finish(std::span<Element> run, double h) {
  k_.set(system_.tableau, h);
  for (std::size_t m = 0; m < run.size(); ++m) {
    hand_over(run, m);
    system_.equations.set_stages(k_, run[m], system_.work);
    system_.set_right_end(k_, run[m]);
    system_.equations.set_slip_in_space(run[m]);
    if (system_.active.slip_end().together) function_.spread_friction(run[m]);
    system_.set_end_forces(run[m]);
  }
}

SwitchSolver::Result SwitchSolver::solve(std::span<Element> run, const Switch& end, double max_h) {
  if (properties(end.kind).needs_force && system_.tableau.right_end.size() == 0) return Result::singular;
  const bool comes_to_rest = end.kind == SwitchKind::slip_stops && run.front().modes[end.contact] == ContactMode::slip;
  if (comes_to_rest && !system_.tableau.ends_with_stage) return Result::singular;
  for (Element& e : run) system_.set_active(e);
  slip_end_ = comes_to_rest ? SlipEnd{end.contact, end.together} : SlipEnd{};  // (8), (9)
  system_.active.set_slip_end(slip_end_);
  return system_.affine() ? affine_.solve(run, end, max_h) : solve_by_newton(run, end, max_h);
}

SwitchSolver::Result SwitchSolver::solve_by_newton(std::span<Element> run, const Switch& end, double max_h) {
  if (responses_.size() < run.size()) responses_.resize(run.size());
  bool is_contradictory = false;  // the last element, as far as redundant contacts go
  double h = run.front().h, previous = 0;
  for (int iteration = 0; iteration < kMaxSwitchNewton; ++iteration) {
    Progress progress{.is_first = iteration == 0};
    if (!iterate(run, end, h, progress, is_contradictory)) return Result::singular;
    const auto [is_first, correction, dh, full_dh] = progress;
    const double size = std::max(correction, std::abs(full_dh) / h);
    h += dh;
    if (!std::isfinite(size)) return Result::no_convergence;
    const double contraction = is_first ? 1 : size / previous;
    // In short elements, forces give the time of a switch with a rounding error that is not relative to h; so does a
    // gap that closes slowly.
    const bool is_time_rounding = std::abs(full_dh) <= 1e-9 * max_h && dh == full_dh;
    const bool stagnates = iteration > 3 && contraction > 0.5 && correction <= 1e-9;
    // Newton is quadratic: the error after this correction is about its square.
    const bool is_converged = (!is_first && size <= tolerance_) ||
                              (!is_first && contraction < 0.1 && size * contraction <= tolerance_) ||
                              (stagnates && (is_time_rounding || function_.is_rounding_of_gap(run.back(), end)));
    if (is_converged && is_contradictory) return Result::no_convergence;
    if (is_converged) {
      finish(run, h);
      return h <= max_h ? Result::converged : Result::left_interval;
    }
    if (h > 4 * max_h || h < 1e-14 * max_h) return Result::left_interval;
    previous = size;
  }
  return Result::no_convergence;
}

}  // namespace ricochet
