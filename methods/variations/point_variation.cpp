#include "methods/variations/point_variation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

/// A slip velocity after an impulse that counts as none, as part of the velocities that cancel in it.
constexpr double kNoSlip = 1e-12;
/// A difference of fourth order takes steps of this part of the state: its error and rounding are both of 1e-12.
constexpr double kFourthOrderStep = 1e-3;

double max_abs(const Eigen::Ref<const Vector>& x) {
  return x.lpNorm<Eigen::Infinity>();
}

/// f'(0) to fourth order.
Matrix derivative(const auto& f, double step) {
  return (8 * (f(step) - f(-step)) - (f(2 * step) - f(-2 * step))) / (12 * step);
}

}  // namespace

PointVariation::PointVariation(const VariedProblem& varied)
    : varied_(varied),
      problem_(varied.problem()),
      n_q_(varied.info().n_q),
      n_c_(varied.info().n_c()),
      n_t_(varied.info().n_lambda_t) {}

void PointVariation::Rows::reset(Eigen::Index n, Eigen::Index n_q, Eigen::Index n_columns) {
  q.setZero(n, n_q);
  v.setZero(n, n_q);
  x.setZero(n, n);
  theta.setZero(n, n_columns);
}

Vector PointVariation::slip_velocity(int contact, const Vector& q, const Vector& v) const {
  const auto& info = problem_.info().contacts[contact];
  return problem_.tangent_jacobian(q).middleCols(info.tangent_index, info.n_t).transpose() * v;
}

/// VariedProblem::rows() without forces and accelerations.
Matrix PointVariation::direct_of_velocities(const Vector& q, const Vector& v) const {
  return varied_.rows(q, v, Vector::Zero(n_q_), Vector::Zero(n_c_), Vector::Zero(n_t_));
}

Matrix PointVariation::gaps(const Vector& q, const Matrix& dq) const {
  return problem_.normal_jacobian(q).transpose() * dq +
         direct_of_velocities(q, Vector::Zero(n_q_)).block(n_q_, 0, n_c_, dq.cols());
}

Matrix PointVariation::slip_velocities(const Vector& q, const Vector& v, const Matrix& dq, const Matrix& dv) const {
  Matrix T(n_t_, n_q_);
  problem_.slip_velocity_derivative(q.data(), v.data(), T.data());
  return T * dq + problem_.tangent_jacobian(q).transpose() * dv +
         direct_of_velocities(q, v).block(n_q_ + 2 * n_c_, 0, n_t_, dq.cols());
}

void PointVariation::project(const std::vector<ContactMode>& modes, const Vector& q, const Vector& v, Matrix& dq,
                             Matrix& dv) const {
  const auto& contacts = problem_.info().contacts;
  std::vector<std::pair<int, int>> held;  // contact, and component of s or -1 for its gap
  for (int i = 0; i < n_c_; ++i) {
    const ContactMode mode = modes[static_cast<std::size_t>(i)];
    if (is_closed(mode)) held.emplace_back(i, -1);
    for (int d = 0; mode == ContactMode::stick && d < contacts[i].n_t; ++d)
      held.emplace_back(i, contacts[i].tangent_index + d);
  }
  if (held.empty()) return;
  const auto n = static_cast<Eigen::Index>(held.size());
  const Matrix J_n = problem_.normal_jacobian(q), J_t = problem_.tangent_jacobian(q), gap = gaps(q, dq);
  Matrix R(n_q_, n), residual = Matrix::Zero(n, dq.cols());
  for (Eigen::Index r = 0; r < n; ++r) {
    const auto [i, t] = held[static_cast<std::size_t>(r)];
    R.col(r) = t < 0 ? J_n.col(i) : J_t.col(t);
    if (t < 0) residual.row(r) = gap.row(i);
  }
  const Matrix MR = CholeskyFactors(problem_.mass_matrix(q)).solve_columns(problem_.force_directions(R)),
               correction = MR * pseudo_inverse(R.transpose() * MR);
  dq -= correction * residual;
  const Matrix direct = direct_of_velocities(q, v), ds = slip_velocities(q, v, dq, dv);
  for (Eigen::Index r = 0; r < n; ++r) {
    const auto [i, t] = held[static_cast<std::size_t>(r)];
    residual.row(r) = t < 0 ? Eigen::RowVectorXd(varied_.gap_curvature(i, q, v) * dq + J_n.col(i).transpose() * dv +
                                                 direct.row(varied_.rate_row(i)).leftCols(dq.cols()))
                            : Eigen::RowVectorXd(ds.row(t));
  }
  dv -= correction * residual;
}

PointVariation::Friction PointVariation::slip(int contact, const Vector& s, double lambda_n, int sign,
                                              const Vector& start) const {
  const auto& info = problem_.info().contacts[contact];
  Friction friction{.direction = s, .turn = Matrix::Zero(info.n_t, info.n_t)};
  const double speed = s.norm();
  if (info.n_t == 1) {
    friction.direction[0] = sign;
  } else if (speed > 0) {
    friction.direction /= speed;
    friction.turn =
        info.mu * lambda_n / speed * (Matrix::Identity(2, 2) - friction.direction * friction.direction.transpose());
  } else {
    friction.direction = start;
  }
  return friction;
}

/// The columns of the forces in (1) and (3).
void PointVariation::add_force_columns(const Numbering& numbering, const Vector& q, Rows& rows) const {
  if (numbering.contacts.empty()) return;
  const Matrix D_n = problem_.force_directions(problem_.normal_jacobian(q)),
               D_t = problem_.force_directions(problem_.tangent_jacobian(q));
  for (const auto& [i, row] : numbering.contacts) {
    const auto& contact = problem_.info().contacts[i];
    rows.x.block(0, row, n_q_, 1) = -D_n.col(i);
    rows.x.block(0, row + 1, n_q_, contact.n_t) = -D_t.middleCols(contact.tangent_index, contact.n_t);
  }
}

void PointVariation::set_motion(const Numbering& numbering, const Motion& at, const Matrix& direct, Rows& rows) const {
  Matrix M_q(n_q_, n_q_), f_q(n_q_, n_q_), f_v(n_q_, n_q_);
  problem_.mass_derivative(at.q.data(), at.a.data(), M_q.data());
  problem_.force_jacobians(at.q.data(), at.v.data(), problem_.info().u.data(), f_q.data(), f_v.data());
  rows.reset(numbering.size, n_q_, direct.cols());
  rows.q.topRows(n_q_) = M_q - f_q;
  if (!numbering.contacts.empty()) {
    Matrix J_q(n_q_, n_q_);
    problem_.contact_force_derivative(at.q.data(), at.lambda_n.data(), at.lambda_t.data(), J_q.data());
    rows.q.topRows(n_q_) -= J_q;
  }
  rows.v.topRows(n_q_) = -f_v;
  rows.x.topLeftCorner(n_q_, n_q_) = problem_.mass_matrix(at.q);
  rows.theta.topRows(n_q_) = direct.topRows(n_q_);
  add_force_columns(numbering, at.q, rows);
}

void PointVariation::add_friction(int contact, const Friction& friction, const Vector& q, const Vector& v,
                                  double lambda_n, const Matrix& direct, Eigen::Index column, Eigen::Index row,
                                  Rows& rows) const {
  const auto& info = problem_.info().contacts[contact];
  Matrix T(n_t_, n_q_);
  problem_.slip_velocity_derivative(q.data(), v.data(), T.data());
  const Matrix s_q = T.middleRows(info.tangent_index, info.n_t),
               s_v = problem_.tangent_jacobian(q).middleCols(info.tangent_index, info.n_t).transpose(),
               s_theta = direct.middleRows(varied_.slip_row(contact), info.n_t);
  if (friction.sticks) {
    rows.q.middleRows(row, info.n_t) = s_q;
    rows.v.middleRows(row, info.n_t) = s_v;
    rows.theta.middleRows(row, info.n_t) = s_theta;
    return;
  }
  rows.q.middleRows(row, info.n_t) = friction.turn * s_q;
  rows.v.middleRows(row, info.n_t) = friction.turn * s_v;
  rows.theta.middleRows(row, info.n_t) =
      friction.turn * s_theta + lambda_n * friction.direction * varied_.dmu().row(contact).leftCols(direct.cols());
  if (friction.turned.size() > 0) rows.theta.middleRows(row, info.n_t) += info.mu * lambda_n * friction.turned;
  rows.x.block(row, column, info.n_t, 1) = info.mu * friction.direction;
  rows.x.block(row, column + 1, info.n_t, info.n_t).setIdentity();
}

void PointVariation::add_forces(const Numbering& numbering, const Eigen::Ref<const Matrix>& unknowns, double weight,
                                Eigen::Ref<Matrix> forces) const {
  for (const auto& [i, row] : numbering.contacts) {
    const auto& contact = problem_.info().contacts[i];
    forces.row(i) += weight * unknowns.row(row);
    forces.middleRows(n_c_ + contact.tangent_index, contact.n_t) += weight * unknowns.middleRows(row + 1, contact.n_t);
  }
}

Eigen::RowVectorXd PointVariation::cone_margin(int contact, double lambda_n, const Vector& lambda_t,
                                               const Matrix& forces) const {
  const auto& info = problem_.info().contacts[contact];
  Eigen::RowVectorXd margin = info.mu * forces.row(contact) + lambda_n * varied_.dmu().row(contact);
  if (const double force = lambda_t.norm(); force > 0)
    margin -= lambda_t.transpose() / force * forces.middleRows(n_c_ + info.tangent_index, info.n_t);
  return margin;
}

void PointVariation::through_impulse(const Numbering& acts, const Impulse& impulse, bool restitutes,
                                     const std::vector<Friction>& laws, const Matrix& dq, Matrix& dv) const {
  const auto& [q, v_minus, v, Lambda_n, Lambda_t] = impulse;
  const Vector jump = v - v_minus;
  const Eigen::Index columns = dq.cols();
  const Matrix before = direct_of_velocities(q, v_minus).leftCols(columns),
               without = direct_of_velocities(q, v).leftCols(columns),
               after = varied_.rows(q, v, jump, Lambda_n, Lambda_t).leftCols(columns);
  const Matrix M = problem_.mass_matrix(q), J_n = problem_.normal_jacobian(q);
  Rows rows;
  rows.reset(acts.size, n_q_, columns);
  Matrix M_q(n_q_, n_q_), J_q(n_q_, n_q_);
  problem_.mass_derivative(q.data(), jump.data(), M_q.data());
  problem_.contact_force_derivative(q.data(), Lambda_n.data(), Lambda_t.data(), J_q.data());
  rows.q.topRows(n_q_) = M_q - J_q;  // (1)
  rows.v.topRows(n_q_) = M;
  rows.theta.topRows(n_q_) = (after - without).topRows(n_q_) - M * dv;
  add_force_columns(acts, q, rows);
  for (std::size_t k = 0; k < acts.contacts.size(); ++k) {
    const auto& [i, row] = acts.contacts[k];
    const auto& info = problem_.info().contacts[i];
    const double rate = J_n.col(i).dot(v_minus), e = restitutes ? info.restitution_slope(rate) : 0;
    rows.q.row(row) = varied_.gap_curvature(i, q, v + e * v_minus);  // (2)
    rows.v.row(row) = J_n.col(i).transpose();
    rows.theta.row(row) =
        after.row(varied_.rate_row(i)) + e * before.row(varied_.rate_row(i)) + e * J_n.col(i).transpose() * dv;
    if (restitutes) rows.theta.row(row) += varied_.deps_r(i, rate).leftCols(columns) * rate;
    if (info.n_t > 0) add_friction(i, laws[k], q, v, Lambda_n[i], after, row, row + 1, rows);  // (5)
  }
  rows.x.leftCols(n_q_) += rows.v;  // v+ is an unknown here
  dv = -solve_full_pivoting(rows.x, rows.q * dq + rows.theta).topRows(n_q_);
}

void PointVariation::through_impact(const Impulse& impulse, const Matrix& dq, Matrix& dv) const {
  const auto& [q, v_minus, v, Lambda_n, Lambda_t] = impulse;
  const auto& contacts = problem_.info().contacts;
  const Numbering acts(problem_.info(), [&, &Lambda = Lambda_n](int i) {
    return Lambda[i] > 0 || problem_.info().contacts[i].is_bilateral;
  });
  const Matrix J_t = problem_.tangent_jacobian(q);
  std::vector<Friction> laws;
  for (const auto& [i, row] : acts.contacts) {
    laws.emplace_back();
    if (contacts[i].n_t == 0) continue;
    const Vector s = slip_velocity(i, q, v);
    const Vector size = J_t.middleCols(contacts[i].tangent_index, contacts[i].n_t).cwiseAbs().transpose() *
                        (v.cwiseAbs() + v_minus.cwiseAbs());
    laws.back() = slip(i, s, Lambda_n[i], s[0] > 0 ? 1 : -1, s);
    laws.back().sticks = s.norm() <= kNoSlip * size.norm();
  }
  through_impulse(acts, impulse, true, laws, dq, dv);
}

/// d[ v' (grad^2 f_c) v ], then d[ T v ]: (n_c + n_t) x columns.
Matrix PointVariation::bias_derivative(const Motion& at, double h, const Matrix& dq, const Matrix& dv) const {
  const ProblemInfo& info = problem_.info();
  const int n = info.n_mechanical();
  const double speed = max_abs(at.v.head(n)), q_size = max_abs(at.q.head(n)) + h * speed,
               v_size = speed + h * max_abs(at.a);
  // A motion at rest at q = 0 has no size of its own: one unit is taken.
  const auto relative = [](double x, double of) { return of > 0 ? x / of : x; };
  const auto step_along = [&](const Vector& q, const Vector& v) {
    const double dt = info.clock < 0 ? 0 : std::abs(q[info.clock]) / h;
    const double size = std::max({relative(max_abs(q.head(n)), q_size), relative(max_abs(v), v_size), dt});
    return size > 0 ? kFourthOrderStep / size : kFourthOrderStep;
  };
  Matrix bias(n_c_ + n_t_, dq.cols());
  for (Eigen::Index k = 0; k < dq.cols(); ++k) {
    const auto beside = [&](double x) -> Matrix {
      const Vector q = at.q + x * dq.col(k), v = at.v + x * dv.col(k);
      Vector b(n_c_ + n_t_);
      b << problem_.gap_acceleration_bias(q, v), problem_.slip_acceleration_bias(q, v);
      return b;
    };
    bias.col(k) = derivative(beside, step_along(dq.col(k), dv.col(k)));
  }
  // The bias is the rate of J' v at fixed v.
  const auto along_motion = [&](double x) -> Matrix {
    return varied_.rows(at.q + x * at.v, at.v, at.a, at.lambda_n, at.lambda_t)
        .block(n_q_ + n_c_, 0, n_c_ + n_t_, dq.cols());
  };
  return bias + derivative(along_motion, step_along(at.v, Vector::Zero(n_q_)));
}

Matrix PointVariation::accelerations(const Numbering& closed, const Motion& at, const Matrix& direct,
                                     const std::vector<Friction>& laws, double h, const Matrix& dq,
                                     const Matrix& dv) const {
  const auto& contacts = problem_.info().contacts;
  Rows rows;
  set_motion(closed, at, direct, rows);
  const bool has_curved =
      std::ranges::any_of(closed.contacts, [&](const auto& contact) { return !contacts[contact.contact].is_affine; });
  Matrix bias, of_a, J_n, J_t, T;
  if (!closed.contacts.empty()) {
    bias = has_curved ? bias_derivative(at, h, dq, dv) : Matrix::Zero(n_c_ + n_t_, dq.cols());
    of_a = varied_.rows(at.q, at.a, at.a, at.lambda_n, at.lambda_t).leftCols(dq.cols());
    J_n = problem_.normal_jacobian(at.q);
    J_t = problem_.tangent_jacobian(at.q);
    T.setZero(n_t_, n_q_);
    problem_.slip_velocity_derivative(at.q.data(), at.a.data(), T.data());
  }
  for (std::size_t k = 0; k < closed.contacts.size(); ++k) {
    const auto& [i, row] = closed.contacts[k];
    const auto& contact = contacts[i];
    const int t = contact.tangent_index, n_t = contact.n_t;
    rows.x.block(row, 0, 1, n_q_) = J_n.col(i).transpose();  // (4)
    rows.q.row(row) = varied_.gap_curvature(i, at.q, at.a);
    rows.theta.row(row) = of_a.row(varied_.rate_row(i)) + bias.row(i);
    if (n_t > 0 && laws[k].sticks) {  // (5a)
      rows.x.block(row + 1, 0, n_t, n_q_) = J_t.middleCols(t, n_t).transpose();
      rows.q.middleRows(row + 1, n_t) = T.middleRows(t, n_t);
      rows.theta.middleRows(row + 1, n_t) = of_a.middleRows(varied_.slip_row(i), n_t) + bias.middleRows(n_c_ + t, n_t);
    } else if (n_t > 0) {
      add_friction(i, laws[k], at.q, at.v, at.lambda_n[i], direct, row, row + 1, rows);
    }
  }
  return -solve_full_pivoting(rows.x, rows.q * dq + rows.v * dv + rows.theta);
}

}  // namespace ricochet
