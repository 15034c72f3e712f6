#include "methods/elements/switch_function.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/dense_solve.h"
#include "problems/packed_column.h"

namespace ricochet {
namespace {

// Differences of forces are taken so far apart, relative to the state: their error is its square, and Newton's method
// goes on with it.
constexpr double kForceDifference = 1e-4;
// Rounding leaves so much of a gap that closes, relative to the positions that it is a difference of.
constexpr double kRoundingOfClosing = 8 * std::numeric_limits<double>::epsilon();

/// Whether the function is of the force in (8): that of (11) sticks already, and lies inside the cone.
bool is_of_last_stage(const ActiveSet& active, const Switch& end) {
  return active.slip_end().contact >= 0 && end.kind == SwitchKind::slip_stops && !end.on_polygon();
}

}  // namespace

SwitchFunction::SwitchFunction(ElementSystem& system)
    : system_(system), problem_(system.problem), n_s_(system.tableau.n_s) {
  const ProblemInfo& info = problem_.info();
  J_n_.resize(info.n_normal_entries);
  J_t_.resize(info.n_tangent_entries);
  gap_.resize(info.n_c());
  q_.resize(info.n_q);
  v_.resize(info.n_q);
  T_.setZero(info.n_lambda_t, info.n_q);
  T_a_ = T_;
}

double SwitchFunction::value(const Element& last, const Switch& end) {
  return (this->*properties(end.kind).value)(last, end);
}

void SwitchFunction::slope(const Element& last, const Switch& end, const RunResponse& response,
                           Eigen::RowVector2d& slope) {
  slope.setZero();
  (this->*properties(end.kind).slope)(last, end, response, slope);
}

double SwitchFunction::deflated(const Element& last, const Switch& end, double h, const RunResponse& response,
                                Eigen::RowVector2d& its_slope) {
  double result = value(last, end);
  slope(last, end, response, its_slope);
  for (int zero = 0; zero < end.zeros_at_start; ++zero) {
    result /= h;
    its_slope /= h;
    its_slope[1] -= result / h;
  }
  return result;
}

double SwitchFunction::gap(const Element& last, const Switch& end) {
  problem_.gap(last.q1.data(), gap_.data());
  return gap_[end.contact] - end.left_gap;
}

void SwitchFunction::gap_slope(const Element& last, const Switch& end, const RunResponse& response,
                               Eigen::RowVector2d& slope) {
  const auto& contact = problem_.info().contacts[end.contact];
  problem_.normal_jacobian(last.q1.data(), J_n_.data());
  const double* J = J_n_.data() + contact.normal_begin;
  for (const int row : contact.support) slope += *J++ * response.q.row(row);
}

bool SwitchFunction::is_rounding_of_gap(const Element& last, const Switch& end) {
  if (end.kind != SwitchKind::gap_closes) return false;
  const auto& contact = problem_.info().contacts[end.contact];
  problem_.normal_jacobian(last.q1.data(), J_n_.data());
  return std::abs(gap(last, end)) <=
         kRoundingOfClosing * packed_terms(contact, J_n_.data() + contact.normal_begin, last.q1);
}

double SwitchFunction::normal_force(const Element& last, const Switch& end) {
  return last.end_lambda_n[end.contact];
}

double SwitchFunction::cone_margin(const Element& last, const Switch& end) {
  if (is_of_last_stage(system_.active, end))
    return margin(end, last.lambda_n.col(n_s_ - 1), last.lambda_t.col(n_s_ - 1));
  return margin(end, last.end_lambda_n, last.end_lambda_t);
}

/// mu lambda_n - ||lambda_t||: the force reaches the cone from inside or, by (8), from outside. On a polygon a side of
/// it, or the end of one.
double SwitchFunction::margin(const Switch& end, const Eigen::Ref<const Vector>& lambda_n,
                              const Eigen::Ref<const Vector>& lambda_t) const {
  const auto& info = problem_.info().contacts[end.contact];
  const auto force = lambda_t.segment(info.tangent_index, info.n_t);
  const double cone = info.mu * lambda_n[end.contact];
  if (!end.on_polygon()) return cone - force.norm();
  const auto& [is_of_force, direction, part, facet] = end.condition;
  return part * cone - direction[0] * force[0] - direction[1] * force[1];
}

void SwitchFunction::force_slope(const Element& last, const Switch& end, const RunResponse& response,
                                 Eigen::RowVector2d& slope) {
  if (system_.end.gives_forces() && !is_of_last_stage(system_.active, end))
    end_force_slope(last, end, response, slope);
  else
    stage_force_slope(last, end, response, slope);
}

/// Slope of the forces (11), by central differences along the two variations: they contain third derivatives of gaps.
void SwitchFunction::end_force_slope(const Element& last, const Switch& end, const RunResponse& response,
                                     Eigen::RowVector2d& slope) {
  const int n = problem_.info().n_mechanical();
  const double speed = last.v1.head(n).lpNorm<Eigen::Infinity>();
  const double q_size = last.q1.head(n).lpNorm<Eigen::Infinity>() + last.h * speed;
  const double v_size = speed + last.h * last.a.lpNorm<Eigen::Infinity>();
  EndSystem& at = system_.end_work;
  for (Eigen::Index c = 0; c < 2; ++c) {
    const auto dq = response.q.col(c), dv = response.v.col(c);
    const int clock = problem_.info().clock;
    const double dt = clock >= 0 ? std::abs(dq[clock]) / last.h : 0;
    const double size =
        std::max({dq.head(n).lpNorm<Eigen::Infinity>() / q_size, dv.lpNorm<Eigen::Infinity>() / v_size, dt});
    if (!(size > 0)) continue;
    const double part = kForceDifference / size;
    for (const double sign : {1.0, -1.0}) {
      q_ = last.q1 + sign * part * dq;
      v_ = last.v1 + sign * part * dv;
      system_.end.linearize(q_, v_, last, at);
      system_.end.set_forces(q_, v_, at);
      const double value =
          end.kind == SwitchKind::force_vanishes ? at.lambda_n[end.contact] : margin(end, at.lambda_n, at.lambda_t);
      slope[c] += sign / (2 * part) * value;
    }
  }
}

/// Slope of lambda_n, or of margin(), from the responses of the stage forces.
void SwitchFunction::stage_force_slope(const Element& last, const Switch& end, const RunResponse& response,
                                       Eigen::RowVector2d& slope) const {
  const auto& contact = problem_.info().contacts[end.contact];
  const ActiveContact& active = system_.active.of(end.contact);
  double by_lambda_n = 1, direction[2]{0, 0};  // by lambda_t: -direction
  if (end.kind != SwitchKind::force_vanishes) {
    const double* forces =
        is_of_last_stage(system_.active, end) ? last.lambda_t.col(n_s_ - 1).data() : last.end_lambda_t.data();
    const Eigen::Map<const Vector> lambda_t(forces + contact.tangent_index, contact.n_t);
    const double force = lambda_t.norm();
    for (int d = 0; d < contact.n_t && force > 0; ++d) direction[d] = lambda_t[d] / force;
    if (end.on_polygon()) std::copy_n(end.condition.direction.data(), 2, direction);
    const auto& along = active.law.along;
    by_lambda_n =
        contact.mu * ((end.on_polygon() ? end.condition.cone : 1) + direction[0] * along[0] + direction[1] * along[1]);
  }
  for (int j = 0; j < n_s_; ++j) {
    const double weight = system_.tableau.right_end[j];
    const auto row = j * system_.active.n_unknowns() + problem_.n_q() + active.row;
    slope += weight * by_lambda_n * response.x.row(row);
    for (int m = 0; m < active.n_rows - 1; ++m) {
      const auto& held = active.law.held[m];
      slope -= weight * (direction[0] * held[0] + direction[1] * held[1]) * response.x.row(row + 1 + m);
    }
  }
}

/// Whether the function is a component of the slip velocity, and which: in the plane and on a polygon.
bool SwitchFunction::slip_component(const Element& last, const Switch& end, double* direction) {
  if (end.on_polygon()) {
    std::copy_n(end.condition.direction.data(), 2, direction);
    return !end.condition.is_of_force;
  }
  direction[0] = slip_sign(last.modes[end.contact]);
  direction[1] = 0;
  return direction[0] != 0;
}

double SwitchFunction::slip(const Element& last, const Switch& end) {
  if (end.together) return missing_power(last, nullptr, nullptr);
  double direction[2];
  if (is_of_last_stage(system_.active, end) || !slip_component(last, end, direction))
    return cone_margin(last, end);  // (8)
  const auto& contact = problem_.info().contacts[end.contact];
  problem_.tangent_jacobian(last.q1.data(), J_t_.data());
  const double* J_t = J_t_.data() + contact.tangent_begin;
  double slip = 0;
  for (int d = 0; d < contact.n_t; ++d) {
    for (const int row : contact.support) slip += direction[d] * *J_t++ * last.v1[row];
  }
  return slip;
}

void SwitchFunction::slip_slope(const Element& last, const Switch& end, const RunResponse& response,
                                Eigen::RowVector2d& slope) {
  double direction[2];
  if (!slip_component(last, end, direction)) {
    if (end.together)
      missing_power(last, &response, &slope);
    else
      force_slope(last, end, response, slope);
    return;
  }
  const auto& contact = problem_.info().contacts[end.contact];
  problem_.tangent_jacobian(last.q1.data(), J_t_.data());
  problem_.slip_velocity_derivative(last.q1.data(), last.v1.data(), T_.data());
  const double* J_t = J_t_.data() + contact.tangent_begin;
  for (int d = 0; d < contact.n_t; ++d) {
    slope += direction[d] * T_.row(contact.tangent_index + d).lazyProduct(response.q);
    for (const int row : contact.support) slope += direction[d] * *J_t++ * response.v.row(row);
  }
}

/// J_t and T at the right end, for (9).
void SwitchFunction::set_slip_terms(const Element& last) {
  problem_.tangent_jacobian(last.q1.data(), J_t_.data());
  problem_.slip_velocity_derivative(last.q1.data(), last.v1.data(), T_.data());
}

/// s of (9), n_t components, with the terms of set_slip_terms(). @return ||s||
double SwitchFunction::slip_acceleration(const ActiveContact& active, const Element& last, double* s) const {
  const auto& contact = problem_.info().contacts[active.contact];
  const double* J_t = J_t_.data() + contact.tangent_begin;
  for (int d = 0; d < 2; ++d) {
    s[d] = T_.row(contact.tangent_index + d).dot(last.v1);
    for (const int row : contact.support) s[d] += *J_t++ * last.a(row, n_s_ - 1);
  }
  return std::hypot(s[0], s[1]);
}

void SwitchFunction::spread_friction(Element& last) {
  set_slip_terms(last);
  // Columns of resting contacts only.
  Matrix directions = Matrix::Zero(problem_.n_q(), problem_.info().n_lambda_t);
  Vector excess = Vector::Zero(problem_.info().n_lambda_t);
  for (const ActiveContact& active : system_.active.closed()) {
    if (!system_.active.rests(active, n_s_ - 1)) continue;
    const auto& contact = problem_.info().contacts[active.contact];
    double s[2];
    const double size = slip_acceleration(active, last, s);
    const double* J_t = J_t_.data() + contact.tangent_begin;
    for (int d = 0; d < 2; ++d) {
      const int t = contact.tangent_index + d;
      for (const int row : contact.pushed()) directions(row, t) = *J_t++;
      J_t += contact.is_moving;
      excess[t] = last.lambda_t(t, n_s_ - 1) - contact.mu * last.lambda_n(active.contact, n_s_ - 1) * s[d] / size;
    }
  }
  last.lambda_t.col(n_s_ - 1) -= excess - least_squares(directions, directions * excess);
}

/// (9): the right-hand side minus the left one, at the last stage; and its slope, where asked for. The slope leaves out
/// second derivatives of J_t, which curved contacts have: Newton's method is linear there.
double SwitchFunction::missing_power(const Element& last, const RunResponse* response, Eigen::RowVector2d* slope) {
  const int j = n_s_ - 1, n_q = problem_.n_q(), n_x = system_.active.n_unknowns();
  set_slip_terms(last);
  if (slope) problem_.slip_velocity_derivative(last.q1.data(), last.a.col(j).data(), T_a_.data());
  double power = 0;
  for (const ActiveContact& active : system_.active.closed()) {
    if (!system_.active.rests(active, n_s_ - 1)) continue;
    const auto& contact = problem_.info().contacts[active.contact];
    const double lambda_n = last.lambda_n(active.contact, j);
    double s[2];
    const double size = slip_acceleration(active, last, s);
    power += contact.mu * lambda_n * size;
    for (int d = 0; d < 2; ++d) power -= last.lambda_t(contact.tangent_index + d, j) * s[d];
    if (!slope) continue;
    const auto x = response->x.middleRows(j * n_x, n_x);
    *slope += contact.mu * size * x.row(n_q + active.row);
    const double* J_t = J_t_.data() + contact.tangent_begin;
    for (int d = 0; d < 2; ++d) {
      const int t = contact.tangent_index + d;
      *slope -= s[d] * x.row(n_q + active.row + 1 + d);
      // T v is quadratic in v: the factor 2.
      Eigen::RowVector2d ds = T_a_.row(t) * response->q + 2 * T_.row(t) * response->v;
      for (const int row : contact.support) ds += *J_t++ * x.row(row);
      *slope += (contact.mu * lambda_n * s[d] / size - last.lambda_t(t, j)) * ds;
    }
  }
  return power;
}

}  // namespace ricochet
