#include "methods/variations/point_variation.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

using In = const Eigen::Ref<const Matrix>&;
using VectorIn = const Eigen::Ref<const Vector>&;
using Out = Eigen::Ref<Matrix>;

/// A slip velocity after an impulse that counts as none, as part of the velocities that cancel in it.
constexpr double kNoSlip = 1e-12;
/// A difference of fourth order takes steps of this part of the state: its error and rounding are both of 1e-12.
constexpr double kFourthOrderStep = 1e-3;

double max_abs(VectorIn x) {
  return x.lpNorm<Eigen::Infinity>();
}

/// Places and weights of a derivative of fourth order, (8 (f(1) - f(-1)) - (f(2) - f(-2))) / 12.
constexpr struct { double place, weight; } kFourthOrder[] = {{1, 8}, {-1, -8}, {2, -1}, {-2, 1}};

}  // namespace

PointVariation::PointVariation(const VariedProblem& varied)
    : varied_(varied),
      problem_(varied.problem()),
      n_q_(varied.info().n_q),
      n_c_(varied.info().n_c()),
      n_t_(varied.info().n_lambda_t) {}

PointVariation::Jacobians PointVariation::jacobians(VectorIn q) const {
  Jacobians J{pool_.zeros(n_q_, n_c_), pool_.zeros(n_q_, n_t_), pool_.matrix(n_t_, n_q_)};
  const ScratchPool::Frame frame(pool_);
  const ProblemInfo& info = problem_.info();
  VectorMap normals = pool_.vector(info.n_normal_entries), tangents = pool_.vector(info.n_tangent_entries);
  problem_.normal_jacobian(q.data(), normals.data());
  if (n_t_ > 0) problem_.tangent_jacobian(q.data(), tangents.data());
  for (int i = 0; i < n_c_; ++i) {
    const ContactInfo& contact = info.contacts[i];
    const double *normal = normals.data() + contact.normal_begin, *tangent = tangents.data() + contact.tangent_begin;
    for (const int k : contact.support) J.J_n(k, i) = *normal++;
    for (int d = 0; d < contact.n_t; ++d) {
      for (const int k : contact.support) J.J_t(k, contact.tangent_index + d) = *tangent++;
    }
  }
  return J;
}

PointVariation::Jacobians PointVariation::jacobians(VectorIn q, VectorIn v) const {
  Jacobians J = jacobians(q);
  if (n_t_ > 0) problem_.slip_velocity_derivative(q.data(), v.data(), J.T.data());
  return J;
}

PointVariation::Tangent PointVariation::slip_velocity(int contact, const Jacobians& J, VectorIn v) const {
  const auto& info = problem_.info().contacts[contact];
  return J.J_t.middleCols(info.tangent_index, info.n_t).transpose().lazyProduct(v);
}

PointVariation::Tangent PointVariation::slip_velocity(int contact, VectorIn q, VectorIn v) const {
  const ScratchPool::Frame frame(pool_);
  return slip_velocity(contact, jacobians(q), v);
}

/// VariedProblem::rows() without forces, accelerations and controls.
void PointVariation::direct_of_velocities(VectorIn q, VectorIn v, Out direct) const {
  if (!varied_.varies_parameters()) {
    direct.setZero();
    return;
  }
  const ScratchPool::Frame frame(pool_);
  VectorMap zero = pool_.vector(std::max({n_q_, n_c_, n_t_}));
  zero.setZero();
  varied_.rows({q, v, zero.head(n_q_), zero.head(n_c_), zero.head(n_t_)}, pool_, direct);
}

/// Adds those of these rows that begin with `row`.
void PointVariation::add_direct_of_velocities(Eigen::Index row, VectorIn q, VectorIn v, Out change) const {
  if (!varied_.varies_parameters()) return;
  const ScratchPool::Frame frame(pool_);
  MatrixMap direct = pool_.matrix(varied_.n_rows(), change.cols());
  direct_of_velocities(q, v, direct);
  change += direct.middleRows(row, change.rows());
}

void PointVariation::gaps(VectorIn q, In dq, Out change) const {
  const ScratchPool::Frame frame(pool_);
  change.noalias() = jacobians(q).J_n.transpose().lazyProduct(dq);
  VectorMap at_rest = pool_.vector(n_q_);
  at_rest.setZero();
  add_direct_of_velocities(varied_.gap_row(0), q, at_rest, change);
}

void PointVariation::slip_velocities(VectorIn q, VectorIn v, In dq, In dv, Out change) const {
  const ScratchPool::Frame frame(pool_);
  const Jacobians J = jacobians(q, v);
  change.noalias() = J.T.lazyProduct(dq);
  change.noalias() += J.J_t.transpose().lazyProduct(dv);
  add_direct_of_velocities(n_q_ + 2 * n_c_, q, v, change);
}

void PointVariation::divide_by_mass(VectorIn q, Out b) const {
  const ScratchPool::Frame frame(pool_);
  MatrixMap M = pool_.matrix(n_q_, n_q_);
  problem_.mass_matrix(q.data(), M.data());
  mass_.compute(M);
  mass_.solveInPlace(b);
}

void PointVariation::acceleration(VectorIn q, VectorIn v, const Jacobians& J, VectorIn lambda_n, VectorIn lambda_t,
                                  Eigen::Ref<Vector> a) const {
  const ScratchPool::Frame frame(pool_);
  VectorMap contact_force = pool_.vector(n_q_);
  contact_force.noalias() = J.J_n.lazyProduct(lambda_n);
  contact_force.noalias() += J.J_t.lazyProduct(lambda_t);
  if (problem_.info().clock >= 0) contact_force[problem_.info().clock] = 0;
  problem_.force(q.data(), v.data(), problem_.info().u.data(), a.data());
  a += contact_force;
  divide_by_mass(q, a);
}

void PointVariation::project(const std::vector<ContactMode>& modes, VectorIn q, VectorIn v, Matrix& dq,
                             Matrix& dv) const {
  const auto& contacts = problem_.info().contacts;
  held_.clear();
  for (int i = 0; i < n_c_; ++i) {
    const ContactMode mode = modes[static_cast<std::size_t>(i)];
    if (is_closed(mode)) held_.push_back({i, -1});
    for (int d = 0; mode == ContactMode::stick && d < contacts[i].n_t; ++d)
      held_.push_back({i, contacts[i].tangent_index + d});
  }
  if (held_.empty()) return;
  const ScratchPool::Frame frame(pool_);
  const auto n = static_cast<Eigen::Index>(held_.size()), columns = dq.cols();
  const Jacobians J = jacobians(q);
  MatrixMap R = pool_.matrix(n_q_, n), MR = pool_.matrix(n_q_, n), delassus = pool_.matrix(n, n),
            gap = pool_.matrix(n_c_, columns), residual = pool_.zeros(n, columns);
  gaps(q, dq, gap);
  for (Eigen::Index r = 0; r < n; ++r) {
    const auto [i, t] = held_[static_cast<std::size_t>(r)];
    if (t < 0) {
      R.col(r) = J.J_n.col(i);
      residual.row(r) = gap.row(i);
    } else {
      R.col(r) = J.J_t.col(t);
    }
  }
  MR = R;
  if (problem_.info().clock >= 0) MR.row(problem_.info().clock).setZero();
  divide_by_mass(q, MR);
  delassus.noalias() = R.transpose().lazyProduct(MR);
  delassus_.factorize(delassus);
  delassus_.apply_in_place(residual);
  dq.noalias() -= MR.lazyProduct(residual);

  MatrixMap direct = pool_.matrix(varied_.n_rows(), columns), ds = pool_.matrix(n_t_, columns);
  VectorMap curvature = pool_.vector(n_q_);
  direct_of_velocities(q, v, direct);
  slip_velocities(q, v, dq, dv, ds);
  for (Eigen::Index r = 0; r < n; ++r) {
    const auto [i, t] = held_[static_cast<std::size_t>(r)];
    if (t >= 0) {
      residual.row(r) = ds.row(t);
      continue;
    }
    varied_.gap_curvature(i, q, v, pool_, curvature);
    residual.row(r) = direct.row(varied_.rate_row(i));
    residual.row(r).noalias() += curvature.transpose().lazyProduct(dq);
    residual.row(r).noalias() += J.J_n.col(i).transpose().lazyProduct(dv);
  }
  delassus_.apply_in_place(residual);
  dv.noalias() -= MR.lazyProduct(residual);
}

PointVariation::Friction PointVariation::slip(int contact, const Tangent& s, double lambda_n, int sign,
                                              VectorIn start) const {
  const auto& info = problem_.info().contacts[contact];
  Friction friction{.direction = s, .turn = TangentMatrix::Zero(info.n_t, info.n_t)};
  const double speed = s.norm();
  if (info.n_t == 1) {
    friction.direction[0] = sign;
  } else if (speed > 0) {
    friction.direction /= speed;
    friction.turn = info.mu * lambda_n / speed *
                    (TangentMatrix::Identity(2, 2) - friction.direction * friction.direction.transpose());
  } else {
    friction.direction = start;
  }
  return friction;
}

/// The columns of the forces in (1) and (3).
void PointVariation::add_force_columns(const Numbering& numbering, const Jacobians& J, Rows& rows) const {
  for (const auto& [i, row] : numbering.contacts) {
    const auto& contact = problem_.info().contacts[i];
    rows.x.block(0, row, n_q_, 1) = -J.J_n.col(i);
    rows.x.block(0, row + 1, n_q_, contact.n_t) = -J.J_t.middleCols(contact.tangent_index, contact.n_t);
  }
  const int clock = problem_.info().clock;
  if (clock >= 0) rows.x.row(clock).tail(numbering.size - n_q_).setZero();
}

void PointVariation::set_motion(const Numbering& numbering, const PointOfMotion& at, const Jacobians& J,
                                Rows& rows) const {
  const ScratchPool::Frame frame(pool_);
  MatrixMap values = pool_.matrix(n_q_, n_q_), by_v = pool_.matrix(n_q_, n_q_);
  problem_.force_jacobians(at.q.data(), at.v.data(), problem_.info().u.data(), values.data(), by_v.data());
  rows.q.topRows(n_q_) = -values;
  rows.v.topRows(n_q_) = -by_v;
  if (!problem_.info().structure.constant_mass) {
    problem_.mass_derivative(at.q.data(), at.a.data(), values.data());
    rows.q.topRows(n_q_) += values;
  }
  const auto& contacts = problem_.info().contacts;
  const auto is_curved = [&](const auto& contact) { return !contacts[contact.contact].is_affine; };
  if (std::ranges::any_of(numbering.contacts, is_curved)) {
    problem_.contact_force_derivative(at.q.data(), at.lambda_n.data(), at.lambda_t.data(), values.data());
    rows.q.topRows(n_q_) -= values;
  }
  problem_.mass_matrix(at.q.data(), values.data());
  rows.x.topLeftCorner(n_q_, n_q_) = values;
  add_force_columns(numbering, J, rows);
}

void PointVariation::add_friction(int contact, const Friction& friction, const Jacobians& J, double lambda_n, In direct,
                                  Eigen::Index column, Eigen::Index row, Rows& rows) const {
  const auto& info = problem_.info().contacts[contact];
  const auto s_q = J.T.middleRows(info.tangent_index, info.n_t);
  const auto s_v = J.J_t.middleCols(info.tangent_index, info.n_t).transpose();
  auto by_q = rows.q.middleRows(row, info.n_t), by_v = rows.v.middleRows(row, info.n_t),
       by_theta = rows.theta.middleRows(row, info.n_t);
  const bool varies = varied_.varies_parameters();
  const Eigen::Index slip = varied_.slip_row(contact);
  if (friction.sticks) {
    by_q = s_q;
    by_v = s_v;
    if (varies) by_theta = direct.middleRows(slip, info.n_t);
    return;
  }
  by_q.noalias() = friction.turn.lazyProduct(s_q);
  by_v.noalias() = friction.turn.lazyProduct(s_v);
  if (varies) {
    by_theta.noalias() = friction.turn.lazyProduct(direct.middleRows(slip, info.n_t));
    for (int d = 0; d < info.n_t; ++d)
      by_theta.row(d) += lambda_n * friction.direction[d] * varied_.dmu().row(contact).leftCols(by_theta.cols());
  }
  if (friction.turned.size() > 0) by_theta += info.mu * lambda_n * friction.turned;
  rows.x.block(row, column, info.n_t, 1) = info.mu * friction.direction;
  rows.x.block(row, column + 1, info.n_t, info.n_t).setIdentity();
}

void PointVariation::add_forces(const Numbering& numbering, In unknowns, double weight, Out forces) const {
  for (const auto& [i, row] : numbering.contacts) {
    const auto& contact = problem_.info().contacts[i];
    forces.row(i) += weight * unknowns.row(row);
    forces.middleRows(n_c_ + contact.tangent_index, contact.n_t) += weight * unknowns.middleRows(row + 1, contact.n_t);
  }
}

void PointVariation::cone_margin(int contact, double lambda_n, VectorIn lambda_t, In forces,
                                 Eigen::Ref<Eigen::RowVectorXd> margin) const {
  const auto& info = problem_.info().contacts[contact];
  margin = info.mu * forces.row(contact) + lambda_n * varied_.dmu().row(contact).leftCols(forces.cols());
  const double force = lambda_t.norm();
  for (int d = 0; force > 0 && d < info.n_t; ++d)
    margin -= lambda_t[d] / force * forces.row(n_c_ + info.tangent_index + d);
}

void PointVariation::through_impulse(const Numbering& acts, const Impulse& impulse, bool restitutes,
                                     const std::vector<Friction>& laws, In dq, Out dv) const {
  const ScratchPool::Frame frame(pool_);
  const auto& [q, v_minus, v, Lambda_n, Lambda_t] = impulse;
  const Eigen::Index columns = dq.cols();
  VectorMap jump = pool_.vector(n_q_), turned = pool_.vector(n_q_), curvature = pool_.vector(n_q_);
  jump = v - v_minus;
  MatrixMap before = pool_.matrix(varied_.n_rows(), columns), without = pool_.matrix(varied_.n_rows(), columns),
            after = pool_.zeros(varied_.n_rows(), columns), M = pool_.matrix(n_q_, n_q_),
            by_q = pool_.matrix(n_q_, n_q_);
  direct_of_velocities(q, v_minus, before);
  direct_of_velocities(q, v, without);
  if (varied_.varies_parameters()) varied_.rows({q, v, jump, Lambda_n, Lambda_t}, pool_, after);  // no control in (1)
  problem_.mass_matrix(q.data(), M.data());
  const Jacobians J = jacobians(q, v);
  Rows rows(pool_, acts.size, n_q_, columns);
  problem_.mass_derivative(q.data(), jump.data(), by_q.data());
  rows.q.topRows(n_q_) = by_q;  // (1)
  problem_.contact_force_derivative(q.data(), Lambda_n.data(), Lambda_t.data(), by_q.data());
  rows.q.topRows(n_q_) -= by_q;
  rows.v.topRows(n_q_) = M;
  rows.theta.topRows(n_q_) = (after - without).topRows(n_q_);
  rows.theta.topRows(n_q_).noalias() -= M.lazyProduct(dv);
  add_force_columns(acts, J, rows);
  for (std::size_t k = 0; k < acts.contacts.size(); ++k) {
    const auto& [i, row] = acts.contacts[k];
    const auto& info = problem_.info().contacts[i];
    const double rate = J.J_n.col(i).dot(v_minus), e = restitutes ? info.restitution_slope(rate) : 0;
    turned = v + e * v_minus;
    varied_.gap_curvature(i, q, turned, pool_, curvature);
    rows.q.row(row) = curvature.transpose();  // (2)
    rows.v.row(row) = J.J_n.col(i).transpose();
    auto by_theta = rows.theta.row(row);
    by_theta = after.row(varied_.rate_row(i)) + e * before.row(varied_.rate_row(i));
    by_theta.noalias() += e * J.J_n.col(i).transpose().lazyProduct(dv);
    if (restitutes) {
      Eigen::Map<Eigen::RowVectorXd> of_restitution(pool_.vector(columns).data(), columns);
      of_restitution.setZero();
      varied_.add_deps_r(i, rate, rate, of_restitution);
      by_theta += of_restitution;
    }
    if (info.n_t > 0) add_friction(i, laws[k], J, Lambda_n[i], after, row, row + 1, rows);  // (5)
  }
  rows.x.leftCols(n_q_) += rows.v;  // v+ is an unknown here
  rows.theta.noalias() += rows.q.lazyProduct(dq);
  lu_.factorize(rows.x);
  lu_.solve_in_place(rows.theta);
  dv = -rows.theta.topRows(n_q_);
}

void PointVariation::through_impact(const Impulse& impulse, In dq, Out dv) const {
  const ScratchPool::Frame frame(pool_);
  const auto& [q, v_minus, v, Lambda_n, Lambda_t] = impulse;
  const auto& contacts = problem_.info().contacts;
  acts_.set(problem_.info(), [&, &Lambda = Lambda_n](int i) { return Lambda[i] > 0 || contacts[i].is_bilateral; });
  const Jacobians J = jacobians(q);
  laws_.clear();
  for (const auto& [i, row] : acts_.contacts) {
    laws_.emplace_back();
    const auto& contact = contacts[i];
    if (contact.n_t == 0) continue;
    const Tangent s = slip_velocity(i, J, v);
    Tangent size(contact.n_t);
    for (int d = 0; d < contact.n_t; ++d)
      size[d] = J.J_t.col(contact.tangent_index + d).cwiseAbs().dot(v.cwiseAbs() + v_minus.cwiseAbs());
    laws_.back() = slip(i, s, Lambda_n[i], s[0] > 0 ? 1 : -1, s);
    laws_.back().sticks = s.norm() <= kNoSlip * size.norm();
  }
  through_impulse(acts_, impulse, true, laws_, dq, dv);
}

/// bias += d[ v' (grad^2 f_c) v ], then d[ T v ]: (n_c + n_t) x columns.
void PointVariation::add_bias_derivative(const PointOfMotion& at, double h, In dq, In dv, Out bias) const {
  const ScratchPool::Frame frame(pool_);
  const ProblemInfo& info = problem_.info();
  const int n = info.n_mechanical();
  const double speed = max_abs(at.v.head(n)), q_size = max_abs(at.q.head(n)) + h * speed,
               v_size = speed + h * max_abs(at.a);
  // A motion at rest at q = 0 has no size of its own: one unit is taken.
  const auto relative = [](double x, double of) { return of > 0 ? x / of : x; };
  const auto step_along = [&](VectorIn q, VectorIn v) {
    const double dt = info.clock < 0 ? 0 : std::abs(q[info.clock]) / h;
    const double size = std::max({relative(max_abs(q.head(n)), q_size), relative(max_abs(v), v_size), dt});
    return size > 0 ? kFourthOrderStep / size : kFourthOrderStep;
  };
  VectorMap q = pool_.vector(n_q_), v = pool_.vector(n_q_), of_gaps = pool_.vector(n_c_);
  MatrixMap T = pool_.matrix(n_t_, n_q_);
  for (Eigen::Index k = 0; k < dq.cols(); ++k) {
    const double step = step_along(dq.col(k), dv.col(k));
    for (const auto& [place, weight] : kFourthOrder) {
      q = at.q + place * step * dq.col(k);
      v = at.v + place * step * dv.col(k);
      problem_.gap_acceleration_bias(q.data(), v.data(), of_gaps.data());
      bias.col(k).head(n_c_) += weight / (12 * step) * of_gaps;
      if (n_t_ == 0) continue;
      problem_.slip_velocity_derivative(q.data(), v.data(), T.data());
      bias.col(k).tail(n_t_).noalias() += weight / (12 * step) * T.lazyProduct(v);
    }
  }
  if (!varied_.varies_parameters()) return;
  // The bias is the rate of J' v at fixed v.
  MatrixMap direct = pool_.matrix(varied_.n_rows(), bias.cols());
  VectorMap at_rest = pool_.vector(n_q_);
  at_rest.setZero();
  const double step = step_along(at.v, at_rest);
  for (const auto& [place, weight] : kFourthOrder) {
    q = at.q + place * step * at.v;
    varied_.rows({q, at.v, at.a, at.lambda_n, at.lambda_t}, pool_, direct);
    bias += weight / (12 * step) * direct.middleRows(n_q_ + n_c_, n_c_ + n_t_);
  }
}

void PointVariation::accelerations(const Numbering& closed, const PointOfMotion& at, In direct,
                                   const std::vector<Friction>& laws, double h, In dq, In dv, Out change) const {
  const ScratchPool::Frame frame(pool_);
  const auto& contacts = problem_.info().contacts;
  const Eigen::Index columns = dq.cols();
  Rows rows(pool_, closed.size, n_q_, columns);
  const Jacobians J = jacobians(at.q, at.v);
  set_motion(closed, at, J, rows);
  rows.theta.topRows(n_q_) = direct.topRows(n_q_).leftCols(columns);
  const bool has_curved =
      std::ranges::any_of(closed.contacts, [&](const auto& contact) { return !contacts[contact.contact].is_affine; });
  MatrixMap bias = pool_.zeros(n_c_ + n_t_, columns), of_a = pool_.zeros(varied_.n_rows(), columns),
            T = pool_.matrix(n_t_, n_q_);
  VectorMap curvature = pool_.vector(n_q_);
  if (!closed.contacts.empty()) {
    if (has_curved) add_bias_derivative(at, h, dq, dv, bias);
    if (varied_.varies_parameters()) varied_.rows({at.q, at.a, at.a, at.lambda_n, at.lambda_t}, pool_, of_a);
    if (n_t_ > 0) problem_.slip_velocity_derivative(at.q.data(), at.a.data(), T.data());
  }
  for (std::size_t k = 0; k < closed.contacts.size(); ++k) {
    const auto& [i, row] = closed.contacts[k];
    const auto& contact = contacts[i];
    const int t = contact.tangent_index, n_t = contact.n_t;
    rows.x.block(row, 0, 1, n_q_) = J.J_n.col(i).transpose();  // (4)
    varied_.gap_curvature(i, at.q, at.a, pool_, curvature);
    rows.q.row(row) = curvature.transpose();
    rows.theta.row(row) = of_a.row(varied_.rate_row(i)) + bias.row(i);
    if (n_t > 0 && laws[k].sticks) {  // (5a)
      rows.x.block(row + 1, 0, n_t, n_q_) = J.J_t.middleCols(t, n_t).transpose();
      rows.q.middleRows(row + 1, n_t) = T.middleRows(t, n_t);
      rows.theta.middleRows(row + 1, n_t) = of_a.middleRows(varied_.slip_row(i), n_t) + bias.middleRows(n_c_ + t, n_t);
    } else if (n_t > 0) {
      add_friction(i, laws[k], J, at.lambda_n[i], direct, row, row + 1, rows);
    }
  }
  rows.theta.noalias() += rows.q.lazyProduct(dq);
  rows.theta.noalias() += rows.v.lazyProduct(dv);
  lu_.factorize(rows.x);
  lu_.solve_in_place(rows.theta);
  change = -rows.theta;
}

}  // namespace ricochet
