#include "methods/elements/stage_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "methods/elements/redundant_system.h"
#include "problems/dense_solve.h"
#include "problems/packed_column.h"

namespace ricochet {
namespace {

constexpr int kMaxNewton = 30;
// Rounding of q_0 moves the gap by about 1e-16 of its size per step; from here on it is removed.
constexpr double kGapDrift = 1e-13;
// The same for slip velocities, which a switch makes zero to the accuracy of Newton's method.
constexpr double kSlipDrift = 1e-13;
// What equations of redundant contacts may be left with at the end of Newton's method, relative to the accelerations.
constexpr double kContradiction = 1e-9;
// Of differences of forces, relative to the state: their error is its square, and Newton's method goes on with it.
constexpr double kDifference = 1e-4;
// Element lengths that alternate: full step, rest after an impact, ...
constexpr std::size_t kMaxLengths = 8;
// What rounding leaves of a gap that closes, relative to the positions that it is a difference of.
constexpr double kGapRounding = 8 * std::numeric_limits<double>::epsilon();
// Far below anything physical in SI units, and far above subnormal numbers.
constexpr double kVanishing = 1e-250;

/// What rounding leaves of a body at rest decays from step to step, down to subnormal numbers: arithmetic with these
/// takes a hundred times as long.
void clear_vanishing(double* x, Eigen::Index n) {
  for (Eigen::Index k = 0; k < n; ++k) x[k] = std::abs(x[k]) < kVanishing ? 0 : x[k];
}

}  // namespace

void Element::resize(const ProblemInfo& info, int n_s) {
  q0 = v0 = q1 = v1 = Vector::Zero(info.n_q);
  q = v = a = Matrix::Zero(info.n_q, n_s);
  lambda_n = Matrix::Zero(info.n_c(), n_s);
  lambda_t = Matrix::Zero(info.n_lambda_t, n_s);
  slip_start = end_lambda_t = Vector::Zero(info.n_lambda_t);
  end_lambda_n = Vector::Zero(info.n_c());
  modes.assign(info.contacts.size(), ContactMode::open);
  facets.assign(has_friction_in_space(info) ? info.contacts.size() : 0, 0);
  for (const int i : info.bilateral) modes[i] = ContactMode::closed;
}

StageSolver::StageSolver(const Problem& problem, const ButcherTableau& tableau, double tolerance, Counters& counters,
                         const FrictionPolygon& polygon)
    : problem_(problem),
      tableau_(tableau),
      tolerance_(tolerance),
      counters_(counters),
      polygon_(polygon),
      n_q_(problem.n_q()),
      n_s_(tableau.n_s),
      structure_(problem.info().structure),
      stiffly_accurate_(tableau.is_stiffly_accurate()),
      newton_(problem, tableau.n_s, counters) {
  A2_ = tableau.A * tableau.A;
  bA_ = tableau.A.transpose() * tableau.b;
  rows_ = tableau.A.rowwise().sum();
  if (structure_.constant_mass) M_ = problem.mass_matrix(problem.info().q0);

  if (tableau.right_end.size() > 0 && (n_s_ == 1 || tableau.c.maxCoeff() > tableau.c.minCoeff())) {
    extrapolation_ = Matrix::Ones(n_s_, n_s_);
    for (int j = 0; j < n_s_; ++j) {
      for (int k = 0; k < n_s_; ++k) {
        for (int m = 0; m < n_s_; ++m) {
          if (m != k) extrapolation_(j, k) *= (1 + tableau.c[j] - tableau.c[m]) / (tableau.c[k] - tableau.c[m]);
        }
      }
    }
  }

  const int n_c = problem.n_c();
  f_.resize(n_q_);
  J_n_.resize(problem.info().n_normal_entries);
  J_t_.resize(problem.info().n_tangent_entries);
  chord_J_.resize(problem.info().n_normal_entries);
  chord_q_.resize(n_q_);
  gap_.resize(n_c);
  gap_change_.setZero(n_c);
  chord_variation_.setZero(n_c);
  gap0_.setZero(n_c);
  kept_gap0_.setZero(n_c);
  gap_size_.setZero(n_c);
  kept_slip0_.setZero(problem.info().n_lambda_t);
  dq_.setZero(n_q_, n_s_);
  lambda_.setZero(n_c);
  lambda_t_.setZero(problem.info().n_lambda_t);
  Tq_.setZero(problem.info().n_lambda_t, n_q_);
  Ta_ = Tq_;
  // Of the dense matrices only those that the scene needs: of thousands of bodies they are large.
  const Matrix square = Matrix::Zero(n_q_, n_q_);
  const bool is_curved = std::ranges::any_of(problem.info().contacts, [](const auto& c) { return !c.is_affine; });
  has_force_jacobian_ = structure_.force_uses_position || structure_.force_uses_velocity;
  if (has_force_jacobian_) Fq_ = Fv_ = square;
  if (is_curved) Jq_ = M_end_ = square;
  if (!structure_.constant_mass) Mq_ = square;
  derivatives_.Dq.resize(n_s_);
  if (has_force_jacobian_ || is_curved || !structure_.constant_mass) derivatives_.Dq.assign(n_s_, square);
  derivatives_.Dv = derivatives_.Dq;
  if (!structure_.constant_mass) stage_M_.assign(n_s_, square);
  for (int j = 0; j < n_s_; ++j) derivatives_.M.push_back(structure_.constant_mass ? M_.data() : stage_M_[j].data());
  for (auto* vectors : {&derivatives_.forces, &derivatives_.Rq, &derivatives_.Rv, &derivatives_.Rl})
    vectors->resize(n_s_);
  incoming_q_ = incoming_v_ = stage_dq_ = stage_dv_ = Matrix::Zero(n_q_, 2);
  coefficients_.resize(kMaxLengths);
  for (auto& k : coefficients_) set_length(k, 0);
  set_active(std::vector<ContactMode>(static_cast<std::size_t>(n_c), ContactMode::open), {});
}

void StageSolver::set_length(StageCoefficients& k, double h) const {
  k.h = h;
  k.hA = h * tableau_.A;
  k.h2A2 = (h * h) * A2_;
  k.hb = h * tableau_.b;
  k.h2bA = (h * h) * bA_;
  k.h_rows = h * rows_;
}

void StageSolver::set_active(const std::vector<ContactMode>& modes, const std::vector<int>& facets) {
  if (modes == modes_ && facets == facets_ && n_x_ > 0) return;
  modes_ = modes;
  facets_ = facets;
  closed_.clear();
  is_closed_.assign(modes.size(), 0);
  row_power_.clear();
  has_friction_ = false;
  is_affine_ = structure_.constant_mass && structure_.constant_force_jacobian;
  has_curved_ = false;
  int entries = 0;
  for (std::size_t i = 0; i < modes.size(); ++i) {
    if (modes[i] == ContactMode::open) continue;
    const auto& contact = problem_.info().contacts[i];
    is_closed_[i] = 1;
    const bool turns = modes[i] == ContactMode::slip;  // (7c)
    const TangentialLaw law = polygon_.law(modes[i], contact.n_t, facets.empty() ? 0 : facets[i]);
    closed_.push_back({.contact = static_cast<int>(i),
                       .mode = modes[i],
                       .facet = facets.empty() ? 0 : facets[i],
                       .row = static_cast<int>(row_power_.size()),
                       .n_rows = 1 + (turns ? contact.n_t : law.n_held),
                       .entry = entries,
                       .law = law});
    entries += closed_.back().n_rows * static_cast<int>(contact.support.size());
    row_power_.push_back(2);
    for (int d = 1; d < closed_.back().n_rows; ++d) row_power_.push_back(turns ? 0 : 1);
    has_friction_ = has_friction_ || contact.n_t > 0;
    has_curved_ = has_curved_ || !contact.is_affine;
    is_affine_ = is_affine_ && contact.is_affine && !turns;
  }
  is_projected_ = stiffly_accurate_ && has_curved_;
  const int n_rows = static_cast<int>(row_power_.size());
  n_x_ = n_q_ + n_rows;
  if (is_projected_) {
    held_.setZero(n_q_, n_rows);
    pushed_.setZero(n_q_, n_rows);
  }
  end_directions_.setZero(2, static_cast<Eigen::Index>(closed_.size()));
  // A predicted correction of dw says little about what (3) is left with where closed contacts turn.
  predicted_tolerance_ = closed_.empty() ? tolerance_ : 0.1 * tolerance_;
  r_.resize(n_s_ * n_x_);
  dx_.resize(n_s_ * n_x_);
  x_.setZero(n_s_ * n_x_);
  rhs_.resize(n_s_ * n_x_, 2);
  for (int j = 0; j < n_s_; ++j) {
    for (auto* vectors : {&derivatives_.forces, &derivatives_.Rq, &derivatives_.Rv}) (*vectors)[j].setZero(entries);
    derivatives_.Rl[j].setZero(9 * static_cast<Eigen::Index>(closed_.size()));
  }
  derivatives_.has_dynamics = has_force_jacobian_ || has_curved_ || !structure_.constant_mass;
  newton_.set_active(closed_, n_rows);
}

/// Decides what of f_c(q_0) equation (4) removes, and what of J_t' v_0 equation (7a).
void StageSolver::set_initial_values(const Element& step, double h) {
  if (closed_.empty()) return;
  problem_.gap(step.q0.data(), gap0_.data());
  problem_.normal_jacobian_of(is_closed_.data(), step.q0.data(), J_n_.data());
  if (has_friction_) problem_.tangent_jacobian_of(is_closed_.data(), step.q0.data(), J_t_.data());
  for (const ActiveContact& active : closed_) {
    const int i = active.contact;
    const auto& contact = problem_.info().contacts[i];
    const double* J = J_n_.data() + contact.normal_begin;
    const double velocity = packed_terms(contact, J, step.v0);
    // q may pass through zero, and keeps its rounding.
    gap_size_[i] = std::max(gap_size_[i], packed_terms(contact, J, step.q0));
    const bool is_drift = std::abs(gap0_[i]) > kGapDrift * gap_size_[i];
    const bool is_harmless = std::abs(gap0_[i]) <= 1e-8 * h * velocity;
    kept_gap0_[i] = is_drift && is_harmless ? gap0_[i] : 0;
    for (int k = 0; k < active.n_rows - 1; ++k) {
      const double* J_t = J_t_.data() + contact.tangent_begin;
      double slip = 0, size = 0;
      for (int d = 0; d < contact.n_t; ++d) {
        for (const int row : contact.support) {
          const double part = active.law.held[k][d] * *J_t++ * step.v0[row];
          slip += part;
          size += std::abs(part);
        }
      }
      kept_slip0_[contact.tangent_index + k] = std::abs(slip) > kSlipDrift * size ? slip : 0;
    }
  }
}

/// (8) or (9) holds for the contact at this stage.
bool StageSolver::rests(const ActiveContact& active, int stage) const {
  if (active.mode != ContactMode::slip || stage != n_s_ - 1) return false;
  const auto& contacts = problem_.info().contacts;
  return active.contact == resting_contact_ ||
         (rest_together_ && contacts[active.contact].support == contacts[resting_contact_].support);
}

/// Number of tangent directions, Active::law.held, in which (7a) holds for the contact at this stage.
int StageSolver::n_held(const ActiveContact& active, int stage) const {
  return rests(active, stage) ? problem_.info().contacts[active.contact].n_t : active.law.n_held;
}

/// Direction d of slip in lambda_t = -mu lambda_n d + ..., a unit vector of (7b), (7c) at velocity v, with J_t_
/// evaluated there; returns ||v_t||, 0 when the direction does not depend on it.
double StageSolver::slip_direction(const ActiveContact& active, const double* v, const Element& step,
                                   double* direction) const {
  const auto& contact = problem_.info().contacts[active.contact];
  if (active.mode != ContactMode::slip) {
    std::copy_n(active.law.along.data(), 2, direction);
    return 0;
  }
  const double* J_t = J_t_.data() + contact.tangent_begin;
  for (int d = 0; d < 2; ++d) {
    direction[d] = 0;
    for (const int row : contact.support) direction[d] += *J_t++ * v[row];
  }
  const double speed = std::hypot(direction[0], direction[1]);
  const double* start = step.slip_start.data() + contact.tangent_index;
  const bool has_start = start[0] != 0 || start[1] != 0;
  if (has_start && (is_frozen_ || speed == 0)) {
    std::copy_n(start, 2, direction);
    return 0;
  }
  for (int d = 0; d < 2; ++d) direction[d] /= speed;
  return speed;
}

/// (1) and (2)
void StageSolver::stage_values(const StageCoefficients& k, Element& step) {
  const int n = n_q_;
  const double *a = step.a.data(), *q0 = step.q0.data(), *v0 = step.v0.data();
  for (int j = 0; j < n_s_; ++j) {
    const double *hA = &k.hA(j, 0), *h2A2 = &k.h2A2(j, 0), h_row = k.h_rows[j];
    double *q = step.q.data() + j * n, *v = step.v.data() + j * n;
    for (int i = 0; i < n; ++i) {
      double dv = 0, dq = 0;
      for (int l = 0; l < n_s_; ++l) {
        dv += hA[l] * a[l * n + i];
        dq += h2A2[l] * a[l * n + i];
      }
      v[i] = v0[i] + dv;
      dq_(i, j) = h_row * v0[i] + dq;
      q[i] = q0[i] + dq_(i, j);
    }
  }
}

/// (5)
void StageSolver::end_values(const StageCoefficients& k, Element& step) {
  if (stiffly_accurate_) {
    step.q1 = step.q.col(n_s_ - 1);
    step.v1 = step.v.col(n_s_ - 1);
  } else {
    for (int i = 0; i < n_q_; ++i) {
      double dv = 0, dq = 0;
      for (int l = 0; l < n_s_; ++l) {
        dv += k.hb[l] * step.a(i, l);
        dq += k.h2bA[l] * step.a(i, l);
      }
      step.v1[i] = step.v0[i] + dv;
      step.q1[i] = step.q0[i] + (k.h * step.v0[i] + dq);
    }
  }
  if (is_projected_) project_end_velocity(step);
}

/// (10)
void StageSolver::project_end_velocity(Element& step) {
  set_end_system(step.q1, step.v1, step);
  end_rates_.noalias() = held_.leftCols(n_end_).transpose().lazyProduct(step.v1);
  take_away_end_rates(step.v1);
}

/// R, M^-1 C and the inverse of R' M^-1 C at q, v
void StageSolver::set_end_system(const Vector& q, const Vector& v, const Element& step) {
  if (!structure_.constant_mass || llt_.cols() == 0) {
    problem_.mass_matrix(q.data(), M_end_.data());
    llt_.compute(M_end_);
    ++counters_.mass_factorizations;
  }
  problem_.normal_jacobian_of(is_closed_.data(), q.data(), J_n_.data());
  if (has_friction_) problem_.tangent_jacobian_of(is_closed_.data(), q.data(), J_t_.data());
  held_.setZero();
  pushed_.setZero();
  n_end_ = 0;
  for (std::size_t k = 0; k < closed_.size(); ++k) {
    const ActiveContact& active = closed_[k];
    const auto& contact = problem_.info().contacts[active.contact];
    const auto entries = static_cast<int>(contact.support.size()), n_pushed = static_cast<int>(contact.pushed().size());
    const double *J_n = J_n_.data() + contact.normal_begin, *J_t = J_t_.data() + contact.tangent_begin;
    double* direction = end_directions_.col(static_cast<Eigen::Index>(k)).data();
    std::fill_n(direction, 2, 0.0);
    if (contact.n_t > 0 && !rests(active, n_s_ - 1)) slip_direction(active, v.data(), step, direction);
    for (int s = 0; s < entries; ++s) held_(contact.support[s], n_end_) = J_n[s];
    for (int s = 0; s < n_pushed; ++s) {
      pushed_(contact.support[s], n_end_) = J_n[s];
      for (int d = 0; d < contact.n_t; ++d)
        pushed_(contact.support[s], n_end_) -= contact.mu * direction[d] * J_t[d * entries + s];
    }
    ++n_end_;
    for (int m = 0; m < n_held(active, n_s_ - 1); ++m, ++n_end_) {
      for (int s = 0; s < entries; ++s) {
        for (int d = 0; d < contact.n_t; ++d)
          held_(contact.support[s], n_end_) += active.law.held[m][d] * J_t[d * entries + s];
        if (s < n_pushed) pushed_(contact.support[s], n_end_) = held_(contact.support[s], n_end_);
      }
    }
  }
  const auto R = held_.leftCols(n_end_);
  auto MC = pushed_.leftCols(n_end_);
  for (Eigen::Index k = 0; k < n_end_; ++k) llt_.solveInPlace(MC.col(k));
  end_system_.noalias() = R.transpose().lazyProduct(MC);
  end_inverse_ = end_lu_.of(end_system_);
  if (RedundantSystem::is_singular(end_system_, end_inverse_)) end_inverse_ = pseudo_inverse(end_system_);
}

/// (11), behind set_end_system(), in lambda_ and lambda_t_
void StageSolver::constrained_forces(const Vector& q, const Vector& v) {
  problem_.force(q.data(), v.data(), problem_.info().u.data(), f_.data());
  llt_.solveInPlace(f_);
  end_rates_.noalias() = held_.leftCols(n_end_).transpose().lazyProduct(f_);
  problem_.gap_acceleration_bias(q.data(), v.data(), gap_.data());
  if (has_friction_) problem_.slip_velocity_derivative(q.data(), v.data(), Tq_.data());
  Eigen::Index row = 0;
  for (const ActiveContact& active : closed_) {
    const auto& contact = problem_.info().contacts[active.contact];
    end_rates_[row++] += gap_[active.contact];
    for (int m = 0; m < n_held(active, n_s_ - 1); ++m, ++row) {
      for (int d = 0; d < contact.n_t; ++d)
        end_rates_[row] += active.law.held[m][d] * Tq_.row(contact.tangent_index + d).dot(v);
    }
  }
  end_impulses_.noalias() = end_inverse_.lazyProduct(end_rates_);
  lambda_.setZero();
  lambda_t_.setZero();
  row = 0;
  for (std::size_t k = 0; k < closed_.size(); ++k) {
    const auto& contact = problem_.info().contacts[closed_[k].contact];
    const double lambda_n = lambda_[closed_[k].contact] = -end_impulses_[row++];
    const int held = n_held(closed_[k], n_s_ - 1);
    for (int d = 0; d < contact.n_t; ++d) {
      double& lambda_t = lambda_t_[contact.tangent_index + d];
      lambda_t = -contact.mu * lambda_n * end_directions_(d, static_cast<Eigen::Index>(k));
      for (int m = 0; m < held; ++m) lambda_t -= closed_[k].law.held[m][d] * end_impulses_[row + m];
    }
    row += held;
  }
}

void StageSolver::set_end_forces(Element& step) {
  step.is_projected = is_projected_;
  if (is_projected_) {
    // The direction of slip in space follows the projected velocity.
    const auto turns = [](const ActiveContact& active) { return active.mode == ContactMode::slip; };
    if (std::any_of(closed_.begin(), closed_.end(), turns)) set_end_system(step.q1, step.v1, step);
    constrained_forces(step.q1, step.v1);
    step.end_lambda_n = lambda_;
    step.end_lambda_t = lambda_t_;
  } else if (closed_.empty()) {
    step.end_lambda_n.setZero();
    step.end_lambda_t.setZero();
  } else if (tableau_.right_end.size() > 0) {
    step.end_lambda_n.noalias() = step.lambda_n.lazyProduct(tableau_.right_end);
    step.end_lambda_t.noalias() = step.lambda_t.lazyProduct(tableau_.right_end);
    for (const ActiveContact& active : closed_) {  // extrapolated, a force that turns leaves its cone
      if (stiffly_accurate_ || active.mode != ContactMode::slip) continue;
      const auto& contact = problem_.info().contacts[active.contact];
      auto lambda_t = step.end_lambda_t.segment(contact.tangent_index, contact.n_t);
      const double force = lambda_t.norm();
      if (force > 0) lambda_t *= contact.mu * step.end_lambda_n[active.contact] / force;
    }
  }
}

/// x -= M^-1 C (R' M^-1 C)^-1 end_rates_
void StageSolver::take_away_end_rates(Eigen::Ref<Vector> x) {
  end_impulses_.noalias() = end_inverse_.lazyProduct(end_rates_);
  x.noalias() -= pushed_.leftCols(end_rates_.size()).lazyProduct(end_impulses_);
}

/// The same for the variations of v_1: R' dv_1 + dR' v_1 = 0, with v' (grad^2 f_c) dq as a difference of two bias
/// terms. Variations of C are left out, since the impulses are O(h^n_s).
void StageSolver::project_variations(const Element& step) {
  if (has_friction_) problem_.slip_velocity_derivative(step.q1.data(), step.v1.data(), Tq_.data());
  for (Eigen::Index c = 0; c < 2; ++c) {
    const auto dq = incoming_q_.col(c);
    end_rates_.noalias() = held_.leftCols(end_rates_.size()).transpose().lazyProduct(incoming_v_.col(c));
    for (const double sign : {1.0, -1.0}) {
      chord_q_ = step.v1 + sign * dq;
      problem_.gap_acceleration_bias(step.q1.data(), chord_q_.data(), gap_.data());
      Eigen::Index row = 0;
      for (const ActiveContact& active : closed_) {
        end_rates_[row++] += sign / 4 * gap_[active.contact];
        row += n_held(active, n_s_ - 1);
      }
    }
    Eigen::Index row = 0;
    for (const ActiveContact& active : closed_) {
      const auto& contact = problem_.info().contacts[active.contact];
      ++row;
      for (int m = 0; m < n_held(active, n_s_ - 1); ++m, ++row) {
        for (int d = 0; d < contact.n_t; ++d)
          end_rates_[row] += active.law.held[m][d] * Tq_.row(contact.tangent_index + d).dot(dq);
      }
    }
    take_away_end_rates(incoming_v_.col(c));
  }
}

/// (6)  f_c(q_0 + dq) - f_c(q_0) = int_0^1 J_n(q_0 + s dq)' dq ds, by four Gauss points. If J_n changes by less than 1
/// % over the chord, the error is about (1 %)^8 of the result; else the plain difference is accurate enough.
/// For all closed contacts that are curved, in gap_change_. J_n_ and gap_ are those of the stage.
void StageSolver::gap_changes(int stage, const Element& step) {
  static constexpr double nodes[] = {0.069431844202973712, 0.33000947820757187, 0.66999052179242813,
                                     0.93056815579702629};
  static constexpr double weights[] = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307,
                                       0.17392742256872693};
  const auto dq = dq_.col(stage);
  gap_change_.setZero();
  chord_variation_.setZero();
  for (int m = 0; m < 4; ++m) {
    chord_q_ = step.q0 + nodes[m] * dq;
    problem_.normal_jacobian_of(is_closed_.data(), chord_q_.data(), chord_J_.data());
    for (const ActiveContact& active : closed_) {
      const auto& info = problem_.info().contacts[active.contact];
      for (std::size_t s = 0; s < info.support.size(); ++s) {
        const std::size_t entry = info.normal_begin + s;
        double& variation = chord_variation_[active.contact];
        gap_change_[active.contact] += weights[m] * chord_J_[entry] * dq[info.support[s]];
        variation = std::max(variation, std::abs(chord_J_[entry] - J_n_[entry]));
      }
    }
  }
  for (const ActiveContact& active : closed_) {
    const int i = active.contact;
    const auto& info = problem_.info().contacts[i];
    const auto entries = static_cast<Eigen::Index>(info.support.size());
    const double size = J_n_.segment(static_cast<Eigen::Index>(info.normal_begin), entries).lpNorm<Eigen::Infinity>();
    if (chord_variation_[i] > 0.01 * size) gap_change_[i] = gap_[i] - gap0_[i];
  }
}

/// (3), (4) and (7), stage after stage
void StageSolver::residual(const StageCoefficients& k, const Element& step) {
  const int n = n_q_;
  const double* u = problem_.info().u.data();
  counters_.force_evaluations += n_s_;
  load_ = 0;
  for (int j = 0; j < n_s_; ++j) {
    const double *q = step.q.data() + j * n, *v = step.v.data() + j * n, *a = step.a.data() + j * n;
    double* r = r_.data() + j * n_x_;
    problem_.force(q, v, u, f_.data());
    if (!structure_.constant_mass) problem_.mass_matrix(q, stage_M_[j].data());
    const double* M = derivatives_.M[j];
    for (int i = 0; i < n; ++i) load_ = std::max(load_, std::abs(f_[i]) / M[i * (n + 1)]);
    if (structure_.diagonal_mass) {
      for (int i = 0; i < n; ++i) r[i] = M[i * (n + 1)] * a[i] - f_[i];
    } else {
      for (int i = 0; i < n; ++i) {
        double Ma = 0;
        for (int l = 0; l < n; ++l) Ma += M[l * n + i] * a[l];
        r[i] = Ma - f_[i];
      }
    }
    if (closed_.empty()) continue;
    problem_.normal_jacobian_of(is_closed_.data(), q, J_n_.data());
    problem_.gap(q, gap_.data());
    if (has_friction_) problem_.tangent_jacobian_of(is_closed_.data(), q, J_t_.data());
    if (has_curved_) gap_changes(j, step);
    for (const ActiveContact& active : closed_) {
      const int i = active.contact;
      const auto& contact = problem_.info().contacts[i];
      const double* J = J_n_.data() + contact.normal_begin;
      double change = 0;  // f_c(q_j) - f_c(q_0)
      for (const int row : contact.pushed()) {
        change += *J * dq_(row, j);
        r[row] -= *J++ * step.lambda_n(i, j);
      }
      if (contact.is_moving) change += *J * dq_(problem_.info().clock, j);
      if (!contact.is_affine) change = gap_change_[i];
      r[n + active.row] = (kept_gap0_[i] + change) / (k.h * k.h);
      if (contact.n_t > 0) friction_residual(k, active, j, step, r);
    }
  }
}

/// J_t lambda_t in (3), and (7)
void StageSolver::friction_residual(const StageCoefficients& k, const ActiveContact& active, int j, const Element& step,
                                    double* r) {
  const auto& contact = problem_.info().contacts[active.contact];
  const double* v = step.v.data() + j * n_q_;
  const auto change_of_v = [&](int row) {  // without the rounding of v_j
    double dv = 0;
    for (int l = 0; l < n_s_; ++l) dv += k.hA(j, l) * step.a(row, l);
    return dv;
  };
  const int held = n_held(active, j);
  const double* J_t = J_t_.data() + contact.tangent_begin;
  const double* lambda_t = step.lambda_t.col(j).data() + contact.tangent_index;
  double slip[2]{0, 0};
  for (int d = 0; d < contact.n_t; ++d) {
    for (const int row : contact.pushed()) {
      if (held > 0) slip[d] += *J_t * (contact.is_affine ? change_of_v(row) : v[row]);
      r[row] -= *J_t++ * lambda_t[d];
    }
    if (contact.is_moving) slip[d] += *J_t++ * (contact.is_affine ? 0 : v[problem_.info().clock]);
  }
  double* law = r + n_q_ + active.row + 1;
  for (int m = 0; m < held; ++m) {  // (7a)
    const double kept = contact.is_affine ? kept_slip0_[contact.tangent_index + m] : 0;
    const auto& direction = active.law.held[m];
    law[m] = (kept + direction[0] * slip[0] + direction[1] * slip[1]) / tangential_scale(active, k.h);
  }
  if (active.mode != ContactMode::slip || held > 0) return;
  double direction[2];
  slip_direction(active, v, step, direction);
  const double cone = contact.mu * step.lambda_n(active.contact, j);
  for (int d = 0; d < 2; ++d) law[d] = lambda_t[d] + cone * direction[d];  // (7c)
}

/// M and the derivatives of (3), (4), (7) at every stage
void StageSolver::derivatives(const StageCoefficients& k, const Element& step) {
  counters_.jacobian_evaluations += n_s_;
  const double* u = problem_.info().u.data();
  for (int j = 0; j < n_s_; ++j) {
    const double *q = step.q.col(j).data(), *v = step.v.col(j).data();
    Matrix &Dq = derivatives_.Dq[j], &Dv = derivatives_.Dv[j];
    if (has_force_jacobian_) {
      problem_.force_jacobians(q, v, u, Fq_.data(), Fv_.data());
      Dq = -Fq_;
      Dv = -Fv_;
    } else if (derivatives_.has_dynamics) {
      Dq.setZero();
    }
    if (!structure_.constant_mass) {
      problem_.mass_matrix(q, stage_M_[j].data());
      problem_.mass_derivative(q, step.a.col(j).data(), Mq_.data());
      Dq += Mq_;
    }
    if (closed_.empty()) continue;
    if (has_curved_) {
      lambda_ = step.lambda_n.col(j);
      if (has_friction_) lambda_t_ = step.lambda_t.col(j);
      problem_.contact_force_derivative(q, lambda_.data(), lambda_t_.data(), Jq_.data());
      Dq -= Jq_;
    }
    problem_.normal_jacobian_of(is_closed_.data(), q, J_n_.data());
    if (has_friction_) {
      problem_.tangent_jacobian_of(is_closed_.data(), q, J_t_.data());
      if (has_curved_) problem_.slip_velocity_derivative(q, v, Tq_.data());
    }
    for (const ActiveContact& active : closed_) {
      const auto& contact = problem_.info().contacts[active.contact];
      const double* J = J_n_.data() + contact.normal_begin;
      for (std::size_t s = 0; s < contact.support.size(); ++s) {
        derivatives_.forces[j][active.entry + s] = J[s];
        derivatives_.Rq[j][active.entry + s] = J[s] / (k.h * k.h);
      }
      if (contact.n_t > 0) friction_derivatives(k, active, j, step);
    }
  }
}

/// Columns of lambda_t, and the derivatives of (7)
void StageSolver::friction_derivatives(const StageCoefficients& k, const ActiveContact& active, int j,
                                       const Element& step) {
  const auto& contact = problem_.info().contacts[active.contact];
  const auto entries = static_cast<int>(contact.support.size());
  const double* J_t = J_t_.data() + contact.tangent_begin;
  double* forces = derivatives_.forces[j].data() + active.entry;
  for (int d = 0; d < contact.n_t && is_slipping(active.mode); ++d) {  // (7b)
    for (int s = 0; s < entries; ++s) forces[s] -= contact.mu * active.law.along[d] * J_t[d * entries + s];
  }
  const int held = n_held(active, j);
  const double scale = tangential_scale(active, k.h);
  double* Rl = derivatives_.Rl[j].data() + 9 * (&active - closed_.data());
  std::fill_n(Rl, 9, 0.0);
  for (int m = 0; m < active.n_rows - 1; ++m) {
    const auto& direction = active.law.held[m];
    const int first = (1 + m) * entries;
    double *Rq = derivatives_.Rq[j].data() + active.entry + first,
           *Rv = derivatives_.Rv[j].data() + active.entry + first;
    for (int s = 0; s < entries; ++s) {
      Rq[s] = Rv[s] = 0;
      double& entry = forces[first + s];
      entry = 0;
      for (int d = 0; d < contact.n_t; ++d) entry += direction[d] * J_t[d * entries + s];
      if (m >= held) continue;
      Rv[s] = entry / scale;  // (7a)
      for (int d = 0; d < contact.n_t && !contact.is_affine; ++d)
        Rq[s] += direction[d] / scale * Tq_(contact.tangent_index + d, contact.support[s]);
    }
  }
  if (active.mode != ContactMode::slip || held > 0) return;
  double direction[2];
  const double speed = slip_direction(active, step.v.col(j).data(), step, direction);
  const double cone = contact.mu * step.lambda_n(active.contact, j);
  for (int d = 0; d < 2; ++d) {  // (7c)
    const int row = 1 + d, first = active.entry + row * entries;
    Rl[3 * row + row] = 1;
    Rl[3 * row] = contact.mu * direction[d];
    if (speed == 0) continue;
    for (int e = 0; e < contact.n_t; ++e) {
      const double slope = cone * ((d == e ? 1 : 0) - direction[d] * direction[e]) / speed;
      for (int s = 0; s < entries; ++s) {
        derivatives_.Rv[j][first + s] += slope * J_t[e * entries + s];
        if (!contact.is_affine)
          derivatives_.Rq[j][first + s] += slope * Tq_(contact.tangent_index + e, contact.support[s]);
      }
    }
  }
}

/// Adds a Newton correction and returns its size as a velocity: h max |dw|, and what the corrections of the forces
/// accelerate, which (3) may hide in dw.
double StageSolver::correct(const double* dx, double h, Element& step) const {
  double largest = 0;
  for (int j = 0; j < n_s_; ++j) {
    double* a = step.a.data() + j * n_q_;
    for (int i = 0; i < n_q_; ++i) {
      a[i] += dx[i];
      largest = std::max(largest, std::abs(dx[i]));
    }
    dx += n_q_;
    for (const ActiveContact& active : closed_) {
      const auto& contact = problem_.info().contacts[active.contact];
      const double* force = derivatives_.forces[j].data() + active.entry;
      for (int d = 0; d < active.n_rows; ++d) {
        for (const int at : contact.pushed())
          largest = std::max(largest, std::abs(*force++ * dx[d]) / derivatives_.M[j][at * (n_q_ + 1)]);
        force += contact.is_moving;
      }
      step.lambda_n(active.contact, j) += *dx;
      if (contact.n_t > 0) set_friction(active, j, dx + 1, step);
      dx += active.n_rows;
    }
  }
  return h * largest;
}

/// lambda_t of a closed contact at a stage, from lambda_n and its own unknowns with their corrections dx, which may be
/// null.
void StageSolver::set_friction(const ActiveContact& active, int j, const double* dx, Element& step) const {
  const auto& contact = problem_.info().contacts[active.contact];
  double* lambda_t = step.lambda_t.col(j).data() + contact.tangent_index;
  if (active.n_rows == 1 + contact.n_t) {  // stick, and slip on the disc: all of it is unknown
    for (int d = 0; d < contact.n_t && dx; ++d) lambda_t[d] += dx[d];
    return;
  }
  double x = 0;
  const auto &along = active.law.along, &held = active.law.held[0];
  if (active.law.n_held > 0) x = held[0] * lambda_t[0] + held[1] * lambda_t[1] + (dx ? dx[0] : 0);
  const double cone = contact.mu * step.lambda_n(active.contact, j);
  for (int d = 0; d < contact.n_t; ++d) lambda_t[d] = (active.law.n_held > 0 ? x * held[d] : 0) - cone * along[d];
}

/// Size of velocities in a step, what corrections are compared with: |v_0| of the bodies, h |w| and what the load alone
/// would do in the step, which is what remains for a body that a contact holds at rest.
double StageSolver::velocity_scale(const Element& step, double h) const {
  double v = 0, a = load_;
  for (int i = 0; i < problem_.info().n_mechanical(); ++i) v = std::max(v, std::abs(step.v0[i]));
  for (Eigen::Index i = 0; i < step.a.size(); ++i) a = std::max(a, std::abs(step.a.data()[i]));
  return v + h * a;
}

const StageCoefficients& StageSolver::coefficients_for(double h) {
  if (coefficients_[last_].h == h) return coefficients_[last_];
  for (last_ = 0; last_ < kMaxLengths; ++last_) {
    if (coefficients_[last_].h == h) return coefficients_[last_];
  }
  last_ = oldest_++ % kMaxLengths;
  set_length(coefficients_[last_], h);
  return coefficients_[last_];
}

bool StageSolver::refresh(const StageCoefficients& k, const Element& step, bool again) {
  derivatives(k, step);
  return newton_.factorize(k, derivatives_, again);
}

/// The forces among the unknowns, in x_.
void StageSolver::gather_forces(const Element& step) {
  for (int j = 0; j < n_s_; ++j) {
    for (const ActiveContact& active : closed_) {
      double* x = x_.data() + j * n_x_ + n_q_ + active.row;
      *x++ = step.lambda_n(active.contact, j);
      const auto& contact = problem_.info().contacts[active.contact];
      for (int m = 0; m < active.n_rows - 1; ++m, ++x) {
        *x = 0;
        for (int d = 0; d < contact.n_t; ++d) *x += active.law.held[m][d] * step.lambda_t(contact.tangent_index + d, j);
      }
    }
  }
}

/// Equations of redundant contacts may contradict each other: then Newton's method converges to a compromise.
bool StageSolver::is_consistent(const Element& step, double h) const {
  const double acceleration = velocity_scale(step, h) / h;
  for (int j = 0; j < n_s_; ++j) {
    for (int row = j * n_x_ + n_q_; row < (j + 1) * n_x_; ++row) {
      if (!(std::abs(r_[row]) <= kContradiction * acceleration)) return false;
    }
  }
  return true;
}

StageSolver::Result StageSolver::solve(Element& step) {
  set_active(step.modes, step.facets);
  set_dependent_forces(step);
  const StageCoefficients& k = coefficients_for(step.h);
  const bool is_known = newton_.recall(k.h);
  set_initial_values(step, k.h);
  stage_values(k, step);
  bool is_fresh = false;
  is_frozen_ = has_friction_ && !step.slip_start.isZero(0);
  if (!is_known) {
    if (!refresh(k, step, false)) return Result::singular;
    is_fresh = true;
  }

  double previous = 0;
  for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
    residual(k, step);
    if (newton_.is_redundant()) gather_forces(step);
    newton_.solve(r_, x_, dx_);
    ++counters_.inner_iterations;
    const double size = correct(dx_.data(), k.h, step);
    stage_values(k, step);
    if (!std::isfinite(size)) return Result::no_convergence;
    const double scale = velocity_scale(step, k.h);

    bool is_converged = size <= tolerance_ * scale;
    if (is_affine_) {
      is_converged = is_converged || size <= 1e-3 * scale;  // one correction is exact, up to rounding of this size
    }
    if (iteration > 0) {
      const double contraction = size / previous;
      // What the next correction would be; and corrections that rounding keeps from shrinking further.
      is_converged = is_converged ||
                     (contraction < 1 && contraction / (1 - contraction) * size <= predicted_tolerance_ * scale) ||
                     (iteration > 3 && contraction > 0.5 && size <= 1e-9 * scale);
      if (!is_converged && contraction > 0.1 && !(is_fresh && contraction < 0.5)) {
        if (!refresh(k, step, true)) return Result::singular;
        is_fresh = true;
      }
    }
    if (is_frozen_ && size <= 1e-3 * scale) {  // close enough for the direction to follow the velocity
      is_frozen_ = false;
      if (!refresh(k, step, true)) return Result::singular;
      continue;
    }
    if (is_converged) {
      if (newton_.is_redundant()) {
        residual(k, step);
        if (!is_consistent(step, k.h)) return Result::no_convergence;
      }
      set_slip_in_space(step);
      end_values(k, step);
      set_end_forces(step);
      clear_vanishing(step.a.data(), step.a.size());
      clear_vanishing(step.v1.data(), step.v1.size());
      return Result::converged;
    }
    previous = size;
  }
  return Result::no_convergence;
}

/// (7c) from the velocities: they are known to the tolerance, the forces in the Newton correction only to the tolerance
/// divided by h.
void StageSolver::set_slip_in_space(Element& step) {
  for (const ActiveContact& active : closed_) {
    if (active.mode != ContactMode::slip) continue;
    const auto& contact = problem_.info().contacts[active.contact];
    for (int j = 0; j < n_s_; ++j) {
      if (rests(active, j)) continue;
      problem_.tangent_jacobian(step.q.col(j).data(), J_t_.data());
      double direction[2];
      slip_direction(active, step.v.col(j).data(), step, direction);
      for (int d = 0; d < contact.n_t; ++d)
        step.lambda_t(contact.tangent_index + d, j) = -contact.mu * step.lambda_n(active.contact, j) * direction[d];
    }
  }
}

/// Forces that are not unknowns: those of open contacts, and (7b).
void StageSolver::set_dependent_forces(Element& step) const {
  for (std::size_t i = 0; i < modes_.size(); ++i) {
    if (modes_[i] != ContactMode::open) continue;
    const auto& contact = problem_.info().contacts[i];
    step.lambda_n.row(static_cast<Eigen::Index>(i)).setZero();
    if (contact.n_t > 0) step.lambda_t.middleRows(contact.tangent_index, contact.n_t).setZero();
  }
  for (const ActiveContact& active : closed_) {
    for (int j = 0; has_friction_ && j < n_s_; ++j) {
      if (problem_.info().contacts[active.contact].n_t > 0) set_friction(active, j, nullptr, step);
    }
  }
}

/// One Newton step of a run: how the unknowns respond to the residual and to the variation incoming_q_, incoming_v_ of
/// the left end, and what that makes of the right end (which becomes the next step's left end).
void StageSolver::linearize_step(const StageCoefficients& k, const Element& step, Matrix& response) {
  const auto n_rows = static_cast<Eigen::Index>(row_power_.size());
  const double h = k.h;
  derivatives(k, step);
  for (int j = 0; j < n_s_; ++j) {  // (3), (4) at fixed accelerations
    stage_dv_ = incoming_v_;
    stage_dv_.col(1).noalias() += step.a.lazyProduct(tableau_.A.row(j).transpose());
    stage_dq_ = incoming_q_ + k.h_rows[j] * incoming_v_;
    stage_dq_.col(1) += rows_[j] * step.v0;
    stage_dq_.col(1).noalias() += (2 * h) * step.a.lazyProduct(A2_.row(j).transpose());
    auto dynamics = rhs_.middleRows(j * n_x_, n_q_);
    if (derivatives_.has_dynamics) {
      dynamics.noalias() = derivatives_.Dq[j].lazyProduct(stage_dq_);
      if (has_force_jacobian_) dynamics.noalias() += derivatives_.Dv[j].lazyProduct(stage_dv_);
    } else {
      dynamics.setZero();
    }
    dynamics.col(0) += r_.segment(j * n_x_, n_q_);
    if (n_rows == 0) continue;
    auto laws = rhs_.middleRows(j * n_x_ + n_q_, n_rows);
    for (const ActiveContact& active : closed_) {
      const auto& support = problem_.info().contacts[active.contact].support;
      const double *Rq = derivatives_.Rq[j].data() + active.entry, *Rv = derivatives_.Rv[j].data() + active.entry;
      for (int row = active.row; row < active.row + active.n_rows; ++row) {
        double by_q[2]{0, 0}, by_v[2]{0, 0};
        for (const int at : support) {
          for (int c = 0; c < 2; ++c) {
            by_q[c] += *Rq * stage_dq_(at, c);
            by_v[c] += *Rv * stage_dv_(at, c);
          }
          ++Rq;
          ++Rv;
        }
        const double r = r_[j * n_x_ + n_q_ + row];
        laws(row, 0) = by_q[0] + by_v[0] + r;
        laws(row, 1) = by_q[1] + by_v[1] - row_power_[row] / h * r;
      }
    }
  }
  if (!closed_.empty()) gather_forces(step);
  newton_.solve_once(k, derivatives_, rhs_, x_, response);

  incoming_q_ += h * incoming_v_;  // (5)
  incoming_q_.col(1) += step.v0;
  for (int l = 0; l < n_s_; ++l) {
    const auto dw = response.middleRows(l * n_x_, n_q_);
    incoming_q_ += k.h2bA[l] * dw;
    incoming_v_ += k.hb[l] * dw;
    incoming_q_.col(1) += (2 * h * bA_[l]) * step.a.col(l);
    incoming_v_.col(1) += tableau_.b[l] * step.a.col(l);
  }
}

double StageSolver::switch_value(const Element& last, const Switch& end) {
  const auto& contact = problem_.info().contacts[end.contact];
  if (end.kind == Switch::Kind::gap_closes) {
    problem_.gap(last.q1.data(), gap_.data());
    return gap_[end.contact] - end.left_gap;
  }
  if (end.kind == Switch::Kind::force_vanishes) return last.end_lambda_n[end.contact];
  if (end.together) return missing_power(last, nullptr);
  double direction[2];
  if (is_of_last_stage(end)) return end_margin(end, last.lambda_n.col(n_s_ - 1), last.lambda_t.col(n_s_ - 1));
  if (!slip_that_vanishes(last, end, direction)) return end_margin(end, last.end_lambda_n, last.end_lambda_t);
  problem_.tangent_jacobian(last.q1.data(), J_t_.data());
  const double* J_t = J_t_.data() + contact.tangent_begin;
  double slip = 0;
  for (int d = 0; d < contact.n_t; ++d) {
    for (const int row : contact.support) slip += direction[d] * *J_t++ * last.v1[row];
  }
  return slip;
}

/// Whether the switch function is of the force in (8): that of (11) sticks already, and lies inside the cone.
bool StageSolver::is_of_last_stage(const Switch& end) const {
  return resting_contact_ >= 0 && end.kind == Switch::Kind::slip_stops && !end.on_polygon();
}

/// Whether the switch function is a component of the slip velocity, and which: in the plane and on a polygon.
bool StageSolver::slip_that_vanishes(const Element& last, const Switch& end, double* direction) {
  if (end.on_polygon()) {
    std::copy_n(end.condition.direction.data(), 2, direction);
    return !end.condition.is_of_force;
  }
  direction[0] = slip_sign(last.modes[end.contact]);
  direction[1] = 0;
  return direction[0] != 0;
}

/// mu lambda_n - ||lambda_t||: the force reaches the cone from inside or, by (8), from outside. On a polygon a side of
/// it, or the end of one.
double StageSolver::end_margin(const Switch& end, const Eigen::Ref<const Vector>& lambda_n,
                               const Eigen::Ref<const Vector>& lambda_t) const {
  const auto& info = problem_.info().contacts[end.contact];
  const auto force = lambda_t.segment(info.tangent_index, info.n_t);
  const double cone = info.mu * lambda_n[end.contact];
  if (!end.on_polygon()) return cone - force.norm();
  const auto& [is_of_force, direction, part, facet] = end.condition;
  return part * cone - direction[0] * force[0] - direction[1] * force[1];
}

/// Slope of the forces (11), by central differences along the two variations: they contain third derivatives of gaps.
void StageSolver::constrained_force_slope(const Element& last, const Switch& end, Eigen::RowVector2d& slope) {
  const int n = problem_.info().n_mechanical();
  const double speed = last.v1.head(n).lpNorm<Eigen::Infinity>();
  const double q_size = last.q1.head(n).lpNorm<Eigen::Infinity>() + last.h * speed;
  const double v_size = speed + last.h * last.a.lpNorm<Eigen::Infinity>();
  for (Eigen::Index c = 0; c < 2; ++c) {
    const auto dq = incoming_q_.col(c), dv = incoming_v_.col(c);
    const double dt = n < n_q_ ? std::abs(dq[n]) / last.h : 0;
    const double size =
        std::max({dq.head(n).lpNorm<Eigen::Infinity>() / q_size, dv.lpNorm<Eigen::Infinity>() / v_size, dt});
    if (!(size > 0)) continue;
    const double part = kDifference / size;
    for (const double sign : {1.0, -1.0}) {
      end_q_ = last.q1 + sign * part * dq;
      end_v_ = last.v1 + sign * part * dv;
      set_end_system(end_q_, end_v_, last);
      constrained_forces(end_q_, end_v_);
      const double value =
          end.kind == Switch::Kind::force_vanishes ? lambda_[end.contact] : end_margin(end, lambda_, lambda_t_);
      slope[c] += sign / (2 * part) * value;
    }
  }
}

/// Slope of lambda_n, or of end_margin(), from the responses of the last step of a run.
void StageSolver::force_slope(const Element& last, const Switch& end, Eigen::RowVector2d& slope) const {
  const Matrix& response = run_response_[run_length_ - 1];
  const auto& contact = problem_.info().contacts[end.contact];
  const auto active =
      std::find_if(closed_.begin(), closed_.end(), [&](const ActiveContact& a) { return a.contact == end.contact; });
  double by_lambda_n = 1, direction[2]{0, 0};  // by lambda_t: -direction
  if (end.kind != Switch::Kind::force_vanishes) {
    const double* forces = is_of_last_stage(end) ? last.lambda_t.col(n_s_ - 1).data() : last.end_lambda_t.data();
    const Eigen::Map<const Vector> lambda_t(forces + contact.tangent_index, contact.n_t);
    const double force = lambda_t.norm();
    for (int d = 0; d < contact.n_t && force > 0; ++d) direction[d] = lambda_t[d] / force;
    if (end.on_polygon()) std::copy_n(end.condition.direction.data(), 2, direction);
    const auto& along = active->law.along;
    by_lambda_n =
        contact.mu * ((end.on_polygon() ? end.condition.cone : 1) + direction[0] * along[0] + direction[1] * along[1]);
  }
  for (int j = 0; j < n_s_; ++j) {
    const double weight = tableau_.right_end[j];
    const auto row = j * n_x_ + n_q_ + active->row;
    slope += weight * by_lambda_n * response.row(row);
    for (int m = 0; m < active->n_rows - 1; ++m) {
      const auto& held = active->law.held[m];
      slope -= weight * (direction[0] * held[0] + direction[1] * held[1]) * response.row(row + 1 + m);
    }
  }
}

/// Derivative of switch_value(): constant part, per unit of h. After switch_value(), whose Jacobians it uses.
void StageSolver::switch_slope(const Element& last, const Switch& end, Eigen::RowVector2d& slope) {
  slope.setZero();
  const auto& contact = problem_.info().contacts[end.contact];
  double direction[2];
  if (end.kind == Switch::Kind::gap_closes) {
    problem_.normal_jacobian(last.q1.data(), J_n_.data());
    const double* J = J_n_.data() + contact.normal_begin;
    for (const int row : contact.support) slope += *J++ * incoming_q_.row(row);
  } else if (end.kind != Switch::Kind::force_vanishes && slip_that_vanishes(last, end, direction)) {
    problem_.slip_velocity_derivative(last.q1.data(), last.v1.data(), Tq_.data());
    const double* J_t = J_t_.data() + contact.tangent_begin;
    for (int d = 0; d < contact.n_t; ++d) {
      slope += direction[d] * Tq_.row(contact.tangent_index + d).lazyProduct(incoming_q_);
      for (const int row : contact.support) slope += direction[d] * *J_t++ * incoming_v_.row(row);
    }
  } else if (end.together) {
    missing_power(last, &slope);
  } else if (is_projected_ && !is_of_last_stage(end)) {
    constrained_force_slope(last, end, slope);
  } else {
    force_slope(last, end, slope);
  }
}

/// s of (9), n_t components; J_t_ and Tq_ are evaluated at the right end.
double StageSolver::slip_acceleration(const ActiveContact& active, const Element& last, double* s) const {
  const auto& contact = problem_.info().contacts[active.contact];
  const double* J_t = J_t_.data() + contact.tangent_begin;
  for (int d = 0; d < 2; ++d) {
    s[d] = Tq_.row(contact.tangent_index + d).dot(last.v1);
    for (const int row : contact.support) s[d] += *J_t++ * last.a(row, n_s_ - 1);
  }
  return std::hypot(s[0], s[1]);
}

/// Of the friction forces at the last stage of (9), all with the same effect, those nearest to the limit at rest.
void StageSolver::spread_friction(Element& last) {
  problem_.tangent_jacobian(last.q1.data(), J_t_.data());
  problem_.slip_velocity_derivative(last.q1.data(), last.v1.data(), Tq_.data());
  Matrix T = Matrix::Zero(n_q_, problem_.info().n_lambda_t);  // columns of resting contacts only
  Vector excess = Vector::Zero(problem_.info().n_lambda_t);
  for (const ActiveContact& active : closed_) {
    if (!rests(active, n_s_ - 1)) continue;
    const auto& contact = problem_.info().contacts[active.contact];
    double s[2];
    const double size = slip_acceleration(active, last, s);
    const double* J_t = J_t_.data() + contact.tangent_begin;
    for (int d = 0; d < 2; ++d) {
      const int t = contact.tangent_index + d;
      for (const int row : contact.pushed()) T(row, t) = *J_t++;
      J_t += contact.is_moving;
      excess[t] = last.lambda_t(t, n_s_ - 1) - contact.mu * last.lambda_n(active.contact, n_s_ - 1) * s[d] / size;
    }
  }
  last.lambda_t.col(n_s_ - 1) -= excess - least_squares(T, T * excess);
}

/// (9): the right-hand side minus the left one, at the last stage; and its slope, where asked for.
double StageSolver::missing_power(const Element& last, Eigen::RowVector2d* slope) {
  const int j = n_s_ - 1;
  problem_.tangent_jacobian(last.q1.data(), J_t_.data());
  problem_.slip_velocity_derivative(last.q1.data(), last.v1.data(), Tq_.data());
  if (slope) problem_.slip_velocity_derivative(last.q1.data(), last.a.col(j).data(), Ta_.data());
  double power = 0;
  for (const ActiveContact& active : closed_) {
    if (!rests(active, n_s_ - 1)) continue;
    const auto& contact = problem_.info().contacts[active.contact];
    const double lambda_n = last.lambda_n(active.contact, j);
    double s[2];
    const double size = slip_acceleration(active, last, s);
    power += contact.mu * lambda_n * size;
    for (int d = 0; d < 2; ++d) power -= last.lambda_t(contact.tangent_index + d, j) * s[d];
    if (!slope) continue;
    const auto response = run_response_[run_length_ - 1].middleRows(j * n_x_, n_x_);
    *slope += contact.mu * size * response.row(n_q_ + active.row);
    const double* J_t = J_t_.data() + contact.tangent_begin;
    for (int d = 0; d < 2; ++d) {
      const int t = contact.tangent_index + d;
      *slope -= s[d] * response.row(n_q_ + active.row + 1 + d);
      // T v is quadratic in v: the factor 2.
      Eigen::RowVector2d ds = Ta_.row(t) * incoming_q_ + 2 * Tq_.row(t) * incoming_v_;
      for (const int row : contact.support) ds += *J_t++ * response.row(row);
      *slope += (contact.mu * lambda_n * s[d] / size - last.lambda_t(t, j)) * ds;
    }
  }
  return power;
}

/// Switch function at the right end of a run without its zeros at h = 0, and its slope.
double StageSolver::deflated_switch(const Element& last, const Switch& end, double h, Eigen::RowVector2d& slope) {
  double value = switch_value(last, end);
  switch_slope(last, end, slope);
  for (int zero = 0; zero < end.zeros_at_start; ++zero) {
    value /= h;
    slope /= h;
    slope[1] -= value / h;
  }
  return value;
}

StageSolver::Result StageSolver::solve_to_switch(std::span<Element> run, const Switch& end, double max_h) {
  set_active(run.front().modes, run.front().facets);
  if (end.needs_force() && tableau_.right_end.size() == 0) return Result::singular;
  const bool comes_to_rest =
      end.kind == Switch::Kind::slip_stops && run.front().modes[end.contact] == ContactMode::slip;
  if (comes_to_rest && !stiffly_accurate_) return Result::singular;
  is_frozen_ = false;
  for (Element& step : run) set_dependent_forces(step);
  run_length_ = run.size();
  if (run_response_.size() < run.size()) run_response_.resize(run.size());
  StageCoefficients& k = run_coefficients_;
  const auto hand_over = [&](std::size_t m) {
    run[m].h = k.h;
    if (m == 0) return;
    run[m].q0 = run[m - 1].q1;
    run[m].v0 = run[m - 1].v1;
  };

  const auto set_resting = [&](bool is_last) {
    resting_contact_ = comes_to_rest && is_last ? end.contact : -1;
    rest_together_ = resting_contact_ >= 0 && end.together;
  };

  const auto is_gap_rounding = [&] {  // with J_n_ and gap_ of the switch function
    if (end.kind != Switch::Kind::gap_closes) return false;
    const auto& contact = problem_.info().contacts[end.contact];
    return std::abs(gap_[end.contact] - end.left_gap) <=
           kGapRounding * packed_terms(contact, J_n_.data() + contact.normal_begin, run.back().q1);
  };

  bool is_contradictory = false;  // the last step of the run, as far as redundant contacts go
  double h = run.front().h, previous = 0;
  for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
    set_length(k, h);
    incoming_q_.setZero();
    incoming_v_.setZero();
    for (std::size_t m = 0; m < run.size(); ++m) {
      hand_over(m);
      set_resting(m + 1 == run.size());
      set_initial_values(run[m], h);
      stage_values(k, run[m]);
      residual(k, run[m]);
      linearize_step(k, run[m], run_response_[m]);
      is_contradictory = newton_.is_redundant() && !is_consistent(run[m], h);
      end_values(k, run[m]);
      if (is_projected_) project_variations(run[m]);
      if (m + 1 == run.size()) set_end_forces(run[m]);
    }
    ++counters_.inner_iterations;
    Eigen::RowVector2d slope;
    const double value = deflated_switch(run.back(), end, h, slope);
    set_resting(false);
    double full_dh = -(value + slope[0]) / slope[1];
    if (!std::isfinite(full_dh)) {
      if (iteration > 0) return Result::singular;
      full_dh = 0;  // a body at rest and a guess without accelerations: these come first
    }
    const double dh = std::clamp(full_dh, -0.7 * h, 2 * h);  // keeps h positive on the way

    double correction_size = 0;
    for (std::size_t m = 0; m < run.size(); ++m) {
      dx_ = run_response_[m].col(0) + dh * run_response_[m].col(1);
      const double correction = correct(dx_.data(), h, run[m]), scale = velocity_scale(run[m], h);
      correction_size = std::max(correction_size, scale > 0 ? correction / scale : 0.0);
    }
    const double size = std::max(correction_size, std::abs(full_dh) / h);
    h += dh;
    if (!std::isfinite(size)) return Result::no_convergence;
    const double contraction = iteration > 0 ? size / previous : 1;
    // What forces of short elements say about the time of a switch has rounding of its own, which h does not measure;
    // so has a gap that closes slowly.
    const bool is_time_rounding = std::abs(full_dh) <= 1e-9 * max_h && dh == full_dh;
    const bool is_rounding = correction_size <= 1e-9 && (is_time_rounding || is_gap_rounding());
    // Newton is quadratic: the error after this correction is about its square.
    const bool is_converged = (iteration > 0 && size <= tolerance_) ||
                              (iteration > 0 && contraction < 0.1 && size * contraction <= tolerance_) ||
                              (iteration > 3 && contraction > 0.5 && is_rounding);
    if (is_converged && is_contradictory) return Result::no_convergence;
    if (is_converged) {
      set_length(k, h);
      for (std::size_t m = 0; m < run.size(); ++m) {
        hand_over(m);
        stage_values(k, run[m]);
        set_resting(m + 1 == run.size());
        end_values(k, run[m]);
        set_slip_in_space(run[m]);
        if (rest_together_) spread_friction(run[m]);
        set_end_forces(run[m]);
        set_resting(false);
      }
      return h <= max_h ? Result::converged : Result::left_interval;
    }
    if (h > 4 * max_h || h < 1e-14 * max_h) return Result::left_interval;
    previous = size;
  }
  return Result::no_convergence;
}

void StageSolver::extrapolate(const Element& from, Element& to) const {
  if (extrapolation_.size() == 0) {
    to.a = from.a;
    to.lambda_n = from.lambda_n;
    to.lambda_t = from.lambda_t;
    return;
  }
  for (int j = 0; j < n_s_; ++j) {
    for (int i = 0; i < n_q_; ++i) {
      double a = 0;
      for (int l = 0; l < n_s_; ++l) a += extrapolation_(j, l) * from.a(i, l);
      to.a(i, j) = a;
    }
  }
  if (from.lambda_n.size() > 0) to.lambda_n.noalias() = from.lambda_n.lazyProduct(extrapolation_.transpose());
  if (from.lambda_t.size() > 0) to.lambda_t.noalias() = from.lambda_t.lazyProduct(extrapolation_.transpose());
}

}  // namespace ricochet
