#include "methods/fesd/sensitivity.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

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
      n_theta_(varied_.n_theta()),
      state_{Matrix(n_q_, n_theta_ + 1), Matrix(n_q_, n_theta_ + 1)},
      element_{Matrix(n_c_ + n_t_, n_theta_ + 1), Matrix(n_s_ * n_q_, n_theta_ + 1)},
      slope_(n_theta_ + 1),
      dh_(n_theta_) {
  restart(nullptr);
}

void Sensitivity::restart(const FesdStep* before) {
  reached_.q = varied_.dq0();
  reached_.v = varied_.dv0();
  reached_.t.setZero(n_theta_);
  reached_.is_at_switch = false;
  reached_.modes.clear();
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
  if (tableau_.right_end.size() > 0) {
    reached_.lambda_n = last.end_lambda_n;
    reached_.lambda_t = last.end_lambda_t;
  } else {
    reached_.lambda_n = last.lambda_n.col(n_s_ - 1);
    reached_.lambda_t = last.lambda_t.col(n_s_ - 1);
  }
}

void Sensitivity::add(const FesdStep& step, const Vector& dt_end) {
  const int N = step.n_elements;
  before_ = reached_;
  if (std::ssize(dt_elements_) < N) dt_elements_.resize(static_cast<std::size_t>(N));
  const std::size_t n_kept = kept_ ? static_cast<std::size_t>(N) : 1;
  std::vector<ElementDerivatives>& elements = kept_ ? *kept_ : elements_;
  if (elements.size() < n_kept) elements.resize(n_kept);
  if (!reached_.modes.empty() && !reached_.is_at_switch) through_switch_at_start(step);
  for (int first = 0; first < N;) {
    int count = 1;  // of the run of equal elements
    while (first + count < N && step.ends[first + count - 1].contact < 0) ++count;
    const Element& last = step.elements[first + count - 1];
    const Switch& end = step.ends[first + count - 1];
    const Switch none;

    state_.q << reached_.q, Vector::Zero(n_q_);
    state_.v << reached_.v, Vector::Zero(n_q_);
    for (int k = first; k < first + count; ++k) {
      ElementDerivatives& stages = elements[kept_ ? static_cast<std::size_t>(k) : 0];
      stages.v_minus = state_.v;
      through_start(step, k, state_);
      through_element(step.elements[k], k + 1 < first + count ? none : end, state_, stages);
    }
    if (end.contact >= 0) {
      set_switch_slope(last, end, state_, element_.forces);
      dh_ = -slope_.head(n_theta_).transpose() / slope_[n_theta_];  // (4)
    } else {
      dh_ = (dt_end - reached_.t) / count;  // (5)
    }
    const auto at_end = [&](const Matrix& values, Matrix& sum) {
      sum = values.leftCols(n_theta_);
      sum.noalias() += values.col(n_theta_).lazyProduct(dh_.transpose());
    };
    at_end(state_.q, reached_.q);
    at_end(state_.v, reached_.v);
    at_end(element_.accelerations, stage_accelerations_);
    for (int k = first; k < first + count; ++k) {
      dt_elements_[static_cast<std::size_t>(k)] = reached_.t;
      reached_.t += dh_;
      if (!kept_) continue;
      ElementDerivatives& kept = elements[static_cast<std::size_t>(k)];
      for (Matrix* values : {&kept.q, &kept.v, &kept.forces, &kept.v_minus, &kept.start_q, &kept.start_v})
        values->leftCols(n_theta_).noalias() += values->col(n_theta_).lazyProduct(dh_.transpose());
      kept.h = dh_;
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
  const ScratchPool::Frame frame(point_.pool());
  const Eigen::Ref<const Vector> q = step.elements[0].q0, v = step.v_minus.col(0);
  const bool has_impulse = step.Lambda_n(contact, 0) > 0;
  const auto J = point_.jacobians(q, v);
  VectorMap a = point_.pool().vector(n_q_);
  point_.acceleration(q, v, J, reached_.lambda_n, reached_.lambda_t, a);
  MatrixMap direct = point_.pool().matrix(varied_.n_rows(), n_theta_);
  varied_.rows({q, v, a, reached_.lambda_n, reached_.lambda_t}, point_.pool(), direct);
  const auto& info = problem_.info().contacts[contact];
  const Eigen::Index n = has_impulse ? 1 : info.n_t;
  MatrixMap slope = point_.pool().matrix(n, n_theta_);  // of the switch functions, by theta
  VectorMap slope_per_h = point_.pool().vector(n);      // by the length of the element
  if (has_impulse) {
    slope = direct.row(varied_.gap_row(contact));
    slope.noalias() += J.J_n.col(contact).transpose().lazyProduct(reached_.q);
    slope_per_h[0] = J.J_n.col(contact).dot(v);
  } else {
    const auto s_q = J.T.middleRows(info.tangent_index, info.n_t);
    const auto s_v = J.J_t.middleCols(info.tangent_index, info.n_t).transpose();
    slope = direct.middleRows(varied_.slip_row(contact), info.n_t);
    slope.noalias() += s_q.lazyProduct(reached_.q);
    slope.noalias() += s_v.lazyProduct(reached_.v);
    slope_per_h.noalias() = s_q.lazyProduct(v);
    slope_per_h.noalias() += s_v.lazyProduct(a);
  }
  dh_.noalias() = slope.transpose().lazyProduct(slope_per_h);
  dh_ /= -slope_per_h.squaredNorm();
  reached_.q.noalias() += v.lazyProduct(dh_.transpose());
  reached_.v.noalias() += a.lazyProduct(dh_.transpose());
  reached_.t += dh_;
}

void Sensitivity::through_start(const FesdStep& step, int element, State& state) const {
  if (!step.touches || step.Lambda_n.col(element).isZero(0)) return;
  const Element& e = step.elements[element];
  point_.through_impact({e.q0, step.v_minus.col(element), e.v0, step.Lambda_n.col(element), step.Lambda_t.col(element)},
                        state.q, state.v);
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
void Sensitivity::set_laws_at_end(const Element& e, const Switch& end, const Eigen::Ref<const Vector>& lambda_n) {
  laws_.clear();
  for (int i = 0; i < n_c_; ++i) {
    if (!is_closed(e.modes[i])) continue;
    laws_.emplace_back();
    if (problem_.info().contacts[i].n_t == 0) continue;
    laws_.back() = slip_at_end(e, i, lambda_n[i]);
    laws_.back().sticks = sticks_at_end(e, end, i);
  }
}

/// (10) of end_projection.h. With the impulses C Lambda of all closed contacts, of which the directions may depend on each
/// other, M (v_1 - v-) = C Lambda has the shortest solution Lambda = (C' M^-1 C)^+ C' (v_1 - v-).
void Sensitivity::through_projection(const Element& e, const Switch& end, State& state) {
  ScratchPool& pool = point_.pool();
  const ScratchPool::Frame frame(pool);
  VectorMap v_minus = pool.vector(n_q_), jump = pool.vector(n_q_), Lambda_n = pool.vector(n_c_),
            Lambda_t = pool.vector(n_t_);
  v_minus = e.v0;
  for (int j = 0; j < n_s_; ++j) v_minus += e.h * tableau_.b[j] * e.a.col(j);
  const auto J = point_.jacobians(e.q1);
  Eigen::Index n = 0;  // impulses, in the order of the contacts: that of the gap, then those of a contact that sticks
  for (const auto& [i, row] : numbering_.contacts)
    n += 1 + (sticks_at_end(e, end, i) ? problem_.info().contacts[i].n_t : 0);
  MatrixMap C = pool.matrix(n_q_, n), MC = pool.matrix(n_q_, n), delassus = pool.matrix(n, n);
  VectorMap Lambda = pool.vector(n);
  Eigen::Index k = 0;
  for (const auto& [i, row] : numbering_.contacts) {
    const auto& contact = problem_.info().contacts[i];
    C.col(k++) = J.J_n.col(i);
    if (sticks_at_end(e, end, i)) {
      for (int d = 0; d < contact.n_t; ++d) C.col(k++) = J.J_t.col(contact.tangent_index + d);
    } else if (contact.n_t > 0) {
      const Friction slip = slip_at_end(e, i, 0);
      for (int d = 0; d < contact.n_t; ++d)
        C.col(k - 1) -= contact.mu * slip.direction[d] * J.J_t.col(contact.tangent_index + d);
    }
  }
  if (problem_.info().clock >= 0) C.row(problem_.info().clock).setZero();
  MC = C;
  point_.divide_by_mass(e.q1, MC);
  delassus.noalias() = C.transpose().lazyProduct(MC);
  jump = e.v1 - v_minus;
  Lambda.noalias() = C.transpose().lazyProduct(jump);
  delassus_.factorize(delassus);
  delassus_.apply_in_place(Lambda);
  Lambda_n.setZero();
  Lambda_t.setZero();
  k = 0;
  for (const auto& [i, row] : numbering_.contacts) {
    const auto& contact = problem_.info().contacts[i];
    Lambda_n[i] = Lambda[k++];
    auto tangential = Lambda_t.segment(contact.tangent_index, contact.n_t);
    if (sticks_at_end(e, end, i)) {
      for (int d = 0; d < contact.n_t; ++d) tangential[d] = Lambda[k++];
    } else if (contact.n_t > 0) {
      tangential = -contact.mu * Lambda_n[i] * slip_at_end(e, i, 0).direction;
    }
  }
  set_laws_at_end(e, end, Lambda_n);
  point_.through_impulse(numbering_, {e.q1, v_minus, e.v1, Lambda_n, Lambda_t}, false, laws_, state.q, state.v);
}

/// (3) at fixed accelerations.
void Sensitivity::start_stages(const Element& e, const State& start, ElementDerivatives& stages) const {
  const double h = e.h;
  stages.start_q = start.q;
  stages.start_v = start.v;
  stages.q.resize(n_s_ * n_q_, n_theta_ + 1);
  stages.v.resize(n_s_ * n_q_, n_theta_ + 1);
  for (Eigen::Index c = 0; c <= n_theta_; ++c) {
    const double *q_0 = &start.q(0, c), *v_0 = &start.v(0, c);
    double *q = &stages.q(0, c), *v = &stages.v(0, c);
    for (int j = 0; j < n_s_; ++j) {
      for (int i = 0; i < n_q_; ++i) {
        *q++ = q_0[i] + h * r_[j] * v_0[i];
        *v++ = v_0[i];
      }
    }
  }
  for (int j = 0; j < n_s_; ++j) {
    auto q = stages.q.col(n_theta_).segment(j * n_q_, n_q_), v = stages.v.col(n_theta_).segment(j * n_q_, n_q_);
    q += r_[j] * e.v0;
    for (int l = 0; l < n_s_; ++l) {
      q += 2 * h * A2_(j, l) * e.a.col(l);
      v += tableau_.A(j, l) * e.a.col(l);
    }
  }
}

/// Adds what the accelerations contribute to (3), and the forces. @param dx  of the unknowns
void Sensitivity::finish_stages(const Element& e, const MatrixMap& dx, ElementDerivatives& stages) const {
  const double h = e.h;
  const Eigen::Index n = numbering_.size, n_forces = n_c_ + n_t_;
  for (Eigen::Index c = 0; c <= n_theta_; ++c) {
    for (int j = 0; j < n_s_; ++j) {
      double *q = &stages.q(j * n_q_, c), *v = &stages.v(j * n_q_, c);
      for (int l = 0; l < n_s_; ++l) {
        const double *dw = &dx(l * n, c), for_q = h * h * A2_(j, l), for_v = h * tableau_.A(j, l);
        for (int i = 0; i < n_q_; ++i) {
          q[i] += for_q * dw[i];
          v[i] += for_v * dw[i];
        }
      }
    }
  }
  stages.forces.setZero(n_s_ * n_forces, n_theta_ + 1);
  if (numbering_.contacts.empty()) return;
  for (int j = 0; j < n_s_; ++j)
    point_.add_forces(numbering_, dx.middleRows(j * n, n), 1, stages.forces.middleRows(j * n_forces, n_forces));
}

/// (1), (2) of one stage. @param K  its rows of the matrix of all accelerations and forces; @param R  n x (n_theta + 1)
void Sensitivity::add_stage(const Element& e, const Switch& end, int j, const ElementDerivatives& stages,
                            Eigen::Ref<Matrix> K, Eigen::Ref<Matrix> R) {
  ScratchPool& pool = point_.pool();
  const ScratchPool::Frame frame(pool);
  const ProblemInfo& info = problem_.info();
  const double h = e.h;
  const Eigen::Index n = numbering_.size;
  const PointOfMotion at{e.q.col(j), e.v.col(j), e.a.col(j), e.lambda_n.col(j), e.lambda_t.col(j)};
  const bool varies = varied_.varies_parameters();
  Rows rows(pool, n, n_q_, n_theta_ + 1);
  MatrixMap direct = pool.matrix(varies ? varied_.n_rows() : n_q_, n_theta_ + 1);
  varied_.rows(at, pool, direct);
  rows.theta.topRows(n_q_) = direct.topRows(n_q_);
  const bool is_free = numbering_.contacts.empty();
  const auto J = is_free ? PointVariation::Jacobians{{nullptr, 0, 0}, {nullptr, 0, 0}, {nullptr, 0, 0}}
                         : point_.jacobians(at.q, at.v);
  point_.set_motion(numbering_, at, J, rows);  // (1)
  for (const auto& [i, row] : numbering_.contacts) {
    const auto& contact = info.contacts[i];
    rows.q.row(row) = J.J_n.col(i).transpose() / (h * h);  // (2), scaled for the pivoting
    if (varies) rows.theta.row(row) = direct.row(varied_.gap_row(i)) / (h * h);
    if (contact.n_t == 0) continue;
    Friction friction = point_.slip(i, point_.slip_velocity(i, J, at.v), at.lambda_n[i], slip_sign(e.modes[i]),
                                    e.slip_start.segment(contact.tangent_index, contact.n_t));
    friction.sticks = e.modes[i] == ContactMode::stick || (j == n_s_ - 1 && sticks_at_end(e, end, i));
    point_.add_friction(i, friction, J, at.lambda_n[i], direct, row, row + 1, rows);
  }
  R = rows.theta;
  R.noalias() += rows.q.lazyProduct(stages.q.middleRows(j * n_q_, n_q_));
  if (!rows.v.isZero(0)) R.noalias() += rows.v.lazyProduct(stages.v.middleRows(j * n_q_, n_q_));
  for (int l = 0; l < n_s_; ++l) {
    auto block = K.middleCols(l * n, n);
    block.setZero();
    if (l == j) block = rows.x;
    block.leftCols(n_q_) += h * h * A2_(j, l) * rows.q + h * tableau_.A(j, l) * rows.v;
  }
}

/// Replaces R by K^-1 R. Without contacts K is M up to O(h); of redundant contacts, any of the forces that balance each
/// other will do. Elements of equal length and modes often have the same K.
void Sensitivity::solve(const MatrixMap& K, MatrixMap& R) {
  const auto size = static_cast<std::size_t>(K.rows());
  if (factors_.size() <= size) factors_.resize(size + 1);
  if (!factors_[size]) factors_[size] = std::make_unique<Factors>();
  Factors& factors = *factors_[size];
  if (factors.K.rows() != K.rows() || !(factors.K.array() == K.array()).all()) {
    ++n_factorisations_;
    factors.K = K;
    factors.lu.factorize(factors.K);
  }
  factors.lu.solve_in_place(R);
}

/// (1)-(3)
void Sensitivity::through_element(const Element& e, const Switch& end, State& state, ElementDerivatives& stages) {
  ScratchPool& pool = point_.pool();
  const ScratchPool::Frame frame(pool);
  const double h = e.h;
  start_stages(e, state, stages);
  numbering_.set(problem_.info(), e.modes);
  const Eigen::Index n = numbering_.size;
  MatrixMap K = pool.matrix(n_s_ * n, n_s_ * n), dx = pool.matrix(n_s_ * n, n_theta_ + 1);
  for (int j = 0; j < n_s_; ++j) add_stage(e, end, j, stages, K.middleRows(j * n, n), dx.middleRows(j * n, n));
  solve(K, dx);
  dx = -dx;

  finish_stages(e, dx, stages);
  const bool has_forces = needs_forces(end);
  element_.forces.setZero();
  state.q += h * state.v;
  state.q.col(n_theta_) += e.v0;
  for (int j = 0; j < n_s_; ++j) {
    const auto dw = dx.middleRows(j * n, n_q_);
    element_.accelerations.middleRows(j * n_q_, n_q_) = dw;
    state.q.col(n_theta_) += 2 * h * bA_[j] * e.a.col(j);
    state.v.col(n_theta_) += tableau_.b[j] * e.a.col(j);
    state.q += h * h * bA_[j] * dw;
    state.v += h * tableau_.b[j] * dw;
    if (has_forces && tableau_.right_end.size() > 0)
      point_.add_forces(numbering_, dx.middleRows(j * n, n), tableau_.right_end[j], element_.forces);
  }
  if (e.is_projected) through_projection(e, end, state);
  if (has_forces && e.has_end_forces && !stops_in_space(e, end)) set_constrained_forces(e, end, state);
}

/// Whether the forces at the right end decide when the switch happens, (4).
bool Sensitivity::needs_forces(const Switch& end) const {
  if (end.contact < 0 || end.kind == SwitchKind::gap_closes) return false;
  return end.kind != SwitchKind::slip_stops || problem_.info().contacts[end.contact].n_t == 2;
}

/// (11) of end_projection.h, varied: the forces of element_. @param state  at the right end
void Sensitivity::set_constrained_forces(const Element& e, const Switch& end, const State& state) {
  ScratchPool& pool = point_.pool();
  const ScratchPool::Frame frame(pool);
  VectorMap a = pool.vector(n_q_);
  point_.acceleration(e.q1, e.v1, point_.jacobians(e.q1), e.end_lambda_n, e.end_lambda_t, a);
  const PointOfMotion at{e.q1, e.v1, a, e.end_lambda_n, e.end_lambda_t};
  MatrixMap direct = pool.matrix(varied_.n_rows(), n_theta_ + 1), dx = pool.matrix(numbering_.size, n_theta_ + 1);
  varied_.rows(at, pool, direct);
  set_laws_at_end(e, end, e.end_lambda_n);
  point_.accelerations(numbering_, at, direct, laws_, e.h, state.q, state.v, dx);
  element_.forces.setZero();
  point_.add_forces(numbering_, dx, 1, element_.forces);
}

/// (4), into slope_. @param e  the last element of the run; @param state  at its right end; @param forces  its variations
void Sensitivity::set_switch_slope(const Element& e, const Switch& end, const State& state, const Matrix& forces) {
  ScratchPool& pool = point_.pool();
  const ScratchPool::Frame frame(pool);
  const auto& contact = problem_.info().contacts[end.contact];
  MatrixMap direct = pool.matrix(varied_.n_rows(), n_theta_ + 1);
  varied_.rows({e.q1, e.v1, e.a.col(n_s_ - 1), e.lambda_n.col(n_s_ - 1), e.lambda_t.col(n_s_ - 1)}, pool, direct);
  switch (end.kind) {
    case SwitchKind::gap_closes:
      slope_ = direct.row(varied_.gap_row(end.contact));
      slope_.noalias() += point_.jacobians(e.q1).J_n.col(end.contact).transpose().lazyProduct(state.q);
      return;
    case SwitchKind::force_vanishes:
      slope_ = forces.row(end.contact);
      return;
    case SwitchKind::slip_stops: {
      if (contact.n_t == 2) break;  // (8) of switch_function.h: the cone
      const auto J = point_.jacobians(e.q1, e.v1);
      slope_ = direct.row(varied_.slip_row(end.contact));
      slope_.noalias() += J.T.row(contact.tangent_index).lazyProduct(state.q);
      slope_.noalias() += J.J_t.col(contact.tangent_index).transpose().lazyProduct(state.v);
      return;
    }
    case SwitchKind::cone_reached:
      break;
    case SwitchKind::slip_turns:
    case SwitchKind::edge_left:
      throw std::logic_error("a switch of the friction polygon, which sensitivities are declined with");
  }
  if (stops_in_space(e, end)) {
    point_.cone_margin(end.contact, e.lambda_n(end.contact, n_s_ - 1),
                       e.lambda_t.col(n_s_ - 1).segment(contact.tangent_index, contact.n_t), forces, slope_);
  } else {
    point_.cone_margin(end.contact, e.end_lambda_n[end.contact],
                       e.end_lambda_t.segment(contact.tangent_index, contact.n_t), forces, slope_);
  }
}

}  // namespace ricochet
