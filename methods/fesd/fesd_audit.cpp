#include "methods/fesd/fesd_audit.h"

#include <algorithm>
#include <cmath>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

// A force is a difference of velocities divided by the length of the element, and in one that time hardly resolves
// (7e-17 s at 0.015 s) it is their rounding, of some eps: this makes 64 eps of a velocity 1e-12 of a force, the bound
// of the tests.
constexpr double kVelocityRounding = 0.015;

// A force, or a slip velocity, that is zero, as part of its size.
constexpr double kRest = 1e-12;

double max_abs(const auto& x) {
  return x.size() > 0 ? x.cwiseAbs().maxCoeff() : 0.0;
}

double ratio(double value, double size) {
  return size > 0 ? value / size : (value > 0 ? 1.0 : 0.0);
}

/// The part of a change of q or v that forces along the columns of F cannot cause.
Vector but_for_forces(const Matrix& M, const Matrix& F, const Vector& change) {
  return change - CholeskyFactors(M).solve(F * least_squares(F, M * change));
}

}  // namespace

FesdAudit::FesdAudit(const Problem& problem, const ButcherTableau& tableau, const Claims& claims)
    : problem_(problem),
      tableau_(tableau),
      stiffly_accurate_(tableau.is_stiffly_accurate()),
      n_points_(tableau.holds_accelerations ? 1 : tableau.n_s),
      pinned_(claims.pinned),
      gap_tolerance_(claims.gap_tolerance),
      cone_(claims.cone.cone),
      polygon_(claims.cone.facets),
      gap_size_(Vector::Zero(problem.n_c())),
      speed_size_(Vector::Zero(problem.n_c())),
      slip_size_(Vector::Zero(problem.n_c())),
      force_size_(Vector::Zero(problem.n_c())) {
  const bool is_squared = cone_ == FrictionCone::squared;
  const bool is_polyhedral = !is_squared && polygon_.facets() > 0 && has_friction_in_space(problem.info());
  for (const FesdConditionText& text : kFesdConditions) {
    const char* other = is_squared ? text.squared : is_polyhedral ? text.polyhedral : nullptr;
    residuals_.push_back({.name = text.name, .formula = other ? other : text.formula});
  }
}

std::vector<Residual> FesdAudit::residuals() const {
  std::vector<Residual> list;
  const ProblemInfo& info = problem_.info();
  const bool has_curved =
      std::any_of(info.contacts.begin(), info.contacts.end(), [](const auto& c) { return !c.is_affine; });
  const auto is_from = [](FesdCondition condition, FesdCondition first, FesdCondition last) {
    return condition >= first && condition <= last;
  };
  for (std::size_t k = 0; k < residuals_.size(); ++k) {
    const auto condition = static_cast<FesdCondition>(k);
    if (is_from(condition, FesdCondition::impulse_cone, FesdCondition::pinned_sliding) && !info.has_friction())
      continue;
    if (is_from(condition, FesdCondition::bilateral_gap, FesdCondition::bilateral_velocity) && !info.has_bilateral())
      continue;
    if (condition == FesdCondition::end_tangency && !has_curved) continue;
    if (condition == FesdCondition::end_force && stiffly_accurate_ && !has_curved) continue;
    list.push_back(residuals_[k]);
  }
  return list;
}

void FesdAudit::report(FesdCondition condition, double residual, double size, int contact) {
  Residual& worst = residuals_[static_cast<std::size_t>(condition)];
  double value = ratio(std::abs(residual), size);
  if (std::isnan(residual) || std::isnan(size)) value = INFINITY;
  if (value <= worst.value) return;
  worst.value = value;
  worst.t = t_;
  worst.contact = contact;
}

Vector FesdAudit::slip(int contact, const Vector& q, const Vector& v) const {
  const auto& info = problem_.info().contacts[contact];
  return problem_.tangent_jacobian(q).middleCols(info.tangent_index, info.n_t).transpose() * v;
}

/// An impulse elsewhere changes contact forces at once, and so does a contact that stops or reverses its slip, or turns
/// it past an edge of a polygon.
bool FesdAudit::forces_jump(const Element& left, const Element& right) {
  for (std::size_t i = 0; i < left.modes.size(); ++i) {
    const bool stops = is_slipping(left.modes[i]) && right.modes[i] == ContactMode::stick;
    const bool is_at_vertex = left.modes[i] == ContactMode::vertex_slip;
    if (is_at_vertex && (right.modes[i] != left.modes[i] || right.facets[i] != left.facets[i])) return true;
    if (stops || slip_sign(left.modes[i]) * slip_sign(right.modes[i]) < 0) return true;
  }
  return false;
}

/// Velocity for slip at a stage. At the right end it includes P, but not in space, where the direction of slip is older
/// than P.
Vector FesdAudit::stage_velocity(const Element& e, int j, int n_t) const {
  return stiffly_accurate_ && n_t == 1 && j + 1 == tableau_.n_s ? e.v1 : Vector(e.v.col(j));
}

/// Directions of the forces that hold the contacts that are closed in an element, at q: n_q x (n_c + n_lambda_t), a column
/// of a normal has the friction of its slip.
Matrix FesdAudit::held_directions(const Element& e, const Vector& q) const {
  const ProblemInfo& info = problem_.info();
  const Matrix J_n = problem_.force_directions(problem_.normal_jacobian(q)),
               J_t = problem_.force_directions(problem_.tangent_jacobian(q));
  Matrix held = Matrix::Zero(info.n_q, info.n_c() + info.n_lambda_t);
  for (int i = 0; i < info.n_c(); ++i) {
    const auto& contact = info.contacts[i];
    if (is_closed(e.modes[i])) held.col(i) = J_n.col(i);
    if (contact.n_t == 0 || !is_closed(e.modes[i])) continue;
    const TangentialLaw law = law_of(e, i);
    const bool turns = e.modes[i] == ContactMode::slip;  // on the disc in space
    for (int d = 0; d < contact.n_t; ++d) {
      const int t = contact.tangent_index + d;
      held.col(i) -= law.along[d] * contact.mu * J_t.col(t);
      for (int m = 0; m < (turns ? contact.n_t : law.n_held); ++m)
        held.col(info.n_c() + contact.tangent_index + m) += law.held[m][d] * J_t.col(t);
    }
  }
  return held;
}

/// held_directions(), followed by the normals without friction.
Matrix FesdAudit::held_and_normals(const Element& e, const Vector& q) const {
  const Matrix held = held_directions(e, q), J_n = problem_.force_directions(problem_.normal_jacobian(q));
  Matrix all(held.rows(), held.cols() + J_n.cols());
  all << held, J_n;
  for (int i = 0; i < problem_.n_c(); ++i) {
    if (!is_closed(e.modes[i])) all.col(held.cols() + i).setZero();
  }
  return all;
}

/// Difference of v_{n+1} from the velocity of the Runge-Kutta step, except what P took away, an impulse of closed
/// contacts.
Vector FesdAudit::end_velocity_residual(const Element& e, const Matrix& accelerations) const {
  const Vector residual = e.v1 - e.v0 - e.h * accelerations * tableau_.b;
  if (!e.is_projected) return residual;
  return but_for_forces(problem_.mass_matrix(e.q1), held_directions(e, e.q1), residual);
}

/// The same of q_{n+1}, which P moves if the tableau holds accelerations.
Vector FesdAudit::end_position_residual(const Element& e) const {
  const Vector residual = e.q1 - e.q0 - e.h * e.v * tableau_.b;
  if (!e.is_projected || !tableau_.holds_accelerations) return residual;
  return but_for_forces(problem_.mass_matrix(e.q1), held_and_normals(e, e.q1), residual);
}

/// The forces at the right end of a tableau that has a stage there, where P does not replace them.
void FesdAudit::add_end_stage(const Element& e) {
  const Eigen::Index last = tableau_.n_s - 1;
  for (int i = 0; i < problem_.n_c(); ++i) {
    const auto& contact = problem_.info().contacts[i];
    const auto tangents = [&](const auto& lambda_t) { return lambda_t.segment(contact.tangent_index, contact.n_t); };
    report(FesdCondition::end_stage, e.end_lambda_n[i] - e.lambda_n(i, last), force_size_[i], i);
    report(FesdCondition::end_stage, max_abs(tangents(e.end_lambda_t) - tangents(e.lambda_t.col(last))), force_size_[i],
           i);
  }
}

/// Adds the conditions that P and the forces at the right end fulfil.
void FesdAudit::add_right_end(const View& at) {
  const Element& e = at.e;
  const Switch& end = at.step.ends[static_cast<std::size_t>(at.n)];
  const auto& contacts = problem_.info().contacts;
  // Slip in space that comes to rest there, (8) and (9) of switch_function.h.
  const auto stops = [&](int i) {
    if (e.modes[i] != ContactMode::slip || end.contact < 0 || end.kind != SwitchKind::slip_stops) return false;
    return end.contact == i || (end.together && contacts[i].support == contacts[end.contact].support);
  };
  const Matrix J_n = problem_.normal_jacobian(e.q1), J_t = problem_.tangent_jacobian(e.q1);
  const CholeskyFactors M(problem_.mass_matrix(e.q1));
  const Vector load = M.solve(problem_.force(e.q1, e.v1)),
               contact_force = problem_.force_directions(J_n * e.end_lambda_n + J_t * e.end_lambda_t),
               a = load + M.solve(contact_force), bias_n = problem_.gap_acceleration_bias(e.q1, e.v1),
               bias_t = problem_.slip_acceleration_bias(e.q1, e.v1);
  for (int i = 0; i < problem_.n_c(); ++i) {
    const auto& contact = problem_.info().contacts[i];
    if (!is_closed(e.modes[i])) {
      report(FesdCondition::end_force, e.end_lambda_n[i], force_size_[i], i);
      report(FesdCondition::end_force, max_abs(e.end_lambda_t.segment(contact.tangent_index, contact.n_t)),
             force_size_[i], i);
      continue;
    }
    const auto hold = [&](const Vector& J, double bias) {
      const Vector direction = problem_.force_directions(J);
      const double acceleration =
          J.cwiseAbs().dot(load.cwiseAbs()) + J.dot(M.solve(direction)) * force_size_[i] + std::abs(bias);
      if (e.is_projected)
        report(FesdCondition::end_tangency, J.dot(e.v1), J.cwiseAbs().dot(e.v1.cwiseAbs()) + e.h * acceleration, i);
      report(FesdCondition::end_force, J.dot(a) + bias, acceleration, i);
    };
    hold(J_n.col(i), bias_n[i]);
    for (int t = contact.tangent_index; t < contact.tangent_index + contact.n_t && stops(i); ++t)
      report(FesdCondition::end_tangency, J_t.col(t).dot(e.v1), slip_size_[i], i);
    const TangentialLaw law = law_of(e, i);
    for (int m = 0; m < law.n_held; ++m) {
      Vector J = Vector::Zero(problem_.n_q());
      double bias = 0;
      for (int d = 0; d < contact.n_t; ++d) {
        J += law.held[m][d] * J_t.col(contact.tangent_index + d);
        bias += law.held[m][d] * bias_t[contact.tangent_index + d];
      }
      hold(J, bias);
    }
  }
}

TangentialLaw FesdAudit::law_of(const Element& e, int contact) const {
  return polygon_.law(e.modes[contact], problem_.info().contacts[contact].n_t,
                      e.facets.empty() ? 0 : e.facets[contact]);
}

void FesdAudit::add_bilateral(const View& at) {
  const Matrix J_right = problem_.normal_jacobian(at.e.q1);
  for (const int i : problem_.info().bilateral) {
    report(FesdCondition::bilateral_gap,
           std::max({max_abs(at.gaps.row(i)), std::abs(at.left_gaps[i]), std::abs(at.right_gaps[i])}), gap_size_[i], i);
    report(FesdCondition::bilateral_velocity,
           std::max(std::abs(at.J_n.col(i).dot(at.e.v0)), std::abs(J_right.col(i).dot(at.e.v1))), speed_size_[i], i);
  }
}

/// The force inside its cone.
void FesdAudit::add_cone(FesdCondition condition, const FrictionPoint& at, int contact, double force) {
  if (cone_ == FrictionCone::squared) {
    report(condition, std::max(at.force.squaredNorm() - at.cone * at.cone, 0.0), force * force, contact);
  } else {
    report(condition, std::max(-cone_margin(at.cone, at.force), 0.0), force, contact);
  }
}

/// mu lambda_n - ||lambda_t||, with the norm that the cone has.
double FesdAudit::cone_margin(double cone, const Vector& force) const {
  return polygon_.applies(static_cast<int>(force.size())) ? polygon_.margin(cone, force.data()) : cone - force.norm();
}

/// The force against the slip.
void FesdAudit::add_slip(FesdCondition condition, const FrictionPoint& at, int contact, double force) {
  const double slip_size = slip_size_[contact];
  if (cone_ == FrictionCone::squared) {
    const double gamma = published_gamma(at, force);
    if (std::isinf(gamma)) {
      if (at.v_t.norm() > kRest * slip_size) ++residuals_[static_cast<std::size_t>(condition)].impossible;
      return;
    }
    report(condition, max_abs(at.v_t + 2 * gamma * at.force), slip_size, contact);
  } else if (polygon_.applies(static_cast<int>(at.v_t.size()))) {
    report(condition, missing_dissipation(at, at.v_t), force * slip_size, contact);
  } else {
    report(condition, max_abs(at.cone * at.v_t + at.v_t.norm() * at.force), force * slip_size, contact);
  }
}

/// gamma of v_t + 2 gamma lambda_t = 0 with ||lambda_t|| = mu lambda_n where it is not zero; infinite where there is no
/// force.
double FesdAudit::published_gamma(const FrictionPoint& at, double force) const {
  return at.cone > kRest * force ? at.v_t.norm() / (2 * at.cone) : INFINITY;
}

/// Power that a polygon could still take out of v_t: mu lambda_n gamma + lambda_t' v_t.
double FesdAudit::missing_dissipation(const FrictionPoint& at, const Vector& v_t) const {
  return at.cone * polygon_.speed(v_t.data()) + at.force.dot(v_t);
}

/// Coulomb's law of a contact, in one element and at its left end.
void FesdAudit::add_friction(const View& at, int i) {
  const auto& contact = problem_.info().contacts[i];
  const Element& e = at.e;
  const int n_t = contact.n_t, n_s = n_points_;
  const double force = force_size_[i];
  const auto tangents = [&](const auto& lambda_t) { return Vector(lambda_t.segment(contact.tangent_index, n_t)); };

  const FrictionPoint left{contact.mu * at.Lambda_n[i], tangents(at.step.Lambda_t.col(at.n)), slip(i, e.q0, e.v0)};
  add_cone(FesdCondition::impulse_cone, left, i, impulse_size(at, i));
  if (at.obeys_newton) add_slip(FesdCondition::impulse_slip, left, i, impulse_size(at, i));

  std::vector<FrictionPoint> stages;
  std::vector<Vector> slips = {left.v_t, slip(i, e.q1, e.v1)};  // v_t,nj'
  for (int j = 0; j < n_s; ++j) {
    stages.push_back(
        {contact.mu * e.lambda_n(i, j), tangents(e.lambda_t.col(j)), slip(i, e.q.col(j), stage_velocity(e, j, n_t))});
    slips.push_back(stages.back().v_t);
    if (!(e.is_projected && stiffly_accurate_) || j + 1 < n_s)
      add_cone(FesdCondition::stage_cone, stages.back(), i, force);
    add_slip(FesdCondition::stage_slip, stages.back(), i, force);
  }
  if (e.has_end_forces) {
    const FrictionPoint right{contact.mu * e.end_lambda_n[i], tangents(e.end_lambda_t), slips[1]};
    add_cone(FesdCondition::stage_cone, right, i, force);
    add_slip(FesdCondition::stage_slip, right, i, force);
    // Near rest the slip says little of the force, which is on its cone all the same; in space it may stick already.
    const bool slides =
        is_slipping(e.modes[i]) && (e.modes[i] != ContactMode::slip || right.v_t.norm() > kRest * slip_size_[i]);
    if (slides && !polygon_.applies(n_t)) report(FesdCondition::end_force, right.force.norm() - right.cone, force, i);
  }
  add_cross_friction(stages, slips, i);
  if (is_pinned(at)) add_pinned_sliding(*at.left, e, i);
}

/// The force of each stage against the slip at all points of the element.
void FesdAudit::add_cross_friction(const std::vector<FrictionPoint>& stages, const std::vector<Vector>& slips, int i) {
  const double force = force_size_[i], slip_size = slip_size_[i];
  const auto n_t = static_cast<int>(slips.front().size());
  if (cone_ == FrictionCone::squared) {
    double gamma = 0;
    for (const auto& at : stages) {
      if (const double its = published_gamma(at, force); std::isfinite(its)) gamma = std::max(gamma, its);
    }
    const double gamma_size = std::max(gamma, slip_size / (2 * force));
    for (const auto& at : stages)
      report(FesdCondition::cross_friction, gamma * (at.cone * at.cone - at.force.squaredNorm()),
             gamma_size * force * force, i);
    return;
  }
  double most_positive = 0, most_negative = 0,
         fastest = 0;  // of xi+, xi-, ||v_t|| over j'
  for (const Vector& v_t : slips) {
    most_positive = std::max(most_positive, v_t[0]);
    most_negative = std::max(most_negative, -v_t[0]);
    fastest = std::max(fastest, v_t.norm());
  }
  for (const auto& at : stages) {
    double product = n_t == 1 ? std::max(most_positive * std::abs(at.cone + at.force[0]),
                                         most_negative * std::abs(at.cone - at.force[0]))
                              : fastest * std::abs(at.cone - at.force.norm());
    if (polygon_.applies(n_t)) {
      product = 0;
      for (const Vector& v_t : slips) product = std::max(product, std::abs(missing_dissipation(at, v_t)));
    }
    report(FesdCondition::cross_friction, product, force * slip_size, i);
  }
}

void FesdAudit::add_pinned_sliding(const Element& left, const Element& e, int i) {
  const double force = force_size_[i], slip_size = slip_size_[i];
  const auto& contact = problem_.info().contacts[i];
  const int n_t = contact.n_t;
  const Vector lambda_t = left.end_lambda_t.segment(contact.tangent_index, n_t);
  const double beta = cone_margin(contact.mu * left.end_lambda_n[i], lambda_t);
  double sum = 0;
  for (int j = 0; j < n_points_; ++j) sum += slip(i, e.q.col(j), stage_velocity(e, j, n_t)).norm();
  report(FesdCondition::pinned_sliding, beta * sum, force * slip_size, i);
  if (!polygon_.applies(n_t)) return;
  const std::vector<double> l = polygon_.facet_forces(left.modes[i], left.facets[i], lambda_t.data());
  for (int j = 0; j < n_points_; ++j) {
    const std::vector<double> rates = polygon_.facet_rates(slip(i, e.q.col(j), e.v.col(j)).data());
    for (std::size_t f = 0; f < l.size(); ++f)
      report(FesdCondition::pinned_sliding, l[f] * rates[f], force * slip_size, i);
  }
}

/// sum pi^{xi+-} + pi^beta: positive when a closed contact goes on slipping in its direction, or sticking.
double FesdAudit::friction_indicator(const Element& left, const Element& e, int i) const {
  const double force = force_size_[i], slip_size = slip_size_[i];
  const auto& contact = problem_.info().contacts[i];
  const auto sums = [&](const Element& element) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // of xi+, xi-, beta; in space of ||v_t||, 0, beta
    for (int j = 0; j < n_points_; ++j) {
      const Vector v_t = slip(i, element.q.col(j), stage_velocity(element, j, contact.n_t));
      sum[0] += contact.n_t == 1 ? std::max(v_t[0], 0.0) : v_t.norm();
      sum[1] += contact.n_t == 1 ? std::max(-v_t[0], 0.0) : 0;
      sum[2] += cone_margin(contact.mu * element.lambda_n(i, j),
                            element.lambda_t.col(j).segment(contact.tangent_index, contact.n_t));
    }
    // Means: the product over many contacts would grow with n_s to the power of their number.
    return Eigen::Vector3d(sum / n_points_);
  };
  const Eigen::Vector3d before = sums(left), after = sums(e);
  const double slips = polygon_.applies(contact.n_t) ? facet_indicator(left, e, i) : 1;
  return slips * ratio(before[0], slip_size) * ratio(after[0], slip_size) +
         ratio(before[1], slip_size) * ratio(after[1], slip_size) + ratio(before[2], force) * ratio(after[2], force);
}

/// min_f pi^{l_f} + pi^{r_f} with r_f = d_f' v_t + gamma: positive when the facets that carry force stay the same. The
/// least, because the product over many facets would vanish by itself.
double FesdAudit::facet_indicator(const Element& left, const Element& e, int i) const {
  const double force = force_size_[i], slip_size = slip_size_[i];
  const auto& contact = problem_.info().contacts[i];
  const auto sums = [&](const Element& element) {
    Matrix sum = Matrix::Zero(polygon_.facets(), 2);
    for (int j = 0; j < n_points_; ++j) {
      const auto l = polygon_.facet_forces(element.modes[i], element.facets[i],
                                           element.lambda_t.col(j).data() + contact.tangent_index),
                 rates = polygon_.facet_rates(slip(i, element.q.col(j), element.v.col(j)).data());
      for (int f = 0; f < polygon_.facets(); ++f)
        sum.row(f) += Eigen::RowVector2d(ratio(l[f], force), ratio(rates[f], slip_size));
    }
    return sum;
  };
  return sums(left).cwiseProduct(sums(e)).rowwise().sum().minCoeff();
}

void FesdAudit::add(const FesdStep& step, const FesdStep* previous, double t) {
  t_ = t;
  set_sizes(step);
  double length = 0;
  for (int n = 0; n < step.n_elements; ++n) {
    const Element& element = step.elements[n];
    const Element* left = n > 0 ? &step.elements[n - 1] : previous ? &previous->last() : nullptr;
    length += element.h;
    add_stages(view(step, n, element, left));
    if (problem_.n_c() == 0) continue;
    const View at = view(step, n, tableau_.holds_accelerations ? at_right_end(element) : element, left);
    add_impulses(at);
    add_bilateral(at);
    if (at.e.has_end_forces)
      add_right_end(at);
    else if (stiffly_accurate_)
      add_end_stage(at.e);
    for (const int i : problem_.info().unilateral) {
      add_gaps_and_forces(at, i);
      if (problem_.info().contacts[i].n_t > 0) add_friction(at, i);
      if (is_pinned(at)) add_pinned_breaking(at, i);
    }
    if (n > 0) add_lengths(at);
  }
  report(FesdCondition::step_length, length - step.H, step.H, -1);
}

/// Sizes that belong to the whole step.
void FesdAudit::set_sizes(const FesdStep& step) {
  const ProblemInfo& info = problem_.info();
  force_size_.setZero();
  acceleration_size_ = 0;
  for (int n = 0; n < step.n_elements; ++n) {
    const Element& e = step.elements[n];
    const Matrix J = problem_.normal_jacobian(e.q0).cwiseAbs(), J_t = problem_.tangent_jacobian(e.q0).cwiseAbs();
    const Matrix D = problem_.force_directions(J), D_t = problem_.force_directions(J_t);
    const CholeskyFactors M(problem_.mass_matrix(e.q0));
    Vector load = M.solve(problem_.force(e.q0, e.v0)).cwiseAbs();
    for (const int i : info.bilateral)
      load += M.solve(problem_.force_directions(problem_.normal_jacobian(e.q0)).col(i)).cwiseAbs() *
              max_abs(e.lambda_n.row(i));
    for (int i = 0; i < info.n_c(); ++i) {
      const double speed = std::max(J.col(i).dot(e.v0.cwiseAbs()), J.col(i).dot(step.v_minus.col(n).cwiseAbs()));
      gap_size_[i] = std::max(gap_size_[i], J.col(i).dot(e.q0.cwiseAbs() + step.H * step.H * load) + step.H * speed);
      const double delassus = D.col(i).dot(M.solve(D.col(i)));
      force_size_[i] = std::max({force_size_[i], max_abs(e.lambda_n.row(i)), J.col(i).dot(load) / delassus,
                                 kVelocityRounding * speed / (e.h * delassus)});
      speed_size_[i] = std::max(speed_size_[i], speed + step.H * delassus * force_size_[i]);
      for (int d = 0; d < info.contacts[i].n_t; ++d) {
        const int tangent = info.contacts[i].tangent_index + d;
        const auto direction = J_t.col(tangent);
        const double tangential_delassus = D_t.col(tangent).dot(M.solve(D_t.col(tangent)));
        const double impulse = step.H * info.contacts[i].mu * force_size_[i];
        slip_size_[i] =
            std::max({slip_size_[i], direction.dot(e.v0.cwiseAbs() + step.H * load) + tangential_delassus * impulse,
                      direction.dot(step.v_minus.col(n).cwiseAbs())});
      }
    }
  }
}

/// The element with its right end in place of the stages.
const Element& FesdAudit::at_right_end(const Element& element) {
  right_end_ = element;
  right_end_.q = element.q1;
  right_end_.v = element.v1;
  right_end_.a = element.end_a;
  right_end_.lambda_n = element.end_lambda_n;
  right_end_.lambda_t = element.end_lambda_t;
  return right_end_;
}

FesdAudit::View FesdAudit::view(const FesdStep& step, int n, const Element& e, const Element* left) {
  const ProblemInfo& info = problem_.info();
  View at{.step = step,
          .n = n,
          .e = e,
          .left = left,
          .M = problem_.mass_matrix(e.q0),
          .J_n = problem_.normal_jacobian(e.q0),
          .J_t = problem_.tangent_jacobian(e.q0),
          .v_minus = step.v_minus.col(n),
          .Lambda_n = step.Lambda_n.col(n),
          .left_gaps = problem_.gap(e.q0),
          .right_gaps = problem_.gap(e.q1),
          .accelerations = Matrix(info.n_q, e.q.cols()),
          .gaps = Matrix(info.n_c(), e.q.cols()),
          .momentum = 0,
          .obeys_newton = step.n_impacts[static_cast<std::size_t>(n)] <= 1 &&
                          info.impact_law.hypothesis == ImpactHypothesis::newton,
          .forces_jump = max_abs(step.Lambda_n.col(n)) > 0 || (left && forces_jump(*left, e))};
  const int n_bodies = info.n_mechanical();
  at.momentum =
      max_abs((at.M * e.v0.cwiseAbs()).head(n_bodies)) + max_abs((at.M * at.v_minus.cwiseAbs()).head(n_bodies));
  for (Eigen::Index k = 0; k < e.q.cols(); ++k) {
    const Vector q = e.q.col(k), v = e.v.col(k);
    const CholeskyFactors M(problem_.mass_matrix(q));
    const Vector load = M.solve(problem_.force(q, v)),
                 contact = M.solve(Vector(problem_.force_directions(problem_.normal_jacobian(q) * e.lambda_n.col(k) +
                                                                    problem_.tangent_jacobian(q) * e.lambda_t.col(k))));
    at.accelerations.col(k) = load + contact;
    acceleration_size_ = std::max({acceleration_size_, max_abs(load), max_abs(contact)});
    at.gaps.col(k) = problem_.gap(q);
  }
  return at;
}

/// The Runge-Kutta equations, and where they begin.
void FesdAudit::add_stages(const View& at) {
  const Element& e = at.e;
  const int n_bodies = problem_.info().n_mechanical();
  // Weights of explicit tableaus are large, of either sign.
  const double h = tableau_.holds_accelerations ? e.h * tableau_.A.cwiseAbs().rowwise().sum().maxCoeff() : e.h;
  const double q_size = max_abs(e.q0.head(n_bodies)) + h * max_abs(e.v.topRows(n_bodies)),
               v_size = max_abs(e.v0.head(n_bodies)) + h * acceleration_size_;
  const Matrix of_stages = (e.q - e.h * e.v * tableau_.A.transpose()).colwise() - e.q0;
  report(FesdCondition::stage_position, max_abs(of_stages.topRows(n_bodies)), q_size, -1);
  const auto n_added = e.q0.size() - n_bodies;
  report(FesdCondition::stage_position, max_abs(of_stages.bottomRows(n_added)), max_abs(e.q0.tail(n_added)) + e.h, -1);
  report(FesdCondition::stage_velocity,
         max_abs((e.v - e.h * at.accelerations * tableau_.A.transpose()).colwise() - e.v0), v_size, -1);
  // Newton's method knows accelerations by what they make of velocities in the element.
  report(FesdCondition::stage_acceleration, e.h * max_abs(e.a - at.accelerations), v_size, -1);
  const Vector of_end = end_position_residual(e);
  report(FesdCondition::end_position, max_abs(of_end.head(n_bodies)), q_size, -1);
  report(FesdCondition::end_position, max_abs(of_end.tail(n_added)), max_abs(e.q0.tail(n_added)) + e.h, -1);
  report(FesdCondition::end_velocity, max_abs(end_velocity_residual(e, at.accelerations)), v_size, -1);
  if (at.left) report(FesdCondition::continuity, max_abs(e.q0 - at.left->q1), max_abs(e.q0), -1);
}

/// The impact at the left end.
void FesdAudit::add_impulses(const View& at) {
  const Element& e = at.e;
  const Matrix impulse = problem_.force_directions(at.J_n * at.Lambda_n + at.J_t * at.step.Lambda_t.col(at.n));
  Vector left = at.M * (e.v0 - at.v_minus) - impulse;
  if (!at.obeys_newton) left -= of_captures(at, left);
  report(FesdCondition::impulse_balance, max_abs(left), at.momentum, -1);
  const auto law = problem_.info().impact_law.hypothesis;
  const bool may_gain = law == ImpactHypothesis::poisson || law == ImpactHypothesis::routh;
  if (!at.obeys_newton && !may_gain) {  // each of its impacts loses energy, and none is left to come
    const double before = at.v_minus.dot(at.M * at.v_minus), after = e.v0.dot(at.M * e.v0);
    report(FesdCondition::impulse_restitution, std::max(after - before, 0.0), before + after, -1);
  }
  for (const int i : problem_.info().unilateral) {
    const double gap = at.left_gaps[i], L = gap_size_[i], size = impulse_size(at, i);
    const double rate = at.J_n.col(i).dot(at.v_minus);
    const double eps_r = at.obeys_newton ? problem_.info().contacts[i].restitution(rate) : 0;
    const double separation = at.J_n.col(i).dot(e.v0 + eps_r * at.v_minus);
    report(FesdCondition::impulse_sign, std::min(at.Lambda_n[i], 0.0), size, i);
    report(FesdCondition::impulse_gap, at.Lambda_n[i] * gap, size * L, i);
    if (at.obeys_newton)
      report(FesdCondition::impulse_restitution, at.Lambda_n[i] * separation, size * speed_size_[i], i);
    if (gap <= 1e-15 * L)  // what a switch leaves; the solver treats gaps up to 64 roundings as closed
      report(FesdCondition::closed_separation, std::min(separation, 0.0), speed_size_[i], i);
    report(FesdCondition::grid_gap, std::min(gap, 0.0), L, i);
  }
}

/// The part of a momentum along forces of the contacts that are closed in the element. Where bounces are captured, alone
/// or as a group that comes to rest (contact_laws/group_capture.h), infinitely many impacts have impulses that are not
/// recorded.
Vector FesdAudit::of_captures(const View& at, const Vector& momentum) const {
  const bool is_capture = at.step.n_impacts[static_cast<std::size_t>(at.n)] > 1;
  Matrix F = is_capture ? held_and_normals(at.e, at.e.q0) : at.J_n;
  for (int i = 0; i < problem_.n_c() && !is_capture; ++i) {
    if (!is_closed(at.e.modes[i]) || problem_.info().contacts[i].is_bilateral) F.col(i).setZero();
  }
  return F.isZero(0) ? Vector::Zero(momentum.size()) : Vector(F * least_squares(F, momentum));
}

/// Size that an impulse of a contact is compared with.
double FesdAudit::impulse_size(const View& at, int i) {
  return at.momentum > 0 ? at.momentum / max_abs(at.J_n.col(i)) : 0;
}

/// Signs and complementarity of gap and force in the element.
void FesdAudit::add_gaps_and_forces(const View& at, int i) {
  const Element& e = at.e;
  const int n_s = n_points_;
  const double L = gap_size_[i], force = force_size_[i], left_gap = at.left_gaps[i], right_gap = at.right_gaps[i];
  const bool breaks = at.left && is_closed(at.left->modes[i]) && e.modes[i] == ContactMode::open && at.Lambda_n[i] == 0;
  const double allowed = breaks ? gap_tolerance_ : 0;
  const auto lambda = e.lambda_n.row(i);
  double largest_gap = left_gap;
  for (int j = 0; j < n_s; ++j) {
    report(FesdCondition::stage_gap, std::min(at.gaps(i, j) + allowed, 0.0), L, i);
    const bool is_replaced = e.is_projected && stiffly_accurate_ && j + 1 == n_s;
    report(FesdCondition::stage_force, std::min(is_replaced ? e.end_lambda_n[i] : lambda[j], 0.0), force, i);
    largest_gap = std::max(largest_gap, std::abs(at.gaps(i, j)));
  }
  if (!stiffly_accurate_) {
    report(FesdCondition::stage_gap, std::min(right_gap + allowed, 0.0), L, i);
    largest_gap = std::max(largest_gap, std::abs(right_gap));
  }
  report(FesdCondition::cross_complementarity, max_abs(lambda) * largest_gap, force * L, i);
  const double gap_sum = std::abs(left_gap + at.gaps.row(i).sum() + (stiffly_accurate_ ? 0 : right_gap));
  report(FesdCondition::aggregated_complementarity, lambda.cwiseAbs().sum() * gap_sum, n_s * force * (n_s + 1) * L, i);
}

void FesdAudit::add_pinned_breaking(const View& at, int i) {
  report(FesdCondition::pinned_breaking, at.left->end_lambda_n[i] * at.gaps.row(i).sum(), force_size_[i] * gap_size_[i],
         i);
}

/// The length of an element and that of the one before.
void FesdAudit::add_lengths(const View& at) {
  double eta = 1;
  for (const int i : problem_.info().unilateral) eta *= indicator(at, i);
  const double difference = at.e.h - at.left->h;
  report(FesdCondition::step_equilibration, difference * eta, at.step.H, -1);
  report(FesdCondition::tanh_equilibration, difference * std::tanh(eta), at.step.H, -1);
}

/// Switch indicator of a contact between an element and its neighbour: kappa = pi^f + pi^lambda, nu = kappa zeta. A gap
/// of a body far away counts as one of the size L: the product over the contacts must not enlarge the rounding of one.
double FesdAudit::indicator(const View& at, int i) const {
  const Element& left = *at.left;
  const double L = gap_size_[i], force = force_size_[i], gap = at.left_gaps[i];
  double sigma_f_left = problem_.gap(left.q0)[i];
  for (int j = 0; j < n_points_; ++j) sigma_f_left += problem_.gap(Vector(left.q.col(j)))[i];
  const double sigma_f = gap + at.gaps.row(i).sum();
  const auto part = [&](double x) { return std::clamp(ratio(x, L), -1.0, 1.0); };
  const double pi_f = std::max(0.0, part(gap)) * part(sigma_f_left) * part(sigma_f);
  const double pi_lambda = ratio(left.lambda_n.row(i).sum(), force) * ratio(at.e.lambda_n.row(i).sum(), force);
  const double kappa = pi_f + pi_lambda;
  if (problem_.info().contacts[i].n_t == 0) return kappa;
  return kappa * (part(sigma_f_left + sigma_f) + friction_indicator(left, at.e, i));
}

}  // namespace ricochet
