#include "methods/fesd/sensitivity.h"

#include <stdexcept>

#include "problems/dense_solve.h"
#include "problems/input_error.h"
#include "problems/variables.h"

namespace ricochet {
namespace {

/// A slip velocity behind an impulse that counts as none, as part of the velocities that cancel in it.
constexpr double kNoSlip = 1e-12;
/// A difference of fourth order takes steps of this part of the state: its error and rounding are both of 1e-12.
constexpr double kFourthOrderStep = 1e-3;
/// Rounding of a derivative of the initial state is a few hundred roundings of its formulas.
constexpr double kConsistency = 1e-13;

double max_abs(const Vector& x) {
  return x.lpNorm<Eigen::Infinity>();
}

}  // namespace

void Sensitivity::Rows::reset(Eigen::Index n, Eigen::Index n_q, Eigen::Index n_columns) {
  q.setZero(n, n_q);
  v.setZero(n, n_q);
  x.setZero(n, n);
  theta.setZero(n, n_columns);
}

/// The unknowns at a point: those of the motion, then the force of each contact that acts, the normal one first.
Sensitivity::Numbering::Numbering(const ProblemInfo& info, const std::function<bool(int)>& acts) : size(info.n_q) {
  for (int i = 0; i < info.n_c(); ++i) {
    if (!acts(i)) continue;
    contacts.push_back({i, size});
    size += 1 + info.contacts[i].n_t;
  }
}

Sensitivity::Numbering Sensitivity::closed_contacts(const Element& e) const {
  return {problem_.info(), [&](int i) { return is_closed(e.modes[i]); }};
}

/// The columns of the forces in (1) and (3).
void Sensitivity::add_force_columns(const Numbering& numbering, const Vector& q, Rows& rows) const {
  const Matrix D_n = problem_.force_directions(problem_.normal_jacobian(q)),
               D_t = problem_.force_directions(problem_.tangent_jacobian(q));
  for (const auto& [i, row] : numbering.contacts) {
    const auto& contact = problem_.info().contacts[i];
    rows.x.block(0, row, n_q_, 1) = -D_n.col(i);
    rows.x.block(0, row + 1, n_q_, contact.n_t) = -D_t.middleCols(contact.tangent_index, contact.n_t);
  }
}

/// (3), with the accelerations as the first unknowns.
void Sensitivity::set_motion(const Numbering& numbering, const Vector& q, const Vector& v, const Vector& a,
                             const Vector& lambda_n, const Vector& lambda_t, const Matrix& parameters,
                             Rows& rows) const {
  Matrix M_q(n_q_, n_q_), f_q(n_q_, n_q_), f_v(n_q_, n_q_), J_q(n_q_, n_q_);
  problem_.mass_derivative(q.data(), a.data(), M_q.data());
  problem_.force_jacobians(q.data(), v.data(), problem_.info().u.data(), f_q.data(), f_v.data());
  problem_.contact_force_derivative(q.data(), lambda_n.data(), lambda_t.data(), J_q.data());
  rows.reset(numbering.size, n_q_, n_theta_ + 1);
  rows.q.topRows(n_q_) = M_q - f_q - J_q;
  rows.v.topRows(n_q_) = -f_v;
  rows.x.topLeftCorner(n_q_, n_q_) = problem_.mass_matrix(q);
  rows.theta.topRows(n_q_) = parameters.topRows(n_q_);
  add_force_columns(numbering, q, rows);
}

/// forces += weight times the forces among the unknowns. @param forces  n_c, then n_t, rows
void Sensitivity::add_forces(const Numbering& numbering, const Eigen::Ref<const Matrix>& unknowns, double weight,
                             Matrix& forces) const {
  for (const auto& [i, row] : numbering.contacts) {
    const auto& contact = problem_.info().contacts[i];
    forces.row(i) += weight * unknowns.row(row);
    forces.middleRows(n_c_ + contact.tangent_index, contact.n_t) += weight * unknowns.middleRows(row + 1, contact.n_t);
  }
}

Sensitivity::Sensitivity(const Problem& problem, const ButcherTableau& tableau, const std::vector<std::string>& names)
    : problem_(problem),
      tableau_(tableau),
      n_q_(problem.n_q()),
      n_c_(problem.n_c()),
      n_t_(problem.info().n_lambda_t),
      n_s_(tableau.n_s),
      n_theta_(static_cast<Eigen::Index>(names.size())) {
  const ProblemInfo& info = problem.info();
  const auto n_parameters = static_cast<Eigen::Index>(info.parameters.size());
  parameters_ = Matrix::Zero(n_parameters, n_theta_ + 1);
  Matrix initial = Matrix::Zero(2 * n_q_, n_theta_);
  for (Eigen::Index column = 0; column < n_theta_; ++column) {
    const auto k = find_variable(info, names[static_cast<std::size_t>(column)]), n = Eigen::Index{info.n_mechanical()};
    (k < n ? initial(k, column) : k < 2 * n ? initial(n_q_ + k - n, column) : parameters_(k - 2 * n, column)) = 1;
  }
  Matrix constants(2 * n_q_ + 2 * n_c_ + 1, n_parameters);
  problem.parameter_derivative_of_constants(constants.data());
  const Matrix varied = constants * parameters_;
  initial += varied.topLeftCorner(2 * n_q_, n_theta_);
  reached_.q = initial.topRows(n_q_);
  reached_.v = initial.bottomRows(n_q_);
  deps_ = varied.middleRows(2 * n_q_, n_c_);
  dmu_ = varied.middleRows(2 * n_q_ + n_c_, n_c_);
  dt_final_ = varied.bottomLeftCorner(1, n_theta_).transpose();
  reached_.t = Vector::Zero(n_theta_);
  if (info.has_bilateral()) require_consistent_start(names);
}

/// f_c = 0 and J_n' v = 0 at t = 0, varied
void Sensitivity::require_consistent_start(const std::vector<std::string>& names) const {
  const ProblemInfo& info = problem_.info();
  const Matrix J_n = problem_.normal_jacobian(info.q0),
               parameters =
                   parameter_rows(info.q0, info.v0, Vector::Zero(n_q_), Vector::Zero(n_c_), Vector::Zero(n_t_));
  for (const int i : info.bilateral) {
    const Eigen::RowVectorXd J = J_n.col(i).transpose(), curvature = gap_curvature(i, info.q0, info.v0);
    for (Eigen::Index k = 0; k < n_theta_; ++k) {
      const double of_gap = parameters(n_q_ + i, k), of_rate = parameters(n_q_ + n_c_ + i, k);
      const auto is_zero = [](const Eigen::RowVectorXd& slope, const Vector& change, double direct) {
        return std::abs(slope.dot(change) + direct) <=
               kConsistency * (slope.cwiseAbs().dot(change.cwiseAbs()) + std::abs(direct));
      };
      Eigen::RowVectorXd both(2 * n_q_);
      Vector change(2 * n_q_);
      both << curvature, J;
      change << reached_.q.col(k), reached_.v.col(k);
      if (!is_zero(J, reached_.q.col(k), of_gap) || !is_zero(both, change, of_rate))
        throw InputError(
            "sensitivity", names[static_cast<std::size_t>(k)],
            fmt::format("it violates the bilateral constraint '{}' at t = 0; the initial state has to vary "
                        "within it, as with parameters that q0 and v0 follow",
                        info.contacts[i].name));
    }
  }
}

void Sensitivity::add(const FesdStep& step, const Vector& dt_end) {
  const int N = step.n_elements;
  before_ = reached_;
  dt_elements_.resize(static_cast<std::size_t>(N));
  if (step.touches && !reached_.modes.empty() && !reached_.is_at_switch) through_switch_at_start(step);
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
      through_start(step, k, state);
      element = through_element(step.elements[k], k + 1 < first + count ? none : end, state);
    }
    Vector dh;
    if (end.contact >= 0) {
      const Eigen::RowVectorXd slope = switch_slope(last, end, state, element.forces);
      dh = -slope.head(n_theta_).transpose() / slope[n_theta_];  // (7)
    } else {
      dh = (dt_end - reached_.t) / count;  // (8)
    }
    reached_.q = state.q.leftCols(n_theta_) + state.q.col(n_theta_) * dh.transpose();
    reached_.v = state.v.leftCols(n_theta_) + state.v.col(n_theta_) * dh.transpose();
    stage_accelerations_ = element.accelerations.leftCols(n_theta_);
    stage_accelerations_ += element.accelerations.col(n_theta_) * dh.transpose();
    for (int k = first; k < first + count; ++k) {
      dt_elements_[static_cast<std::size_t>(k)] = reached_.t;
      reached_.t += dh;
    }
    first += count;
  }
  const Element& last = step.last();
  reached_.is_at_switch = step.ends[N - 1].contact >= 0;
  reached_.modes = last.modes;
  const bool is_known = tableau_.right_end.size() > 0;
  reached_.lambda_n = is_known ? last.end_lambda_n : last.lambda_n.col(n_s_ - 1);
  reached_.lambda_t = is_known ? last.end_lambda_t : last.lambda_t.col(n_s_ - 1);
}

/// (9)
void Sensitivity::through_switch_at_start(const FesdStep& step) {
  const Element& e = step.elements[0];
  const Vector q = e.q0, v = step.v_minus.col(0), Lambda_n = step.Lambda_n.col(0);
  const bool has_impulse = !Lambda_n.isZero(0);
  int contact = -1;
  for (int i = 0; i < n_c_ && contact < 0; ++i) {
    const bool closes = !is_closed(reached_.modes[i]) && Lambda_n[i] > 0,
               stops = !has_impulse && is_slipping(reached_.modes[i]) && is_closed(e.modes[i]) &&
                       e.modes[i] != reached_.modes[i];
    if (closes || stops) contact = i;
  }
  if (contact < 0) return;
  const Matrix J_n = problem_.normal_jacobian(q), J_t = problem_.tangent_jacobian(q);
  const Vector contact_force = problem_.force_directions(J_n * reached_.lambda_n + J_t * reached_.lambda_t),
               a = CholeskyFactors(problem_.mass_matrix(q)).solve(problem_.force(q, v) + contact_force);
  const Matrix parameters = parameter_rows(q, v, a, reached_.lambda_n, reached_.lambda_t).leftCols(n_theta_);
  Matrix slope;        // of the switch functions, by theta
  Vector slope_per_h;  // by the length of the element
  if (has_impulse) {
    slope = J_n.col(contact).transpose() * reached_.q + parameters.row(n_q_ + contact);
    slope_per_h = J_n.col(contact).transpose() * v;
  } else {
    const auto& info = problem_.info().contacts[contact];
    Matrix T(n_t_, n_q_);
    problem_.slip_velocity_derivative(q.data(), v.data(), T.data());
    const Matrix s_q = T.middleRows(info.tangent_index, info.n_t),
                 s_v = J_t.middleCols(info.tangent_index, info.n_t).transpose();
    slope = s_q * reached_.q + s_v * reached_.v + parameters.middleRows(n_q_ + 2 * n_c_ + info.tangent_index, info.n_t);
    slope_per_h = s_q * v + s_v * a;
  }
  const Vector dh = -slope.transpose() * slope_per_h / slope_per_h.squaredNorm();
  reached_.q += v * dh.transpose();
  reached_.v += a * dh.transpose();
  reached_.t += dh;
}

/// Derivatives with respect to theta alone: n_q rows of the dynamics, n_c of f_c, n_c of J_n' v, n_t of J_t' v.
Matrix Sensitivity::parameter_rows(const Vector& q, const Vector& v, const Vector& a, const Vector& lambda_n,
                                   const Vector& lambda_t) const {
  Matrix D(n_q_ + 2 * n_c_ + n_t_, parameters_.rows());
  problem_.parameter_derivative(q.data(), v.data(), a.data(), lambda_n.data(), lambda_t.data(), D.data());
  return D * parameters_;
}

Vector Sensitivity::slip_velocity(int contact, const Vector& q, const Vector& v) const {
  const auto& info = problem_.info().contacts[contact];
  return problem_.tangent_jacobian(q).middleCols(info.tangent_index, info.n_t).transpose() * v;
}

/// d(J_n^i(q)' v)/dq
Eigen::RowVectorXd Sensitivity::gap_curvature(int contact, const Vector& q, const Vector& v) const {
  const Vector weight = Vector::Unit(n_c_, contact);
  Matrix H(n_q_, n_q_);
  problem_.gap_hessian(q.data(), weight.data(), H.data());
  return v.transpose() * H;
}

/// @param sign  of slip in the plane, 0 in space; @param start  direction of slip in space while s is zero
Sensitivity::Friction Sensitivity::slip(int contact, const Vector& s, double lambda_n, int sign,
                                        const Vector& start) const {
  const auto& info = problem_.info().contacts[contact];
  Friction friction{.contact = contact, .direction = s, .turn = Matrix::Zero(info.n_t, info.n_t)};
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

/// (6), at a row of its own. @param column  of lambda_n among the unknowns; lambda_t follows
void Sensitivity::add_friction(const Friction& friction, const Vector& q, const Vector& v, double lambda_n,
                               const Matrix& parameters, Eigen::Index column, Eigen::Index row, Rows& rows) const {
  const auto& info = problem_.info().contacts[friction.contact];
  Matrix T(n_t_, n_q_);
  problem_.slip_velocity_derivative(q.data(), v.data(), T.data());
  const Matrix s_q = T.middleRows(info.tangent_index, info.n_t),
               s_v = problem_.tangent_jacobian(q).middleCols(info.tangent_index, info.n_t).transpose(),
               s_theta = parameters.middleRows(n_q_ + 2 * n_c_ + info.tangent_index, info.n_t);
  if (friction.sticks) {
    rows.q.middleRows(row, info.n_t) = s_q;
    rows.v.middleRows(row, info.n_t) = s_v;
    rows.theta.middleRows(row, info.n_t) = s_theta;
    return;
  }
  rows.q.middleRows(row, info.n_t) = friction.turn * s_q;
  rows.v.middleRows(row, info.n_t) = friction.turn * s_v;
  rows.theta.middleRows(row, info.n_t) =
      friction.turn * s_theta + lambda_n * friction.direction * dmu_.row(friction.contact);
  rows.x.block(row, column, info.n_t, 1) = info.mu * friction.direction;
  rows.x.block(row, column + 1, info.n_t, info.n_t).setIdentity();
}

void Sensitivity::through_start(const FesdStep& step, int element, State& state) const {
  if (!step.touches || step.Lambda_n.col(element).isZero(0)) return;
  const Element& e = step.elements[element];
  const Vector v_minus = step.v_minus.col(element), Lambda_n = step.Lambda_n.col(element),
               Lambda_t = step.Lambda_t.col(element);
  through_impulse({e.q0, v_minus, e.v0, Lambda_n, Lambda_t}, state);
}

/// (8) of switch_function.h holds at the right end, which is a stage.
bool Sensitivity::stops_in_space(const Element& e, const Switch& end) {
  return end.kind == Switch::Kind::slip_stops && end.contact >= 0 && e.modes[end.contact] == ContactMode::slip;
}

/// (6a) holds at the right end.
bool Sensitivity::sticks_at_end(const Element& e, const Switch& end, int contact) {
  return e.modes[contact] == ContactMode::stick || (end.contact == contact && stops_in_space(e, end));
}

/// Law of a contact that slips at the right end.
Sensitivity::Friction Sensitivity::slip_at_end(const Element& e, int contact, double lambda_n) const {
  const auto& info = problem_.info().contacts[contact];
  return slip(contact, slip_velocity(contact, e.q1, e.v1), lambda_n, slip_sign(e.modes[contact]),
              e.slip_start.segment(info.tangent_index, info.n_t));
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
  through_impulse({e.q1, v_minus, e.v1, Lambda_n, Lambda_t, &e, &end}, state);
}

/// (1), (2), (6)
void Sensitivity::through_impulse(const Impulse& impulse, State& state) const {
  const Vector &q = impulse.q, &v_minus = impulse.v_minus, &v = impulse.v_plus, &Lambda_n = impulse.Lambda_n,
               &Lambda_t = impulse.Lambda_t;
  const Vector jump = v - v_minus;
  const bool is_projection = impulse.projected != nullptr;
  const auto acts = [&](int i) {
    return is_projection ? is_closed(impulse.projected->modes[i])
                         : Lambda_n[i] > 0 || problem_.info().contacts[i].is_bilateral;
  };
  const Vector no_a = Vector::Zero(n_q_), no_Lambda_n = Vector::Zero(n_c_), no_Lambda_t = Vector::Zero(n_t_);
  const Matrix before = parameter_rows(q, v_minus, no_a, no_Lambda_n, no_Lambda_t),
               without = parameter_rows(q, v, no_a, no_Lambda_n, no_Lambda_t),
               behind = parameter_rows(q, v, jump, Lambda_n, Lambda_t);
  const Matrix M = problem_.mass_matrix(q), J_n = problem_.normal_jacobian(q), J_t = problem_.tangent_jacobian(q);
  const Numbering numbering(problem_.info(), acts);
  Rows rows;
  rows.reset(numbering.size, n_q_, n_theta_ + 1);
  Matrix M_q(n_q_, n_q_), J_q(n_q_, n_q_);
  problem_.mass_derivative(q.data(), jump.data(), M_q.data());
  problem_.contact_force_derivative(q.data(), Lambda_n.data(), Lambda_t.data(), J_q.data());
  rows.q.topRows(n_q_) = M_q - J_q;  // (1)
  rows.v.topRows(n_q_) = M;
  rows.theta.topRows(n_q_) = (behind - without).topRows(n_q_) - M * state.v;
  add_force_columns(numbering, q, rows);
  for (const auto& [i, row] : numbering.contacts) {
    const auto& info = problem_.info().contacts[i];
    const double eps_r = is_projection ? 0 : info.eps_r;
    rows.q.row(row) = gap_curvature(i, q, v + eps_r * v_minus);
    rows.v.row(row) = J_n.col(i).transpose();
    rows.theta.row(row) =
        behind.row(n_q_ + n_c_ + i) + eps_r * before.row(n_q_ + n_c_ + i) + eps_r * J_n.col(i).transpose() * state.v;
    if (!is_projection) rows.theta.row(row) += deps_.row(i) * J_n.col(i).dot(v_minus);
    if (info.n_t > 0) {
      const Vector s = slip_velocity(i, q, v);
      const Matrix size =
          J_t.middleCols(info.tangent_index, info.n_t).cwiseAbs().transpose() * (v.cwiseAbs() + v_minus.cwiseAbs());
      Friction friction = is_projection ? slip_at_end(*impulse.projected, i, Lambda_n[i])
                                        : slip(i, s, Lambda_n[i], s[0] > 0 ? 1 : -1, s);
      friction.sticks =
          is_projection ? sticks_at_end(*impulse.projected, *impulse.end, i) : s.norm() <= kNoSlip * size.norm();
      add_friction(friction, q, v, Lambda_n[i], behind, row, row + 1, rows);
    }
  }
  rows.x.leftCols(n_q_) += rows.v;  // v+ is an unknown here
  const Matrix solution = solve_full_pivoting(rows.x, rows.q * state.q + rows.theta);
  state.v = -solution.topRows(n_q_);
}

/// (3)-(6)
Sensitivity::ElementVariation Sensitivity::through_element(const Element& e, const Switch& end, State& state) const {
  const ProblemInfo& info = problem_.info();
  const Matrix& A = tableau_.A;
  const Matrix A2 = A * A;
  const Vector r = A.rowwise().sum(), bA = A.transpose() * tableau_.b;
  const double h = e.h;

  const Numbering numbering = closed_contacts(e);
  const Eigen::Index n = numbering.size;
  Matrix K = Matrix::Zero(n_s_ * n, n_s_ * n), R(n_s_ * n, n_theta_ + 1);
  Rows rows;
  for (int j = 0; j < n_s_; ++j) {
    const Vector q = e.q.col(j), v = e.v.col(j), a = e.a.col(j), lambda_n = e.lambda_n.col(j),
                 lambda_t = e.lambda_t.col(j);
    const Matrix parameters = parameter_rows(q, v, a, lambda_n, lambda_t);
    const Matrix J_n = problem_.normal_jacobian(q);
    set_motion(numbering, q, v, a, lambda_n, lambda_t, parameters, rows);
    for (const auto& [i, row] : numbering.contacts) {
      const auto& contact = info.contacts[i];
      rows.q.row(row) = J_n.col(i).transpose() / (h * h);  // (4), scaled for the pivoting
      rows.theta.row(row) = parameters.row(n_q_ + i) / (h * h);
      if (contact.n_t > 0) {
        Friction friction = slip(i, slip_velocity(i, q, v), lambda_n[i], slip_sign(e.modes[i]),
                                 e.slip_start.segment(contact.tangent_index, contact.n_t));
        friction.sticks = e.modes[i] == ContactMode::stick || (j == n_s_ - 1 && sticks_at_end(e, end, i));
        add_friction(friction, q, v, lambda_n[i], parameters, row, row + 1, rows);
      }
    }
    Matrix q_j = state.q + h * r[j] * state.v, v_j = state.v;  // (5) at fixed accelerations
    q_j.col(n_theta_) += r[j] * e.v0 + 2 * h * e.a * A2.row(j).transpose();
    v_j.col(n_theta_) += e.a * A.row(j).transpose();
    R.middleRows(j * n, n) = rows.q * q_j + rows.v * v_j + rows.theta;
    K.block(j * n, j * n, n, n) += rows.x;
    for (int l = 0; l < n_s_; ++l) K.block(j * n, l * n, n, n_q_) += h * h * A2(j, l) * rows.q + h * A(j, l) * rows.v;
  }
  const Matrix dx = -solve_consistent(K, R);  // of redundant contacts, any of the forces that balance each other

  ElementVariation element{Matrix::Zero(n_c_ + n_t_, n_theta_ + 1), Matrix(n_s_ * n_q_, n_theta_ + 1)};
  state.q += h * state.v;
  state.q.col(n_theta_) += e.v0 + 2 * h * e.a * bA;
  state.v.col(n_theta_) += e.a * tableau_.b;
  for (int j = 0; j < n_s_; ++j) {
    const auto dw = dx.middleRows(j * n, n_q_);
    element.accelerations.middleRows(j * n_q_, n_q_) = dw;
    state.q += h * h * bA[j] * dw;
    state.v += h * tableau_.b[j] * dw;
    if (tableau_.right_end.size() > 0)
      add_forces(numbering, dx.middleRows(j * n, n), tableau_.right_end[j], element.forces);
  }
  if (e.is_projected) through_projection(e, end, state);
  if (e.has_end_forces && !stops_in_space(e, end)) element.forces = constrained_forces(e, end, state);
  return element;
}

/// (11) of end_projection.h, varied. @param state  at the right end
Matrix Sensitivity::constrained_forces(const Element& e, const Switch& end, const State& state) const {
  const ProblemInfo& info = problem_.info();
  const Vector &q = e.q1, &v = e.v1, &lambda_n = e.end_lambda_n, &lambda_t = e.end_lambda_t;
  const Matrix M = problem_.mass_matrix(q), J_n = problem_.normal_jacobian(q), J_t = problem_.tangent_jacobian(q),
               D_n = problem_.force_directions(J_n), D_t = problem_.force_directions(J_t);
  const Vector a = CholeskyFactors(M).solve(problem_.force(q, v) + D_n * lambda_n + D_t * lambda_t);
  const Matrix parameters = parameter_rows(q, v, a, lambda_n, lambda_t),
               of_acceleration = parameter_rows(q, a, a, lambda_n, lambda_t);
  // The bias contains third derivatives of gaps: differences of fourth order, along the variations and along v.
  const auto derivative = [](const auto& f, double step) -> Matrix {
    return (8 * (f(step) - f(-step)) - (f(2 * step) - f(-2 * step))) / (12 * step);
  };
  const auto step_along = [&](const Vector& dq, const Vector& dv) {
    const int n = info.n_mechanical();
    const double speed = max_abs(v.head(n)), q_size = max_abs(q.head(n)) + e.h * speed,
                 v_size = speed + e.h * max_abs(a);
    const double dt = info.clock < 0 ? 0 : std::abs(dq[info.clock]) / e.h;
    const double size = std::max({max_abs(dq.head(n)) / q_size, max_abs(dv) / v_size, dt});
    return size > 0 ? kFourthOrderStep / size : kFourthOrderStep;
  };
  Matrix bias(n_c_ + n_t_, n_theta_ + 1);
  for (Eigen::Index k = 0; k <= n_theta_; ++k) {
    const Vector dq = state.q.col(k), dv = state.v.col(k);
    const auto at = [&](double x) {
      const Vector q_x = q + x * dq, v_x = v + x * dv;
      Vector b(n_c_ + n_t_);
      b << problem_.gap_acceleration_bias(q_x, v_x), problem_.slip_acceleration_bias(q_x, v_x);
      return b;
    };
    bias.col(k) = derivative(at, step_along(dq, dv));
  }
  bias += derivative(
      [&](double x) -> Matrix {
        return parameter_rows(q + x * v, v, a, lambda_n, lambda_t).middleRows(n_q_ + n_c_, n_c_ + n_t_);
      },
      step_along(v, Vector::Zero(n_q_)));

  const Numbering numbering = closed_contacts(e);
  Rows rows;
  set_motion(numbering, q, v, a, lambda_n, lambda_t, parameters, rows);
  Matrix T(n_t_, n_q_);
  problem_.slip_velocity_derivative(q.data(), a.data(), T.data());
  for (const auto& [i, row] : numbering.contacts) {
    const auto& contact = info.contacts[i];
    const int t = contact.tangent_index, n_t = contact.n_t;
    rows.x.block(row, 0, 1, n_q_) = J_n.col(i).transpose();
    rows.q.row(row) = gap_curvature(i, q, a);
    rows.theta.row(row) = of_acceleration.row(n_q_ + n_c_ + i) + bias.row(i);
    if (n_t > 0 && sticks_at_end(e, end, i)) {
      rows.x.block(row + 1, 0, n_t, n_q_) = J_t.middleCols(t, n_t).transpose();
      rows.q.middleRows(row + 1, n_t) = T.middleRows(t, n_t);
      rows.theta.middleRows(row + 1, n_t) =
          of_acceleration.middleRows(n_q_ + 2 * n_c_ + t, n_t) + bias.middleRows(n_c_ + t, n_t);
    } else if (n_t > 0) {
      add_friction(slip_at_end(e, i, lambda_n[i]), q, v, lambda_n[i], parameters, row, row + 1, rows);
    }
  }
  const Matrix dx = -solve_full_pivoting(rows.x, rows.q * state.q + rows.v * state.v + rows.theta);
  Matrix forces = Matrix::Zero(n_c_ + n_t_, n_theta_ + 1);
  add_forces(numbering, dx, 1, forces);
  return forces;
}

/// (7) @param e  the last element of the run; @param state  at its right end; @param forces  its variations
Eigen::RowVectorXd Sensitivity::switch_slope(const Element& e, const Switch& end, const State& state,
                                             const Matrix& forces) const {
  const auto& contact = problem_.info().contacts[end.contact];
  const Matrix parameters =
      parameter_rows(e.q1, e.v1, e.a.col(n_s_ - 1), e.lambda_n.col(n_s_ - 1), e.lambda_t.col(n_s_ - 1));
  switch (end.kind) {
    case Switch::Kind::gap_closes:
      return problem_.normal_jacobian(e.q1).col(end.contact).transpose() * state.q + parameters.row(n_q_ + end.contact);
    case Switch::Kind::force_vanishes:
      return forces.row(end.contact);
    case Switch::Kind::slip_stops: {
      if (contact.n_t == 2) break;  // (8) of switch_function.h: the cone
      Matrix T(n_t_, n_q_);
      problem_.slip_velocity_derivative(e.q1.data(), e.v1.data(), T.data());
      return T.row(contact.tangent_index) * state.q +
             problem_.tangent_jacobian(e.q1).col(contact.tangent_index).transpose() * state.v +
             parameters.row(n_q_ + 2 * n_c_ + contact.tangent_index);
    }
    case Switch::Kind::cone_reached:
      break;
    case Switch::Kind::slip_turns:
    case Switch::Kind::edge_left:
      throw std::logic_error("a switch of the friction polygon, which sensitivities are declined with");
  }
  const bool is_of_stage = stops_in_space(e, end);
  const double lambda_n = is_of_stage ? e.lambda_n(end.contact, n_s_ - 1) : e.end_lambda_n[end.contact];
  const Vector lambda_t =
      (is_of_stage ? Vector(e.lambda_t.col(n_s_ - 1)) : e.end_lambda_t).segment(contact.tangent_index, contact.n_t);
  Eigen::RowVectorXd slope = contact.mu * forces.row(end.contact) + lambda_n * dmu_.row(end.contact);
  if (const double force = lambda_t.norm(); force > 0)
    slope -= lambda_t.transpose() / force * forces.middleRows(n_c_ + contact.tangent_index, contact.n_t);
  return slope;
}

}  // namespace ricochet
