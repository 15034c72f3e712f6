#include "methods/time_freezing/pseudo_time_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

constexpr int kMaxNewton = 30;
// A pivot of redundant contacts, relative to its column: rounding.
constexpr double kDependent = 1e-12;
// Newton's corrections may stall at the rounding of the equations of index 2, divided by h.
constexpr double kStalled = 1e-9;
// Contraction above which factors are renewed.
constexpr double kContraction = 0.02;

}  // namespace

PseudoTimeSolver::PseudoTimeSolver(const Problem& problem, const ButcherTableau& tableau,
                                   const AuxiliaryDynamics& auxiliary, double tolerance, Counters& counters)
    : info_(problem.info()),
      tableau_(tableau),
      tolerance_(tolerance),
      counters_(counters),
      held_(problem.info(), tableau.n_s),
      equations_(problem, tableau, auxiliary, held_, counters),
      end_(problem, tableau, held_) {
  equations_.prepare(work_);
}

void PseudoTimeSolver::set_regions(const Regions& regions) {
  if (!held_.set(regions)) return;
  has_factors_ = false;
  equations_.resize(work_);
  x_.resize(held_.n_unknowns());
}

bool PseudoTimeSolver::solve_to_clock(PseudoTimeElement& e, double dt) {
  return solve(e, dt);
}

bool PseudoTimeSolver::solve_length(PseudoTimeElement& e, double length) {
  e.h = length;
  return solve(e, 0);
}

bool PseudoTimeSolver::solve(PseudoTimeElement& e, double dt) {
  equations_.begin(e, work_);
  bool contracts = true;
  double last = INFINITY;
  for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
    const bool refresh = !has_factors_ || is_redundant_ || !contracts;
    equations_.set_stages(e, work_);
    equations_.evaluate(e, dt, refresh, work_);
    if (!work_.r.allFinite()) return false;
    if (refresh) factorize();
    if (is_redundant_) {
      x_ = least_squares(work_.K, work_.r);
    } else {
      x_ = work_.r;
      lu_.solve_in_place(x_.data());
    }
    ++counters_.inner_iterations;
    ++counters_.linear_solves;
    if (!x_.allFinite()) return has_factors_ = false;
    // The size includes the velocity that the load causes, since a body may be at rest.
    double size = std::max({e.v0.lpNorm<Eigen::Infinity>(), e.h * work_.load, std::numeric_limits<double>::min()});
    const double change = apply_correction(e, dt, size);
    if (change <= tolerance_ * size || (change <= kStalled * size && change >= 0.5 * last)) {
      equations_.set_right_end(e, work_);
      end_.correct(e);
      return e.q1.allFinite() && e.v1.allFinite();
    }
    contracts = iteration == 0 || change <= kContraction * last;
    last = change;
  }
  return has_factors_ = false;
}

void PseudoTimeSolver::factorize() {
  lu_.factorize(work_.K);
  ++counters_.matrix_factorizations;
  is_redundant_ = !(lu_.smallest_pivot() > kDependent);
  has_factors_ = true;
}

/// Subtracts x_. @param size  of velocities, raised @return the largest change of a velocity
double PseudoTimeSolver::apply_correction(PseudoTimeElement& e, double dt, double& size) const {
  const int n_q = info_.n_q;
  double change = 0;
  for (int j = 0; j < tableau_.n_s; ++j) {
    const auto x = x_.segment(j * held_.n_stage(), held_.n_stage());
    e.w.col(j) -= x.head(n_q);
    e.s[j] -= x[n_q];
    change = std::max(change, e.h * x.head(n_q).lpNorm<Eigen::Infinity>());
    size = std::max(size, e.h * e.w.col(j).lpNorm<Eigen::Infinity>());
    for (const HeldContact& held : held_.all()) {
      const ContactInfo& contact = info_.contacts[held.contact];
      const int row = held_.row_of(held);
      e.beta(held.contact, j) -= x[row];
      if (!held_.region(held).sticks) continue;
      for (int d = 0; d < contact.n_t; ++d) e.tau(contact.tangent_index + d, j) -= x[row + 1 + d];
    }
  }
  if (held_.is_frozen()) return change;
  const double dh = x_[x_.size() - 1];
  e.h -= dh;
  return std::max(change, std::abs(dh) / dt * size);
}

}  // namespace ricochet
