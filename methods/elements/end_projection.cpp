#include "methods/elements/end_projection.h"

#include <algorithm>

#include "methods/elements/redundant_system.h"
#include "problems/dense_solve.h"

namespace ricochet {
namespace {

// Scenes with more of them have no system (11) of all contacts at once.
constexpr int kMaxAffineCoordinates = 64;

}  // namespace

EndProjection::EndProjection(const Problem& problem, const StageTableau& tableau, const ActiveSet& active,
                             Counters& counters)
    : problem_(problem),
      tableau_(tableau),
      active_(active),
      counters_(counters),
      last_stage_(tableau.n_s - 1),
      keeps_affine_(!tableau.ends_with_stage && tableau.right_end.size() > 0 &&
                    problem.n_q() <= kMaxAffineCoordinates) {}

void EndProjection::prepare(EndSystem& s) const {
  const ProblemInfo& info = problem_.info();
  s.lambda_n.setZero(info.n_c());
  s.lambda_t.setZero(info.n_lambda_t);
  s.f.resize(info.n_q);
  s.v.resize(info.n_q);
  s.J_n.resize(info.n_normal_entries);
  s.J_t.resize(info.n_tangent_entries);
  s.gap.resize(info.n_c());
  s.T.setZero(info.n_lambda_t, info.n_q);
  const bool has_curved = std::ranges::any_of(info.contacts, [](const auto& contact) { return !contact.is_affine; });
  if (has_curved || (keeps_affine_ && info.n_c() > 0)) s.M.setZero(info.n_q, info.n_q);
  resize(s);
}

void EndProjection::resize(EndSystem& s) const {
  s.directions.setZero(2, static_cast<Eigen::Index>(active_.closed().size()));
  s.is_constant = false;
  if (!gives_forces()) return;
  s.R.setZero(problem_.n_q(), active_.n_rows());
  s.MC.setZero(problem_.n_q(), active_.n_rows());
}

void EndProjection::linearize(const Vector& q, const Vector& v, const Element& e, EndSystem& s) const {
  if (s.is_constant) return;
  if (!problem_.info().structure.constant_mass || s.llt.cols() == 0) {
    problem_.mass_matrix(q.data(), s.M.data());
    s.llt.compute(s.M);
    ++counters_.mass_factorizations;
  }
  problem_.normal_jacobian_of(active_.contacts(), q.data(), s.J_n.data());
  if (active_.has_friction()) problem_.tangent_jacobian_of(active_.contacts(), q.data(), s.J_t.data());
  s.R.setZero();
  s.MC.setZero();
  s.n = 0;
  Eigen::Index k = 0;
  for (const ActiveContact& active : active_.closed()) {
    const auto& contact = problem_.info().contacts[active.contact];
    const auto entries = static_cast<int>(contact.support.size()), n_pushed = static_cast<int>(contact.pushed().size());
    const double *J_n = s.J_n.data() + contact.normal_begin, *J_t = s.J_t.data() + contact.tangent_begin;
    double* direction = s.directions.col(k++).data();
    std::fill_n(direction, 2, 0.0);
    if (contact.n_t > 0 && !active_.rests(active, last_stage_))
      active_.slip_direction(active, s.J_t.data(), v.data(), e, direction);
    for (int m = 0; m < entries; ++m) s.R(contact.support[m], s.n) = J_n[m];
    for (int m = 0; m < n_pushed; ++m) {
      s.MC(contact.support[m], s.n) = J_n[m];
      for (int d = 0; d < contact.n_t; ++d)
        s.MC(contact.support[m], s.n) -= contact.mu * direction[d] * J_t[d * entries + m];
    }
    ++s.n;
    for (int held = 0; held < active_.n_held(active, last_stage_); ++held, ++s.n) {
      for (int m = 0; m < entries; ++m) {
        for (int d = 0; d < contact.n_t; ++d)
          s.R(contact.support[m], s.n) += active.law.held[held][d] * J_t[d * entries + m];
        if (m < n_pushed) s.MC(contact.support[m], s.n) = s.R(contact.support[m], s.n);
      }
    }
  }
  const auto R = s.R.leftCols(s.n);
  auto MC = s.MC.leftCols(s.n);
  for (Eigen::Index column = 0; column < s.n; ++column) s.llt.solveInPlace(MC.col(column));
  s.system.noalias() = R.transpose().lazyProduct(MC);
  s.inverse = s.lu.of(s.system);
  if (RedundantSystem::is_singular(s.system, s.inverse)) s.inverse = pseudo_inverse(s.system);
  s.is_constant = problem_.info().structure.constant_mass && !active_.has_curved() && !active_.turns();
}

void EndProjection::project(Element& e, EndSystem& s) const {
  linearize(e.q1, e.v1, e, s);
  s.rates.noalias() = s.R.leftCols(s.n).transpose().lazyProduct(e.v1);
  take_away_rates(s, e.v1);
}

/// x -= M^-1 C (R' M^-1 C)^-1 rates
void EndProjection::take_away_rates(EndSystem& s, Eigen::Ref<Vector> x) {
  s.impulses.noalias() = s.inverse.lazyProduct(s.rates);
  x.noalias() -= s.MC.leftCols(s.rates.size()).lazyProduct(s.impulses);
}

void EndProjection::project_variations(const Element& e, const Matrix& all_dq, Matrix& all_dv, EndSystem& s) const {
  if (active_.has_friction()) problem_.slip_velocity_derivative(e.q1.data(), e.v1.data(), s.T.data());
  for (Eigen::Index c = 0; c < 2; ++c) {
    const auto dq = all_dq.col(c);
    s.rates.noalias() = s.R.leftCols(s.rates.size()).transpose().lazyProduct(all_dv.col(c));
    for (const double sign : {1.0, -1.0}) {  // v' (grad^2 f_c) dq as a difference of two bias terms
      s.v = e.v1 + sign * dq;
      problem_.gap_acceleration_bias(e.q1.data(), s.v.data(), s.gap.data());
      Eigen::Index row = 0;
      for (const ActiveContact& active : active_.closed()) {
        s.rates[row++] += sign / 4 * s.gap[active.contact];
        row += active_.n_held(active, last_stage_);
      }
    }
    Eigen::Index row = 0;
    for (const ActiveContact& active : active_.closed()) {
      const auto& contact = problem_.info().contacts[active.contact];
      ++row;
      for (int m = 0; m < active_.n_held(active, last_stage_); ++m, ++row) {
        for (int d = 0; d < contact.n_t; ++d)
          s.rates[row] += active.law.held[m][d] * s.T.row(contact.tangent_index + d).dot(dq);
      }
    }
    take_away_rates(s, all_dv.col(c));
  }
}

void EndProjection::set_forces(const Vector& q, const Vector& v, EndSystem& s) const {
  problem_.force(q.data(), v.data(), problem_.info().u.data(), s.f.data());
  s.llt.solveInPlace(s.f);
  s.rates.noalias() = s.R.leftCols(s.n).transpose().lazyProduct(s.f);
  problem_.gap_acceleration_bias(q.data(), v.data(), s.gap.data());
  if (active_.has_friction()) problem_.slip_velocity_derivative(q.data(), v.data(), s.T.data());
  Eigen::Index row = 0;
  for (const ActiveContact& active : active_.closed()) {
    const auto& contact = problem_.info().contacts[active.contact];
    s.rates[row++] += s.gap[active.contact];
    for (int m = 0; m < active_.n_held(active, last_stage_); ++m, ++row) {
      for (int d = 0; d < contact.n_t; ++d)
        s.rates[row] += active.law.held[m][d] * s.T.row(contact.tangent_index + d).dot(v);
    }
  }
  s.impulses.noalias() = s.inverse.lazyProduct(s.rates);
  s.lambda_n.setZero();
  s.lambda_t.setZero();
  row = 0;
  Eigen::Index k = 0;
  for (const ActiveContact& active : active_.closed()) {
    const auto& contact = problem_.info().contacts[active.contact];
    const double lambda_n = s.lambda_n[active.contact] = -s.impulses[row++];
    const int held = active_.n_held(active, last_stage_);
    for (int d = 0; d < contact.n_t; ++d) {
      double& lambda_t = s.lambda_t[contact.tangent_index + d];
      lambda_t = -contact.mu * lambda_n * s.directions(d, k);
      for (int m = 0; m < held; ++m) lambda_t -= active.law.held[m][d] * s.impulses[row + m];
    }
    row += held;
    ++k;
  }
}

void EndProjection::set_end_forces(Element& e, EndSystem& s) const {
  // The direction of slip in space follows the projected velocity.
  if (!e.is_projected || active_.turns()) linearize(e.q1, e.v1, e, s);
  set_forces(e.q1, e.v1, s);
  e.end_lambda_n = s.lambda_n;
  e.end_lambda_t = s.lambda_t;
}

void EndProjection::set_stage_end_forces(Element& e) const {
  if (active_.empty()) {
    e.end_lambda_n.setZero();
    e.end_lambda_t.setZero();
  } else if (tableau_.right_end.size() > 0) {
    e.end_lambda_n.noalias() = e.lambda_n.lazyProduct(tableau_.right_end);
    e.end_lambda_t.noalias() = e.lambda_t.lazyProduct(tableau_.right_end);
    for (const ActiveContact& active : active_.closed()) {  // extrapolated, a force that turns leaves its cone
      if (tableau_.ends_with_stage || active.mode != ContactMode::slip) continue;
      const auto& contact = problem_.info().contacts[active.contact];
      auto lambda_t = e.end_lambda_t.segment(contact.tangent_index, contact.n_t);
      const double force = lambda_t.norm();
      if (force > 0) lambda_t *= contact.mu * e.end_lambda_n[active.contact] / force;
    }
  }
}

}  // namespace ricochet
