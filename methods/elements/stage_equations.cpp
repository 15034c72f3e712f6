#include "methods/elements/stage_equations.h"

#include <algorithm>
#include <cmath>

#include "problems/packed_column.h"

namespace ricochet {
namespace {

// Rounding of q_0 moves the gap by about 1e-16 of its size per step; from here on it is removed.
constexpr double kGapDrift = 1e-13;
// Rounding of slip velocities, which a switch makes zero to the accuracy of Newton's method, is removed from here on.
constexpr double kSlipDrift = 1e-13;
// The plain difference of two gaps is accurate enough where a contact moves by this part of the size of its gap in the
// element: its rounding is less than 1e-14 of the motion; and where J_n changes by this part over the chord.
constexpr double kLongMotion = 0.04, kLongChord = 0.01;

bool has_curved_contact(const ProblemInfo& info) {
  return std::ranges::any_of(info.contacts, [](const auto& contact) { return !contact.is_affine; });
}

}  // namespace

StageEquations::StageEquations(const Problem& problem, const StageTableau& tableau, const ActiveSet& active,
                               Counters& counters)
    : problem_(problem),
      tableau_(tableau),
      active_(active),
      counters_(counters),
      structure_(problem.info().structure),
      n_q_(problem.n_q()),
      n_s_(tableau.n_s),
      is_curved_(has_curved_contact(problem.info())),
      has_force_jacobian_(structure_.force_uses_position || structure_.force_uses_velocity) {
  const ProblemInfo& info = problem.info();
  if (structure_.constant_mass) M_ = problem.mass_matrix(info.q0);
  f_.resize(n_q_);
  lambda_n_.setZero(info.n_c());
  lambda_t_.setZero(info.n_lambda_t);
  at_.J_n.resize(info.n_normal_entries);
  at_.J_t.resize(info.n_tangent_entries);
  at_.gap.resize(info.n_c());
  at_.T.setZero(info.n_lambda_t, n_q_);
  chord_J_.resize(info.n_normal_entries);
  chord_q_.resize(n_q_);
  chord_variation_.setZero(info.n_c());
  chord_integral_.setZero(info.n_c());
  gap_change_.setZero(info.n_c());
  // Allocates only the dense matrices that the scene needs: with thousands of bodies they are large.
  const Matrix square = Matrix::Zero(n_q_, n_q_);
  if (has_force_jacobian_) Fq_ = Fv_ = square;
  if (is_curved_) Jq_ = square;
  if (!structure_.constant_mass) Mq_ = square;
}

void StageEquations::prepare(StageWorkspace& work) const {
  const ProblemInfo& info = problem_.info();
  work.dq.setZero(n_q_, n_s_);
  for (auto* vector : {&work.gap0, &work.kept_gap, &work.gap_size}) vector->setZero(info.n_c());
  work.kept_slip.setZero(info.n_lambda_t);
  work.J_n0.setZero(info.n_normal_entries);
  work.is_short.assign(info.contacts.size(), false);
}

/// Allocates what only Newton's method needs.
void StageEquations::prepare_derivatives(StageWorkspace& work) const {
  const Matrix square = Matrix::Zero(n_q_, n_q_);
  StageDerivatives& K = work.K;
  K.Dq.resize(n_s_);
  if (has_force_jacobian_ || is_curved_ || !structure_.constant_mass) K.Dq.assign(n_s_, square);
  K.Dv = K.Dq;
  if (!structure_.constant_mass) work.M.assign(n_s_, square);
  for (int j = 0; j < n_s_; ++j) K.M.push_back(structure_.constant_mass ? M_.data() : work.M[j].data());
  for (auto* vectors : {&K.forces, &K.Rq, &K.Rv, &K.Rl}) vectors->resize(n_s_);
}

void StageEquations::resize(StageWorkspace& work) const {
  if (work.K.M.empty()) prepare_derivatives(work);
  const int n = n_s_ * active_.n_unknowns();
  work.r.resize(n);
  work.dx.resize(n);
  work.x.setZero(n);
  StageDerivatives& K = work.K;
  for (int j = 0; j < n_s_; ++j) {
    for (auto* vectors : {&K.forces, &K.Rq, &K.Rv}) (*vectors)[j].setZero(active_.n_entries());
    K.Rl[j].setZero(9 * static_cast<Eigen::Index>(active_.closed().size()));
  }
  K.has_dynamics = has_force_jacobian_ || active_.has_curved() || !structure_.constant_mass;
}

void StageEquations::set_initial_values(const Element& e, double h, StageWorkspace& work) {
  if (active_.empty()) return;
  problem_.gap(e.q0.data(), work.gap0.data());
  problem_.normal_jacobian_of(active_.contacts(), e.q0.data(), work.J_n0.data());
  if (active_.has_friction()) problem_.tangent_jacobian_of(active_.contacts(), e.q0.data(), at_.J_t.data());
  for (const ActiveContact& active : active_.closed()) {
    const int i = active.contact;
    const auto& contact = problem_.info().contacts[i];
    const double* J = work.J_n0.data() + contact.normal_begin;
    const double velocity = packed_terms(contact, J, e.v0);
    // q may pass through zero, and keeps its rounding.
    work.gap_size[i] = std::max(work.gap_size[i], packed_terms(contact, J, e.q0));
    const bool is_drift = std::abs(work.gap0[i]) > kGapDrift * work.gap_size[i];
    const bool is_harmless = std::abs(work.gap0[i]) <= 1e-8 * h * velocity;
    work.kept_gap[i] = is_drift && is_harmless ? work.gap0[i] : 0;
    work.is_short[i] = !contact.is_affine && h * velocity < kLongMotion * work.gap_size[i];
    for (int k = 0; k < active.n_rows - 1; ++k) {
      const double* J_t = at_.J_t.data() + contact.tangent_begin;
      double slip = 0, size = 0;
      for (int d = 0; d < contact.n_t; ++d) {
        for (const int row : contact.support) {
          const double part = active.law.held[k][d] * *J_t++ * e.v0[row];
          slip += part;
          size += std::abs(part);
        }
      }
      work.kept_slip[contact.tangent_index + k] = std::abs(slip) > kSlipDrift * size ? slip : 0;
    }
  }
}

void StageEquations::set_stages(const StageCoefficients& k, Element& e, StageWorkspace& work) const {
  const int n = n_q_;
  const double *a = e.a.data(), *q0 = e.q0.data(), *v0 = e.v0.data();
  for (int j = 0; j < n_s_; ++j) {
    const double *hA = &k.hA(j, 0), *h2A2 = &k.h2A2(j, 0), h_row = k.h_rows[j];
    double *q = e.q.data() + j * n, *v = e.v.data() + j * n;
    for (int i = 0; i < n; ++i) {
      double dv = 0, dq = 0;
      for (int l = 0; l < n_s_; ++l) {
        dv += hA[l] * a[l * n + i];
        dq += h2A2[l] * a[l * n + i];
      }
      v[i] = v0[i] + dv;
      work.dq(i, j) = h_row * v0[i] + dq;
      q[i] = q0[i] + work.dq(i, j);
    }
  }
}

void StageEquations::set_right_end(const StageCoefficients& k, Element& e) const {
  if (tableau_.ends_with_stage) {
    e.q1 = e.q.col(n_s_ - 1);
    e.v1 = e.v.col(n_s_ - 1);
    return;
  }
  for (int i = 0; i < n_q_; ++i) {
    double dv = 0, dq = 0;
    for (int l = 0; l < n_s_; ++l) {
      dv += k.hb[l] * e.a(i, l);
      dq += k.h2bA[l] * e.a(i, l);
    }
    e.v1[i] = e.v0[i] + dv;
    e.q1[i] = e.q0[i] + (k.h * e.v0[i] + dq);
  }
}

/// Largest change of J_n of a contact between two places, relative to its largest entry.
double StageEquations::variation(const ContactInfo& contact, const Vector& J_n, const Vector& other) {
  double change = 0, size = 0;
  for (std::size_t entry = contact.normal_begin; entry < contact.normal_begin + contact.support.size(); ++entry) {
    change = std::max(change, std::abs(J_n[entry] - other[entry]));
    size = std::max(size, std::abs(J_n[entry]));
  }
  return size > 0 ? change / size : change;
}

/// f_c(q_j) - f_c(q_0) of all curved contacts, in gap_change_: by (6) where the element is short and J_n changes by less
/// than 1 % over the chord, else the plain difference is accurate enough.
/// @param at  J_n and the gaps of the stage
void StageEquations::gap_changes(int stage, const Element& e, const StageContacts& at, const StageWorkspace& work) {
  bool has_short_chord = false;
  for (const ActiveContact& active : active_.closed()) {
    const int i = active.contact;
    gap_change_[i] = at.gap[i] - work.gap0[i];
    chord_variation_[i] = work.is_short[i] ? variation(problem_.info().contacts[i], at.J_n, work.J_n0) : 1;
    has_short_chord = has_short_chord || chord_variation_[i] <= kLongChord;
  }
  if (has_short_chord) integrate_chords(stage, e, at, work);
}

/// (6) by four Gauss points: an error of about (1 %)^8 of the result.
void StageEquations::integrate_chords(int stage, const Element& e, const StageContacts& at,
                                      const StageWorkspace& work) {
  static constexpr double nodes[] = {0.069431844202973712, 0.33000947820757187, 0.66999052179242813,
                                     0.93056815579702629};
  static constexpr double weights[] = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307,
                                       0.17392742256872693};
  const auto dq = work.dq.col(stage);
  chord_integral_.setZero();
  for (int m = 0; m < 4; ++m) {
    chord_q_ = e.q0 + nodes[m] * dq;
    problem_.normal_jacobian_of(active_.contacts(), chord_q_.data(), chord_J_.data());
    for (const ActiveContact& active : active_.closed()) {
      const int i = active.contact;
      const auto& contact = problem_.info().contacts[i];
      if (chord_variation_[i] > kLongChord) continue;
      double rate = 0;
      for (std::size_t s = 0; s < contact.support.size(); ++s)
        rate += chord_J_[contact.normal_begin + s] * dq[contact.support[s]];
      chord_integral_[i] += weights[m] * rate;
      chord_variation_[i] = std::max(chord_variation_[i], variation(contact, at.J_n, chord_J_));
    }
  }
  for (const ActiveContact& active : active_.closed()) {
    const int i = active.contact;
    if (chord_variation_[i] <= kLongChord) gap_change_[i] = chord_integral_[i];
  }
}

void StageEquations::residual(const StageCoefficients& k, const Element& e, StageWorkspace& work) {
  const int n = n_q_;
  const double* u = problem_.info().u.data();
  counters_.force_evaluations += n_s_;
  work.load = 0;
  for (int j = 0; j < n_s_; ++j) {
    const double *q = e.q.data() + j * n, *v = e.v.data() + j * n, *a = e.a.data() + j * n;
    double* r = work.r.data() + j * active_.n_unknowns();
    problem_.force(q, v, u, f_.data());
    if (!structure_.constant_mass) problem_.mass_matrix(q, work.M[j].data());
    const double* M = work.K.M[j];
    for (int i = 0; i < n; ++i) work.load = std::max(work.load, std::abs(f_[i]) / M[i * (n + 1)]);
    if (structure_.diagonal_mass) {
      for (int i = 0; i < n; ++i) r[i] = M[i * (n + 1)] * a[i] - f_[i];  // (3)
    } else {
      for (int i = 0; i < n; ++i) {
        double Ma = 0;
        for (int l = 0; l < n; ++l) Ma += M[l * n + i] * a[l];
        r[i] = Ma - f_[i];
      }
    }
    if (active_.empty()) continue;
    problem_.normal_jacobian_of(active_.contacts(), q, at_.J_n.data());
    problem_.gap(q, at_.gap.data());
    if (active_.has_friction()) problem_.tangent_jacobian_of(active_.contacts(), q, at_.J_t.data());
    if (active_.has_curved()) gap_changes(j, e, at_, work);
    for (const ActiveContact& active : active_.closed()) {
      const int i = active.contact;
      const auto& contact = problem_.info().contacts[i];
      const double* J = at_.J_n.data() + contact.normal_begin;
      double change = 0;  // f_c(q_j) - f_c(q_0)
      for (const int row : contact.pushed()) {
        change += *J * work.dq(row, j);
        r[row] -= *J++ * e.lambda_n(i, j);
      }
      if (contact.is_moving) change += *J * work.dq(problem_.info().clock, j);
      if (!contact.is_affine) change = gap_change_[i];
      r[n + active.row] = (work.kept_gap[i] + change) / (k.h * k.h);  // (4)
      if (contact.n_t > 0) friction_residual(k, active, j, e, at_.J_t, work.kept_slip, r);
    }
  }
}

/// l, its size and v_t of (7d) at stage j
StageEquations::SlipForce StageEquations::slip_force(const ActiveContact& active, int j, const Element& e,
                                                     const double* packed_J_t) const {
  const auto& contact = problem_.info().contacts[active.contact];
  const double *J_t = packed_J_t + contact.tangent_begin, *v = e.v.data() + j * n_q_;
  const double* lambda_t = e.lambda_t.col(j).data() + contact.tangent_index;
  SlipForce force{.l = {0, 0}, .size = std::hypot(lambda_t[0], lambda_t[1]), .v_t = {0, 0}};
  for (int d = 0; d < 2; ++d) {
    for (const int row : contact.support) force.v_t[d] += *J_t++ * v[row];
    force.l[d] = force.size > 0 ? lambda_t[d] / force.size : -e.slip_start[contact.tangent_index + d];
  }
  return force;
}

bool StageEquations::start_slip(Element& e) const {
  bool any = false;
  for (const ActiveContact& active : active_.closed()) {
    if (!active_.starts_slip(active, e)) continue;
    any = true;
    const auto& contact = problem_.info().contacts[active.contact];
    const auto start = e.slip_start.segment(contact.tangent_index, 2);
    for (int j = 0; j < n_s_; ++j) {
      e.lambda_t.col(j).segment(contact.tangent_index, 2) =
          -contact.mu * std::max(0.0, e.lambda_n(active.contact, j)) * start;
    }
  }
  return any;
}

/// J_t lambda_t in (3), and (7)
void StageEquations::friction_residual(const StageCoefficients& k, const ActiveContact& active, int j, const Element& e,
                                       const Vector& packed_J_t, const Vector& kept_slip, double* r) const {
  const auto& contact = problem_.info().contacts[active.contact];
  const double* v = e.v.data() + j * n_q_;
  const auto change_of_v = [&](int row) {  // without the rounding of v_j
    double dv = 0;
    for (int l = 0; l < n_s_; ++l) dv += k.hA(j, l) * e.a(row, l);
    return dv;
  };
  const int held = active_.n_held(active, j);
  const double* J_t = packed_J_t.data() + contact.tangent_begin;
  const double* lambda_t = e.lambda_t.col(j).data() + contact.tangent_index;
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
    const double kept = contact.is_affine ? kept_slip[contact.tangent_index + m] : 0;
    const auto& direction = active.law.held[m];
    law[m] = (kept + direction[0] * slip[0] + direction[1] * slip[1]) / ActiveSet::tangential_scale(active, k.h);
  }
  if (active.mode != ContactMode::slip || held > 0) return;
  if (active_.starts_slip(active, e)) {  // (7d)
    const auto [l, size, v_t] = slip_force(active, j, e, packed_J_t.data());
    law[0] = size - contact.mu * e.lambda_n(active.contact, j);
    law[1] = (l[0] * v_t[1] - l[1] * v_t[0]) / k.h;
    return;
  }
  double direction[2];
  active_.slip_direction(active, packed_J_t.data(), v, e, direction);
  const double cone = contact.mu * e.lambda_n(active.contact, j);
  for (int d = 0; d < 2; ++d) law[d] = lambda_t[d] + cone * direction[d];  // (7c)
}

void StageEquations::derivatives(const StageCoefficients& k, const Element& e, StageWorkspace& work) {
  counters_.jacobian_evaluations += n_s_;
  const double* u = problem_.info().u.data();
  StageDerivatives& K = work.K;
  for (int j = 0; j < n_s_; ++j) {
    const double *q = e.q.col(j).data(), *v = e.v.col(j).data();
    Matrix &Dq = K.Dq[j], &Dv = K.Dv[j];
    if (has_force_jacobian_) {
      problem_.force_jacobians(q, v, u, Fq_.data(), Fv_.data());
      Dq = -Fq_;
      Dv = -Fv_;
    } else if (K.has_dynamics) {
      Dq.setZero();
    }
    if (!structure_.constant_mass) {
      problem_.mass_matrix(q, work.M[j].data());
      problem_.mass_derivative(q, e.a.col(j).data(), Mq_.data());
      Dq += Mq_;
    }
    if (active_.empty()) continue;
    if (active_.has_curved()) {
      lambda_n_ = e.lambda_n.col(j);
      if (active_.has_friction()) lambda_t_ = e.lambda_t.col(j);
      problem_.contact_force_derivative(q, lambda_n_.data(), lambda_t_.data(), Jq_.data());
      Dq -= Jq_;
    }
    problem_.normal_jacobian_of(active_.contacts(), q, at_.J_n.data());
    if (active_.has_friction()) {
      problem_.tangent_jacobian_of(active_.contacts(), q, at_.J_t.data());
      if (active_.has_curved()) problem_.slip_velocity_derivative(q, v, at_.T.data());
    }
    for (const ActiveContact& active : active_.closed()) {
      const auto& contact = problem_.info().contacts[active.contact];
      const double* J = at_.J_n.data() + contact.normal_begin;
      for (std::size_t s = 0; s < contact.support.size(); ++s) {
        K.forces[j][active.entry + s] = J[s];
        K.Rq[j][active.entry + s] = J[s] / (k.h * k.h);  // (4)
      }
      if (contact.n_t > 0) friction_derivatives(k, active, j, e, at_, K);
    }
  }
}

/// Columns of lambda_t, and the derivatives of (7)
void StageEquations::friction_derivatives(const StageCoefficients& k, const ActiveContact& active, int j,
                                          const Element& e, const StageContacts& at, StageDerivatives& K) const {
  const auto& contact = problem_.info().contacts[active.contact];
  const auto entries = static_cast<int>(contact.support.size());
  const double* J_t = at.J_t.data() + contact.tangent_begin;
  double* forces = K.forces[j].data() + active.entry;
  for (int d = 0; d < contact.n_t && is_slipping(active.mode); ++d) {  // (7b)
    for (int s = 0; s < entries; ++s) forces[s] -= contact.mu * active.law.along[d] * J_t[d * entries + s];
  }
  const int held = active_.n_held(active, j);
  const double scale = ActiveSet::tangential_scale(active, k.h);
  double* Rl = K.Rl[j].data() + 9 * (&active - active_.closed().data());
  std::fill_n(Rl, 9, 0.0);
  for (int m = 0; m < active.n_rows - 1; ++m) {
    const auto& direction = active.law.held[m];
    const int first = (1 + m) * entries;
    double *Rq = K.Rq[j].data() + active.entry + first, *Rv = K.Rv[j].data() + active.entry + first;
    for (int s = 0; s < entries; ++s) {
      Rq[s] = Rv[s] = 0;
      double& entry = forces[first + s];
      entry = 0;
      for (int d = 0; d < contact.n_t; ++d) entry += direction[d] * J_t[d * entries + s];
      if (m >= held) continue;
      Rv[s] = entry / scale;  // (7a)
      for (int d = 0; d < contact.n_t && !contact.is_affine; ++d)
        Rq[s] += direction[d] / scale * at.T(contact.tangent_index + d, contact.support[s]);
    }
  }
  if (active.mode != ContactMode::slip || held > 0) return;
  if (active_.starts_slip(active, e)) {  // (7d)
    const auto [l, size, v_t] = slip_force(active, j, e, at.J_t.data());
    const double across[2]{-l[1], l[0]}, along = l[0] * v_t[0] + l[1] * v_t[1];
    Rl[3] = -contact.mu;
    for (int d = 0; d < 2; ++d) {
      Rl[3 + 1 + d] = l[d];
      Rl[6 + 1 + d] = size > 0 ? -across[d] * along / (size * k.h) : 0;
      for (int s = 0; s < entries; ++s) {
        K.Rv[j][active.entry + 2 * entries + s] += across[d] / k.h * J_t[d * entries + s];
        if (!contact.is_affine)
          K.Rq[j][active.entry + 2 * entries + s] +=
              across[d] / k.h * at.T(contact.tangent_index + d, contact.support[static_cast<std::size_t>(s)]);
      }
    }
    return;
  }
  double direction[2];
  const double speed = active_.slip_direction(active, at.J_t.data(), e.v.col(j).data(), e, direction);
  const double cone = contact.mu * e.lambda_n(active.contact, j);
  for (int d = 0; d < 2; ++d) {  // (7c)
    const int row = 1 + d, first = active.entry + row * entries;
    Rl[3 * row + row] = 1;
    Rl[3 * row] = contact.mu * direction[d];
    if (speed == 0) continue;
    for (int c = 0; c < contact.n_t; ++c) {
      const double slope = cone * ((d == c ? 1 : 0) - direction[d] * direction[c]) / speed;
      for (int s = 0; s < entries; ++s) {
        K.Rv[j][first + s] += slope * J_t[c * entries + s];
        if (!contact.is_affine) K.Rq[j][first + s] += slope * at.T(contact.tangent_index + c, contact.support[s]);
      }
    }
  }
}

bool StageEquations::set_slip_in_space(Element& e) {
  if (!active_.turns()) return true;
  for (const ActiveContact& active : active_.closed()) {
    if (active.mode != ContactMode::slip) continue;
    const auto& contact = problem_.info().contacts[active.contact];
    for (int j = 0; j < n_s_; ++j) {
      if (active_.rests(active, j)) continue;
      problem_.tangent_jacobian(e.q.col(j).data(), at_.J_t.data());
      if (active_.starts_slip(active, e)) {
        const auto [l, size, v_t] = slip_force(active, j, e, at_.J_t.data());
        if (l[0] * v_t[0] + l[1] * v_t[1] > 0) return false;
        continue;
      }
      double direction[2];
      active_.slip_direction(active, at_.J_t.data(), e.v.col(j).data(), e, direction);
      for (int d = 0; d < contact.n_t; ++d)
        e.lambda_t(contact.tangent_index + d, j) = -contact.mu * e.lambda_n(active.contact, j) * direction[d];
    }
  }
  return true;
}

}  // namespace ricochet
