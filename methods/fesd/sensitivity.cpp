#include "methods/fesd/sensitivity.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "problems/dense_solve.h"

namespace ricochet {

Sensitivity::Sensitivity(VariedProblem varied, const ButcherTableau& tableau)
    : varied_(std::move(varied)),
      point_(varied_),
      problem_(varied_.problem()),
      tableau_(tableau),
      A2_(tableau.A * tableau.A),
      r_(tableau.A.rowwise().sum()),
      bA_(tableau.A.transpose() * tableau.b),
      n_q_(problem_.n_q()),
      n_c_(problem_.n_c()),
      n_t_(problem_.info().n_lambda_t),
      n_s_(tableau.n_s),
      n_theta_(varied_.n_theta()) {
  restart(nullptr);
}

void Sensitivity::restart(const FesdStep* before) {
  reached_.q = varied_.dq0();
  reached_.v = varied_.dv0();
  reached_.t = Vector::Zero(n_theta_);
  reached_.is_at_switch = false;
  reached_.modes.clear();
  n_elements_ = 0;
  if (!before) return;
  remember_end(*before);
  const Element& last = before->last();
  point_.project(last.modes, last.q1, last.v1, reached_.q, reached_.v);
}

/// What (6) reads.
void Sensitivity::remember_end(const FesdStep& step) {
  const Element& last = step.last();
  reached_.is_at_switch = step.ends[static_cast<std::size_t>(step.n_elements) - 1].contact >= 0;
  reached_.modes = last.modes;
  const bool is_known = tableau_.right_end.size() > 0;
  reached_.lambda_n = is_known ? last.end_lambda_n : last.lambda_n.col(n_s_ - 1);
  reached_.lambda_t = is_known ? last.end_lambda_t : last.lambda_t.col(n_s_ - 1);
}

void Sensitivity::add(const FesdStep& step, const Vector& dt_end) {
  const int N = step.n_elements;
  before_ = reached_;
  dt_elements_.resize(static_cast<std::size_t>(N));
  elements_.resize(std::max(elements_.size(), keeps_elements_ ? static_cast<std::size_t>(N) : 1));
  n_elements_ = keeps_elements_ ? static_cast<std::size_t>(N) : 0;
  if (!reached_.modes.empty() && !reached_.is_at_switch) through_switch_at_start(step);
  for (int first = 0; first < N;) {
    int count = 1;  // of the run of equal elements
    while (first + count < N && step.ends[first + count - 1].contact < 0) ++count;
    const Element& last = step.elements[first + count - 1];
    const Switch& end = step.ends[first + count - 1];
    const Switch none;

    State state{Matrix::Zero(n_q_, n_theta_ + 1), Matrix::Zero(n_q_, n_theta_ + 1)};
    state.q.leftCols(n_theta_) = reached_.q;
    state.v.leftCols(n_theta_) = reached_.v;
    ElementVariation element;
    for (int k = first; k < first + count; ++k) {
      ElementDerivatives& stages = elements_[keeps_elements_ ? static_cast<std::size_t>(k) : 0];
      stages.v_minus = state.v;
      through_start(step, k, state);
      element = through_element(step.elements[k], k + 1 < first + count ? none : end, state, stages);
    }
    Vector dh;
    if (end.contact >= 0) {
      const Eigen::RowVectorXd slope = switch_slope(last, end, state, element.forces);
      dh = -slope.head(n_theta_).transpose() / slope[n_theta_];  // (4)
    } else {
      dh = (dt_end - reached_.t) / count;  // (5)
    }
    reached_.q = state.q.leftCols(n_theta_) + state.q.col(n_theta_) * dh.transpose();
    reached_.v = state.v.leftCols(n_theta_) + state.v.col(n_theta_) * dh.transpose();
    stage_accelerations_ = element.accelerations.leftCols(n_theta_);
    stage_accelerations_ += element.accelerations.col(n_theta_) * dh.transpose();
    for (int k = first; k < first + count; ++k) {
      dt_elements_[static_cast<std::size_t>(k)] = reached_.t;
      reached_.t += dh;
      if (!keeps_elements_) continue;
      ElementDerivatives& kept = elements_[static_cast<std::size_t>(k)];
      for (Matrix* values : {&kept.q, &kept.v, &kept.forces, &kept.v_minus, &kept.start_q, &kept.start_v})
        values->leftCols(n_theta_) += values->col(n_theta_) * dh.transpose();
      kept.h = dh;
    }
    first += count;
  }
  remember_end(step);
}

int Sensitivity::switch_at_start(const std::vector<ContactMode>& before, const FesdStep& step) {
  if (!step.touches) return -1;
  const std::vector<ContactMode>& after = step.elements[0].modes;
  const auto Lambda_n = step.Lambda_n.col(0);
  const bool has_impulse = !Lambda_n.isZero(0);
  for (int i = 0; i < std::ssize(before); ++i) {
    const bool closes = !is_closed(before[i]) && Lambda_n[i] > 0,
               stops = !has_impulse && is_slipping(before[i]) && is_closed(after[i]) && after[i] != before[i];
    if (closes || stops) return i;
  }
  return -1;
}

/// (6)
void Sensitivity::through_switch_at_start(const FesdStep& step) {
  const int contact = switch_at_start(reached_.modes, step);
  if (contact < 0) return;
  const Vector q = step.elements[0].q0, v = step.v_minus.col(0);
  const bool has_impulse = step.Lambda_n(contact, 0) > 0;
  const Matrix J_n = problem_.normal_jacobian(q), J_t = problem_.tangent_jacobian(q);
  const Vector contact_force = problem_.force_directions(J_n * reached_.lambda_n + J_t * reached_.lambda_t),
               a = CholeskyFactors(problem_.mass_matrix(q)).solve(problem_.force(q, v) + contact_force);
  const Matrix direct = varied_.rows(q, v, a, reached_.lambda_n, reached_.lambda_t).leftCols(n_theta_);
  Matrix slope;        // of the switch functions, by theta
  Vector slope_per_h;  // by the length of the element
  if (has_impulse) {
    slope = J_n.col(contact).transpose() * reached_.q + direct.row(varied_.gap_row(contact));
    slope_per_h = J_n.col(contact).transpose() * v;
  } else {
    const auto& info = problem_.info().contacts[contact];
    Matrix T(n_t_, n_q_);
    problem_.slip_velocity_derivative(q.data(), v.data(), T.data());
    const Matrix s_q = T.middleRows(info.tangent_index, info.n_t),
                 s_v = J_t.middleCols(info.tangent_index, info.n_t).transpose();
    slope = s_q * reached_.q + s_v * reached_.v + direct.middleRows(varied_.slip_row(contact), info.n_t);
    slope_per_h = s_q * v + s_v * a;
  }
  const Vector dh = -slope.transpose() * slope_per_h / slope_per_h.squaredNorm();
  reached_.q += v * dh.transpose();
  reached_.v += a * dh.transpose();
  reached_.t += dh;
}

void Sensitivity::through_start(const FesdStep& step, int element, State& state) const {
  if (!step.touches || step.Lambda_n.col(element).isZero(0)) return;
  const Element& e = step.elements[element];
  const Vector v_minus = step.v_minus.col(element), Lambda_n = step.Lambda_n.col(element),
               Lambda_t = step.Lambda_t.col(element);
  point_.through_impact({e.q0, v_minus, e.v0, Lambda_n, Lambda_t}, state.q, state.v);
}

/// (8) of switch_function.h holds at the right end, which is a stage.
bool Sensitivity::stops_in_space(const Element& e, const Switch& end) {
  return end.kind == SwitchKind::slip_stops && end.contact >= 0 && e.modes[end.contact] == ContactMode::slip;
}

/// (6a) holds at the right end.
bool Sensitivity::sticks_at_end(const Element& e, const Switch& end, int contact) {
  return e.modes[contact] == ContactMode::stick || (end.contact == contact && stops_in_space(e, end));
}

/// Law of a contact that slips at the right end.
Sensitivity::Friction Sensitivity::slip_at_end(const Element& e, int contact, double lambda_n) const {
  const auto& info = problem_.info().contacts[contact];
  return point_.slip(contact, point_.slip_velocity(contact, e.q1, e.v1), lambda_n, slip_sign(e.modes[contact]),
                     e.slip_start.segment(info.tangent_index, info.n_t));
}

/// Friction laws of the closed contacts for PointVariation. @param lambda_n  n_c, or impulses
std::vector<Sensitivity::Friction> Sensitivity::laws_at_end(const Element& e, const Switch& end,
                                                            const Vector& lambda_n) const {
  std::vector<Friction> laws;
  for (int i = 0; i < n_c_; ++i) {
    if (!is_closed(e.modes[i])) continue;
    laws.emplace_back();
    if (problem_.info().contacts[i].n_t == 0) continue;
    laws.back() = slip_at_end(e, i, lambda_n[i]);
    laws.back().sticks = sticks_at_end(e, end, i);
  }
  return laws;
}

/// (10) of end_projection.h
void Sensitivity::through_projection(const Element& e, const Switch& end, State& state) const {
  const Vector v_minus = e.v0 + e.h * e.a * tableau_.b;
  const Matrix J_n = problem_.normal_jacobian(e.q1), J_t = problem_.tangent_jacobian(e.q1);
  Matrix forces = Matrix::Zero(n_c_ + n_t_, n_c_ + n_t_), C(n_q_, n_c_ + n_t_);  // of one impulse per column
  for (int i = 0; i < n_c_; ++i) {
    const auto& contact = problem_.info().contacts[i];
    const int t = n_c_ + contact.tangent_index;
    if (!is_closed(e.modes[i])) continue;
    forces(i, i) = 1;
    if (sticks_at_end(e, end, i))
      forces.block(t, t, contact.n_t, contact.n_t).setIdentity();
    else if (contact.n_t > 0)
      forces.block(t, i, contact.n_t, 1) = -contact.mu * slip_at_end(e, i, 0).direction;
  }
  C << problem_.force_directions(J_n), problem_.force_directions(J_t);
  C *= forces;
  const Vector Lambda = forces * least_squares(C, problem_.mass_matrix(e.q1) * (e.v1 - v_minus)),
               Lambda_n = Lambda.head(n_c_), Lambda_t = Lambda.tail(n_t_);
  point_.through_impulse(PointVariation::numbering(problem_.info(), e.modes), {e.q1, v_minus, e.v1, Lambda_n, Lambda_t},
                         false, laws_at_end(e, end, Lambda_n), state.q, state.v);
}

/// (3) at fixed accelerations.
void Sensitivity::start_stages(const Element& e, const State& start, ElementDerivatives& stages) const {
  const double h = e.h;
  stages.start_q = start.q;
  stages.start_v = start.v;
  stages.q.resize(n_s_ * n_q_, n_theta_ + 1);
  stages.v.resize(n_s_ * n_q_, n_theta_ + 1);
  for (int j = 0; j < n_s_; ++j) {
    auto q = stages.q.middleRows(j * n_q_, n_q_), v = stages.v.middleRows(j * n_q_, n_q_);
    q = start.q + h * r_[j] * start.v;
    v = start.v;
    q.col(n_theta_) += r_[j] * e.v0;
    for (int l = 0; l < n_s_; ++l) {
      q.col(n_theta_) += 2 * h * A2_(j, l) * e.a.col(l);
      v.col(n_theta_) += tableau_.A(j, l) * e.a.col(l);
    }
  }
}

/// Adds what the accelerations contribute to (3), and the forces. @param dx  of the unknowns
void Sensitivity::finish_stages(const Element& e, const Matrix& dx, const Numbering& numbering,
                                ElementDerivatives& stages) const {
  const double h = e.h;
  const Eigen::Index n = numbering.size, n_forces = n_c_ + n_t_;
  stages.forces.setZero(n_s_ * n_forces, n_theta_ + 1);
  for (int j = 0; j < n_s_; ++j) {
    for (int l = 0; l < n_s_; ++l) {
      stages.q.middleRows(j * n_q_, n_q_) += h * h * A2_(j, l) * dx.middleRows(l * n, n_q_);
      stages.v.middleRows(j * n_q_, n_q_) += h * tableau_.A(j, l) * dx.middleRows(l * n, n_q_);
    }
    point_.add_forces(numbering, dx.middleRows(j * n, n), 1, stages.forces.middleRows(j * n_forces, n_forces));
  }
}

/// (1)-(3)
Sensitivity::ElementVariation Sensitivity::through_element(const Element& e, const Switch& end, State& state,
                                                           ElementDerivatives& stages) {
  const ProblemInfo& info = problem_.info();
  const Matrix& A = tableau_.A;
  const double h = e.h;

  start_stages(e, state, stages);
  const Numbering numbering = PointVariation::numbering(info, e.modes);
  const Eigen::Index n = numbering.size;
  auto& [K, R, rows, q, v, a, lambda_n, lambda_t] = scratch_;
  K.setZero(n_s_ * n, n_s_ * n);
  R.resize(n_s_ * n, n_theta_ + 1);
  for (int j = 0; j < n_s_; ++j) {
    q = e.q.col(j);
    v = e.v.col(j);
    a = e.a.col(j);
    lambda_n = e.lambda_n.col(j);
    lambda_t = e.lambda_t.col(j);
    const Matrix direct = varied_.rows(q, v, a, lambda_n, lambda_t);
    point_.set_motion(numbering, {q, v, a, lambda_n, lambda_t}, direct, rows);  // (1)
    Matrix J_n;
    if (!numbering.contacts.empty()) J_n = problem_.normal_jacobian(q);
    for (const auto& [i, row] : numbering.contacts) {
      const auto& contact = info.contacts[i];
      rows.q.row(row) = J_n.col(i).transpose() / (h * h);  // (2), scaled for the pivoting
      rows.theta.row(row) = direct.row(varied_.gap_row(i)) / (h * h);
      if (contact.n_t > 0) {
        Friction friction = point_.slip(i, point_.slip_velocity(i, q, v), lambda_n[i], slip_sign(e.modes[i]),
                                        e.slip_start.segment(contact.tangent_index, contact.n_t));
        friction.sticks = e.modes[i] == ContactMode::stick || (j == n_s_ - 1 && sticks_at_end(e, end, i));
        point_.add_friction(i, friction, q, v, lambda_n[i], direct, row, row + 1, rows);
      }
    }
    R.middleRows(j * n, n) = rows.theta;
    R.middleRows(j * n, n).noalias() += rows.q * stages.q.middleRows(j * n_q_, n_q_);
    R.middleRows(j * n, n).noalias() += rows.v * stages.v.middleRows(j * n_q_, n_q_);
    K.block(j * n, j * n, n, n) += rows.x;
    for (int l = 0; l < n_s_; ++l) K.block(j * n, l * n, n, n_q_) += h * h * A2_(j, l) * rows.q + h * A(j, l) * rows.v;
  }
  // Without contacts K is M up to O(h); of redundant contacts, any of the forces that balance each other will do.
  const Matrix dx = numbering.contacts.empty() ? -solve_partial_pivoting(K, R) : -solve_consistent(K, R);

  finish_stages(e, dx, numbering, stages);
  ElementVariation element{Matrix::Zero(n_c_ + n_t_, n_theta_ + 1), Matrix(n_s_ * n_q_, n_theta_ + 1)};
  state.q += h * state.v;
  state.q.col(n_theta_) += e.v0 + 2 * h * e.a * bA_;
  state.v.col(n_theta_) += e.a * tableau_.b;
  for (int j = 0; j < n_s_; ++j) {
    const auto dw = dx.middleRows(j * n, n_q_);
    element.accelerations.middleRows(j * n_q_, n_q_) = dw;
    state.q += h * h * bA_[j] * dw;
    state.v += h * tableau_.b[j] * dw;
    if (tableau_.right_end.size() > 0)
      point_.add_forces(numbering, dx.middleRows(j * n, n), tableau_.right_end[j], element.forces);
  }
  if (e.is_projected) through_projection(e, end, state);
  if (e.has_end_forces && !stops_in_space(e, end)) element.forces = constrained_forces(e, end, state);
  return element;
}

/// (11) of end_projection.h, varied. @param state  at the right end
Matrix Sensitivity::constrained_forces(const Element& e, const Switch& end, const State& state) const {
  const Vector &q = e.q1, &v = e.v1, &lambda_n = e.end_lambda_n, &lambda_t = e.end_lambda_t;
  const Matrix D_n = problem_.force_directions(problem_.normal_jacobian(q)),
               D_t = problem_.force_directions(problem_.tangent_jacobian(q));
  const Vector a =
      CholeskyFactors(problem_.mass_matrix(q)).solve(problem_.force(q, v) + D_n * lambda_n + D_t * lambda_t);
  const Numbering numbering = PointVariation::numbering(problem_.info(), e.modes);
  const Matrix dx =
      point_.accelerations(numbering, {q, v, a, lambda_n, lambda_t}, varied_.rows(q, v, a, lambda_n, lambda_t),
                           laws_at_end(e, end, lambda_n), e.h, state.q, state.v);
  Matrix forces = Matrix::Zero(n_c_ + n_t_, n_theta_ + 1);
  point_.add_forces(numbering, dx, 1, forces);
  return forces;
}

/// (4) @param e  the last element of the run; @param state  at its right end; @param forces  its variations
Eigen::RowVectorXd Sensitivity::switch_slope(const Element& e, const Switch& end, const State& state,
                                             const Matrix& forces) const {
  const auto& contact = problem_.info().contacts[end.contact];
  const Matrix direct = varied_.rows(e.q1, e.v1, e.a.col(n_s_ - 1), e.lambda_n.col(n_s_ - 1), e.lambda_t.col(n_s_ - 1));
  switch (end.kind) {
    case SwitchKind::gap_closes:
      return problem_.normal_jacobian(e.q1).col(end.contact).transpose() * state.q +
             direct.row(varied_.gap_row(end.contact));
    case SwitchKind::force_vanishes:
      return forces.row(end.contact);
    case SwitchKind::slip_stops: {
      if (contact.n_t == 2) break;  // (8) of switch_function.h: the cone
      Matrix T(n_t_, n_q_);
      problem_.slip_velocity_derivative(e.q1.data(), e.v1.data(), T.data());
      return T.row(contact.tangent_index) * state.q +
             problem_.tangent_jacobian(e.q1).col(contact.tangent_index).transpose() * state.v +
             direct.row(varied_.slip_row(end.contact));
    }
    case SwitchKind::cone_reached:
      break;
    case SwitchKind::slip_turns:
    case SwitchKind::edge_left:
      throw std::logic_error("a switch of the friction polygon, which sensitivities are declined with");
  }
  const bool is_of_stage = stops_in_space(e, end);
  const double lambda_n = is_of_stage ? e.lambda_n(end.contact, n_s_ - 1) : e.end_lambda_n[end.contact];
  const Vector lambda_t =
      (is_of_stage ? Vector(e.lambda_t.col(n_s_ - 1)) : e.end_lambda_t).segment(contact.tangent_index, contact.n_t);
  return point_.cone_margin(end.contact, lambda_n, lambda_t, forces);
}

}  // namespace ricochet
