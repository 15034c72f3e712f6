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

struct Text {
  const char *name, *formula;
};

constexpr Text kTexts[] = {
    {"stage position", "q_nj = q_n0 + h_n sum a_jk v_nk"},
    {"stage velocity", "v_nj = v_n0 + h_n sum a_jk F_v(q_nk, v_nk, u, lambda_nk)"},
    {"end position", "q_n+1 = q_n0 + h_n sum b_k v_nk"},
    {"end velocity", "v_n+1 = P (v_n0 + h_n sum b_k F_v(q_nk, v_nk, u, lambda_nk))"},
    {"continuity", "q_n0 = q_n"},
    {"impulse balance", "M (v_n0 - v_n) = sum J_n Lambda_n"},
    {"impulse sign", "Lambda_n >= 0"},
    {"impulse gap", "Lambda_n f_c(q_n) = 0"},
    {"impulse restitution", "Lambda_n J_n'(v_n0 + eps_r v_n) = 0; of impacts in sequence: no energy gained"},
    {"closed separation", "J_n'(v_n0 + eps_r v_n) >= 0 where f_c(q_n) = 0"},
    {"grid gap", "f_c(q_n) >= 0"},
    {"stage gap", "f_c(q_nj) >= 0"},
    {"stage force", "lambda_nj >= 0"},
    {"cross complementarity", "lambda_nj f_c(q_nj') = 0"},
    {"step equilibration", "(h_n - h_n-1) eta_n = 0"},
    {"pinned breaking", "lambda(right end of n-1) sum_j f_c(q_nj) = 0"},
    {"impulse cone", "|Lambda_t| <= mu Lambda_n"},
    {"impulse slip", "mu Lambda_n v_t + |v_t| Lambda_t = 0"},
    {"stage cone", "|lambda_t,nj| <= mu lambda_n,nj"},
    {"stage slip", "mu lambda_n,nj v_t,nj + |v_t,nj| lambda_t,nj = 0"},
    {"cross friction", "xi+-,nj' (mu lambda_n +- lambda_t)_nj = 0"},
    {"pinned sliding", "beta(right end of n-1) sum_j |v_t,nj| = 0"},
    {"bilateral gap", "f_c = 0"},
    {"bilateral velocity", "J_n'v = 0 at v_n0, v_n+1"},
    {"end tangency", "J_n'v_n+1 = 0, J_t'v_n+1 = 0 of stick"},
    {"end force", "(J_n'v)' = 0, (J_t'v)' = 0 of stick at v_n+1"},
    {"aggregated complementarity", "sum_j lambda_nj sum_j' f_c(q_nj') = 0"},
    {"tanh equilibration", "(h_n - h_n-1) tanh(eta_n) = 0"},
    {"step length", "sum h_n = H"},
};

// A force, or a slip velocity, that is zero, as part of its size.
constexpr double kRest = 1e-12;

/// Formulas of friction in its other forms.
constexpr struct {
  FesdCondition condition;
  const char *squared, *polyhedral;
} kConeTexts[] = {
    {FesdCondition::impulse_cone, "(mu Lambda_n)^2 - |Lambda_t|^2 >= 0", "Lambda_t in mu Lambda_n conv{d_f}"},
    {FesdCondition::impulse_slip, "v_t + 2 Gamma Lambda_t = 0", "mu Lambda_n gamma + Lambda_t'v_t = 0"},
    {FesdCondition::stage_cone, "(mu lambda_n,nj)^2 - |lambda_t,nj|^2 >= 0", "lambda_t,nj in mu lambda_n,nj conv{d_f}"},
    {FesdCondition::stage_slip, "v_t,nj + 2 gamma_nj lambda_t,nj = 0",
     "mu lambda_n,nj gamma_nj + lambda_t,nj'v_t,nj = 0"},
    {FesdCondition::cross_friction, "gamma_nj' ((mu lambda_n,nj)^2 - |lambda_t,nj|^2) = 0",
     "mu lambda_n,nj gamma_nj' + lambda_t,nj'v_t,nj' = 0"},
    {FesdCondition::pinned_sliding, "beta(right end of n-1) sum_j |v_t,nj| = 0",
     "l_f(right end of n-1) sum_j (d_f'v_t + gamma)_nj = 0"},
};

double max_abs(const auto& x) {
  return x.size() > 0 ? x.cwiseAbs().maxCoeff() : 0.0;
}

double ratio(double value, double size) {
  return size > 0 ? value / size : (value > 0 ? 1.0 : 0.0);
}

}  // namespace

FesdAudit::FesdAudit(const Problem& problem, const ButcherTableau& tableau, const Claims& claims)
    : problem_(problem),
      tableau_(tableau),
      stiffly_accurate_(tableau.is_stiffly_accurate()),
      pinned_(claims.pinned),
      gap_tolerance_(claims.gap_tolerance),
      cone_(claims.cone.cone),
      polygon_(claims.cone.facets),
      gap_size_(Vector::Zero(problem.n_c())),
      speed_size_(Vector::Zero(problem.n_c())),
      slip_size_(Vector::Zero(problem.n_c())) {
  for (const auto& [name, formula] : kTexts) residuals_.push_back({.name = name, .formula = formula});
  const bool is_squared = cone_ == FrictionCone::squared;
  if (!is_squared && !(polygon_.facets() > 0 && has_friction_in_space(problem.info()))) return;
  for (const auto& [condition, squared, polyhedral] : kConeTexts)
    residuals_[static_cast<std::size_t>(condition)].formula = is_squared ? squared : polyhedral;
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
    if (is_from(condition, FesdCondition::end_tangency, FesdCondition::end_force) && !has_curved) continue;
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
bool FesdAudit::forces_jump(const Element& left, const Element& right) const {
  for (std::size_t i = 0; i < left.modes.size(); ++i) {
    const bool stops = is_slipping(left.modes[i]) && right.modes[i] == ContactMode::stick;
    const bool is_at_vertex = left.modes[i] == ContactMode::vertex_slip;
    if (is_at_vertex && (right.modes[i] != left.modes[i] || right.facets[i] != left.facets[i])) return true;
    if (stops || slip_sign(left.modes[i]) * slip_sign(right.modes[i]) < 0) return true;
  }
  return false;
}

/// Of slip: at the last stage, when it is the right end, P has acted; the direction of slip in space was there before.
Vector FesdAudit::stage_velocity(const Element& e, int j, int n_t) const {
  return stiffly_accurate_ && n_t == 1 && j + 1 == tableau_.n_s ? e.v1 : Vector(e.v.col(j));
}

/// What v_{n+1} has besides the velocity of the Runge-Kutta step and what P took away, an impulse of closed contacts.
Vector FesdAudit::end_velocity_residual(const Element& e, const Matrix& accelerations) const {
  const ProblemInfo& info = problem_.info();
  Vector residual = e.v1 - e.v0 - e.h * accelerations * tableau_.b;
  if (!e.is_projected) return residual;
  const Matrix M = problem_.mass_matrix(e.q1), J_n = problem_.force_directions(problem_.normal_jacobian(e.q1)),
               J_t = problem_.force_directions(problem_.tangent_jacobian(e.q1));
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
  const Vector impulse = least_squares(held, M * residual);
  return residual - CholeskyFactors(M).solve(held * impulse);
}

/// What P and the forces at the right end are to achieve.
void FesdAudit::add_right_end(const Element& e, const Vector& force_size) {
  const Matrix J_n = problem_.normal_jacobian(e.q1), J_t = problem_.tangent_jacobian(e.q1);
  const CholeskyFactors M(problem_.mass_matrix(e.q1));
  const Vector load = M.solve(problem_.force(e.q1, e.v1)),
               contact_force = problem_.force_directions(J_n * e.end_lambda_n + J_t * e.end_lambda_t),
               a = load + M.solve(contact_force), bias_n = problem_.gap_acceleration_bias(e.q1, e.v1),
               bias_t = problem_.slip_acceleration_bias(e.q1, e.v1);
  for (int i = 0; i < problem_.n_c(); ++i) {
    if (!is_closed(e.modes[i])) continue;
    const auto hold = [&](const Vector& J, double bias) {
      const Vector direction = problem_.force_directions(J);
      const double acceleration =
          J.cwiseAbs().dot(load.cwiseAbs()) + J.dot(M.solve(direction)) * force_size[i] + std::abs(bias);
      report(FesdCondition::end_tangency, J.dot(e.v1), J.cwiseAbs().dot(e.v1.cwiseAbs()) + e.h * acceleration, i);
      report(FesdCondition::end_force, J.dot(a) + bias, acceleration, i);
    };
    hold(J_n.col(i), bias_n[i]);
    const auto& contact = problem_.info().contacts[i];
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

/// @param gaps  n_c x n_s, at the stages
void FesdAudit::add_bilateral(const Element& e, const Matrix& gaps) {
  const Vector left = problem_.gap(e.q0), right = problem_.gap(e.q1);
  const Matrix J_left = problem_.normal_jacobian(e.q0), J_right = problem_.normal_jacobian(e.q1);
  for (const int i : problem_.info().bilateral) {
    report(FesdCondition::bilateral_gap, std::max({max_abs(gaps.row(i)), std::abs(left[i]), std::abs(right[i])}),
           gap_size_[i], i);
    report(FesdCondition::bilateral_velocity,
           std::max(std::abs(J_left.col(i).dot(e.v0)), std::abs(J_right.col(i).dot(e.v1))), speed_size_[i], i);
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
void FesdAudit::add_slip(FesdCondition condition, const FrictionPoint& at, int contact, double force,
                         double slip_size) {
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
void FesdAudit::add_friction(const FesdStep& step, int n, int i, double force, double Lambda_size, double slip_size) {
  const auto& contact = problem_.info().contacts[i];
  const Element& e = step.elements[n];
  const int n_t = contact.n_t, n_s = tableau_.n_s;
  const FrictionPoint left{contact.mu * step.Lambda_n(i, n), step.Lambda_t.col(n).segment(contact.tangent_index, n_t),
                           slip(i, e.q0, e.v0)};
  add_cone(FesdCondition::impulse_cone, left, i, Lambda_size);
  if (step.n_impacts[static_cast<std::size_t>(n)] <= 1)
    add_slip(FesdCondition::impulse_slip, left, i, Lambda_size, slip_size);

  std::vector<FrictionPoint> stages;
  std::vector<Vector> slips = {left.v_t, slip(i, e.q1, e.v1)};  // v_t,nj'
  for (int j = 0; j < n_s; ++j) {
    stages.push_back({contact.mu * e.lambda_n(i, j), e.lambda_t.col(j).segment(contact.tangent_index, n_t),
                      slip(i, e.q.col(j), stage_velocity(e, j, n_t))});
    slips.push_back(stages.back().v_t);
    if (!e.is_projected || j + 1 < n_s) add_cone(FesdCondition::stage_cone, stages.back(), i, force);
    add_slip(FesdCondition::stage_slip, stages.back(), i, force, slip_size);
  }
  if (e.is_projected) {
    const FrictionPoint right{contact.mu * e.end_lambda_n[i], e.end_lambda_t.segment(contact.tangent_index, n_t),
                              slips[1]};
    add_cone(FesdCondition::stage_cone, right, i, force);
  }
  add_cross_friction(stages, slips, i, force, slip_size);
}

/// The force of each stage against the slip at all points of the element.
void FesdAudit::add_cross_friction(const std::vector<FrictionPoint>& stages, const std::vector<Vector>& slips, int i,
                                   double force, double slip_size) {
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
  double most_positive = 0, most_negative = 0, fastest = 0;  // of xi+, xi-, ||v_t|| over j'
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

void FesdAudit::add_pinned_sliding(const Element& left, const Element& e, int i, double force, double slip_size) {
  const auto& contact = problem_.info().contacts[i];
  const int n_t = contact.n_t;
  const Vector lambda_t = left.end_lambda_t.segment(contact.tangent_index, n_t);
  const double beta = cone_margin(contact.mu * left.end_lambda_n[i], lambda_t);
  double sum = 0;
  for (int j = 0; j < tableau_.n_s; ++j) sum += slip(i, e.q.col(j), stage_velocity(e, j, n_t)).norm();
  report(FesdCondition::pinned_sliding, beta * sum, force * slip_size, i);
  if (!polygon_.applies(n_t)) return;
  const std::vector<double> l = polygon_.facet_forces(left.modes[i], left.facets[i], lambda_t.data());
  for (int j = 0; j < tableau_.n_s; ++j) {
    const std::vector<double> rates = polygon_.facet_rates(slip(i, e.q.col(j), e.v.col(j)).data());
    for (std::size_t f = 0; f < l.size(); ++f)
      report(FesdCondition::pinned_sliding, l[f] * rates[f], force * slip_size, i);
  }
}

/// sum pi^{xi+-} + pi^beta: positive when a closed contact goes on slipping in its direction, or sticking.
double FesdAudit::friction_indicator(const Element& left, const Element& e, int i, double force,
                                     double slip_size) const {
  const auto& contact = problem_.info().contacts[i];
  const auto sums = [&](const Element& element) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // of xi+, xi-, beta; in space of ||v_t||, 0, beta
    for (int j = 0; j < tableau_.n_s; ++j) {
      const Vector v_t = slip(i, element.q.col(j), stage_velocity(element, j, contact.n_t));
      sum[0] += contact.n_t == 1 ? std::max(v_t[0], 0.0) : v_t.norm();
      sum[1] += contact.n_t == 1 ? std::max(-v_t[0], 0.0) : 0;
      sum[2] += cone_margin(contact.mu * element.lambda_n(i, j),
                            element.lambda_t.col(j).segment(contact.tangent_index, contact.n_t));
    }
    // Means: the product over many contacts would grow with n_s to the power of their number.
    return Eigen::Vector3d(sum / tableau_.n_s);
  };
  const Eigen::Vector3d before = sums(left), after = sums(e);
  const double slips = polygon_.applies(contact.n_t) ? facet_indicator(left, e, i, force, slip_size) : 1;
  return slips * ratio(before[0], slip_size) * ratio(after[0], slip_size) +
         ratio(before[1], slip_size) * ratio(after[1], slip_size) + ratio(before[2], force) * ratio(after[2], force);
}

/// min_f pi^{l_f} + pi^{r_f} with r_f = d_f' v_t + gamma: positive when the facets that carry force stay the same. The
/// least, because the product over many facets would vanish by itself.
double FesdAudit::facet_indicator(const Element& left, const Element& e, int i, double force, double slip_size) const {
  const auto& contact = problem_.info().contacts[i];
  const auto sums = [&](const Element& element) {
    Matrix sum = Matrix::Zero(polygon_.facets(), 2);
    for (int j = 0; j < tableau_.n_s; ++j) {
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
  const ProblemInfo& info = problem_.info();
  const int n_c = info.n_c(), n_s = tableau_.n_s, N = step.n_elements;

  // Sizes that belong to the whole step.
  Vector force_size = Vector::Zero(n_c);
  double length = 0;
  for (int n = 0; n < N; ++n) {
    const Element& e = step.elements[n];
    length += e.h;
    const Matrix J = problem_.normal_jacobian(e.q0).cwiseAbs(), J_t = problem_.tangent_jacobian(e.q0).cwiseAbs();
    const Matrix D = problem_.force_directions(J), D_t = problem_.force_directions(J_t);
    const CholeskyFactors M(problem_.mass_matrix(e.q0));
    Vector load = M.solve(problem_.force(e.q0, e.v0)).cwiseAbs();
    for (const int i : info.bilateral)
      load += M.solve(problem_.force_directions(problem_.normal_jacobian(e.q0)).col(i)).cwiseAbs() *
              max_abs(e.lambda_n.row(i));
    for (int i = 0; i < n_c; ++i) {
      const double speed = std::max(J.col(i).dot(e.v0.cwiseAbs()), J.col(i).dot(step.v_minus.col(n).cwiseAbs()));
      gap_size_[i] = std::max(gap_size_[i], J.col(i).dot(e.q0.cwiseAbs() + step.H * step.H * load) + step.H * speed);
      const double delassus = D.col(i).dot(M.solve(D.col(i)));
      force_size[i] = std::max({force_size[i], max_abs(e.lambda_n.row(i)), J.col(i).dot(load) / delassus,
                                kVelocityRounding * speed / (e.h * delassus)});
      speed_size_[i] = std::max(speed_size_[i], speed + step.H * delassus * force_size[i]);
      for (int d = 0; d < info.contacts[i].n_t; ++d) {
        const int tangent = info.contacts[i].tangent_index + d;
        const auto direction = J_t.col(tangent);
        const double mobility = D_t.col(tangent).dot(M.solve(D_t.col(tangent)));
        const double impulse = step.H * info.contacts[i].mu * force_size[i];
        slip_size_[i] = std::max({slip_size_[i], direction.dot(e.v0.cwiseAbs() + step.H * load) + mobility * impulse,
                                  direction.dot(step.v_minus.col(n).cwiseAbs())});
      }
    }
  }
  report(FesdCondition::step_length, length - step.H, step.H, -1);

  Matrix accelerations(info.n_q, n_s), gaps(n_c, n_s);
  double acceleration_size = 0;  // of the terms of M^-1 (f_v + J_n lambda)
  for (int n = 0; n < N; ++n) {
    const Element& e = step.elements[n];
    const Matrix M0 = problem_.mass_matrix(e.q0);

    // Runge-Kutta equations.
    for (int k = 0; k < n_s; ++k) {
      const Vector q = e.q.col(k), v = e.v.col(k);
      const CholeskyFactors M(problem_.mass_matrix(q));
      const Vector load = M.solve(problem_.force(q, v)),
                   contact =
                       M.solve(Vector(problem_.force_directions(problem_.normal_jacobian(q) * e.lambda_n.col(k) +
                                                                problem_.tangent_jacobian(q) * e.lambda_t.col(k))));
      accelerations.col(k) = load + contact;
      acceleration_size = std::max({acceleration_size, max_abs(load), max_abs(contact)});
      gaps.col(k) = problem_.gap(q);
    }
    const int n_bodies = info.n_mechanical();
    const double q_size = max_abs(e.q0.head(n_bodies)) + e.h * max_abs(e.v.topRows(n_bodies)),
                 v_size = max_abs(e.v0.head(n_bodies)) + e.h * acceleration_size;
    const Matrix of_stages = (e.q - e.h * e.v * tableau_.A.transpose()).colwise() - e.q0;
    report(FesdCondition::stage_position, max_abs(of_stages.topRows(n_bodies)), q_size, -1);
    report(FesdCondition::stage_velocity,
           max_abs((e.v - e.h * accelerations * tableau_.A.transpose()).colwise() - e.v0), v_size, -1);
    report(FesdCondition::end_position, max_abs((e.q1 - e.q0 - e.h * e.v * tableau_.b).head(n_bodies)), q_size, -1);
    report(FesdCondition::end_velocity, max_abs(end_velocity_residual(e, accelerations)), v_size, -1);

    // Left end.
    const Element* left = n > 0 ? &step.elements[n - 1] : previous ? &previous->last() : nullptr;
    if (left) report(FesdCondition::continuity, max_abs(e.q0 - left->q1), max_abs(e.q0), -1);
    if (n_c == 0) continue;
    const Vector v_minus = step.v_minus.col(n), Lambda = step.Lambda_n.col(n);
    const Matrix J = problem_.normal_jacobian(e.q0);
    const Vector grid_gaps = problem_.gap(e.q0), end_gaps = problem_.gap(e.q1);
    const double momentum =
        max_abs((M0 * e.v0.cwiseAbs()).head(n_bodies)) + max_abs((M0 * v_minus.cwiseAbs()).head(n_bodies));
    const Matrix impulse =
        problem_.force_directions(J * Lambda + problem_.tangent_jacobian(e.q0) * step.Lambda_t.col(n));
    report(FesdCondition::impulse_balance, max_abs(M0 * (e.v0 - v_minus) - impulse), momentum, -1);
    add_bilateral(e, gaps);
    if (e.is_projected) add_right_end(e, force_size);

    const bool is_sequence = step.n_impacts[static_cast<std::size_t>(n)] > 1;
    if (is_sequence) {  // each of its impacts loses energy, and none is left to come
      const double before = v_minus.dot(M0 * v_minus), behind = e.v0.dot(M0 * e.v0);
      report(FesdCondition::impulse_restitution, std::max(behind - before, 0.0), before + behind, -1);
    }
    double eta = 1;
    const bool legitimate_jump = max_abs(Lambda) > 0 || (left && forces_jump(*left, e));
    for (const int i : info.unilateral) {
      const double L = gap_size_[i], force = force_size[i];
      const double eps_r = is_sequence ? 0 : info.contacts[i].eps_r;
      const double separation = J.col(i).dot(e.v0 + eps_r * v_minus);
      const double Lambda_size = momentum > 0 ? momentum / max_abs(J.col(i)) : 0;
      report(FesdCondition::impulse_sign, std::min(Lambda[i], 0.0), Lambda_size, i);
      report(FesdCondition::impulse_gap, Lambda[i] * grid_gaps[i], Lambda_size * L, i);
      if (!is_sequence)
        report(FesdCondition::impulse_restitution, Lambda[i] * separation, Lambda_size * speed_size_[i], i);
      if (grid_gaps[i] <= 1e-15 * L)  // what a switch leaves; the solver treats gaps up to 64 roundings as closed
        report(FesdCondition::closed_separation, std::min(separation, 0.0), speed_size_[i], i);
      report(FesdCondition::grid_gap, std::min(grid_gaps[i], 0.0), L, i);

      const bool breaks = left && is_closed(left->modes[i]) && e.modes[i] == ContactMode::open && Lambda[i] == 0;
      const double allowed = breaks ? gap_tolerance_ : 0;

      // Element.
      const auto lambda = e.lambda_n.row(i);
      double largest_gap = grid_gaps[i];
      for (int j = 0; j < n_s; ++j) {
        report(FesdCondition::stage_gap, std::min(gaps(i, j) + allowed, 0.0), L, i);
        const bool is_replaced = e.is_projected && j + 1 == n_s;
        report(FesdCondition::stage_force, std::min(is_replaced ? e.end_lambda_n[i] : lambda[j], 0.0), force, i);
        largest_gap = std::max(largest_gap, std::abs(gaps(i, j)));
      }
      if (!stiffly_accurate_) {
        report(FesdCondition::stage_gap, std::min(end_gaps[i] + allowed, 0.0), L, i);
        largest_gap = std::max(largest_gap, std::abs(end_gaps[i]));
      }
      report(FesdCondition::cross_complementarity, max_abs(lambda) * largest_gap, force * L, i);
      const double gap_sum = std::abs(grid_gaps[i] + gaps.row(i).sum() + (stiffly_accurate_ ? 0 : end_gaps[i]));
      report(FesdCondition::aggregated_complementarity, lambda.cwiseAbs().sum() * gap_sum, n_s * force * (n_s + 1) * L,
             i);

      if (info.contacts[i].n_t > 0) {
        add_friction(step, n, i, force, Lambda_size, slip_size_[i]);
        if (n > 0 && pinned_ && tableau_.right_end.size() > 0 && !legitimate_jump)
          add_pinned_sliding(*left, e, i, force, slip_size_[i]);
      }

      // Switch indicators between left and e: kappa = pi^f + pi^lambda, nu = kappa zeta.
      if (!left) continue;
      const Vector left_start_gap = problem_.gap(left->q0);
      double sigma_f_left = left_start_gap[i];
      for (int j = 0; j < n_s; ++j) sigma_f_left += problem_.gap(Vector(left->q.col(j)))[i];
      const double sigma_f = grid_gaps[i] + gaps.row(i).sum();
      const double pi_f = std::max(0.0, ratio(grid_gaps[i], L)) * ratio(sigma_f_left, L) * ratio(sigma_f, L);
      const double pi_lambda = ratio(left->lambda_n.row(i).sum(), force) * ratio(lambda.sum(), force);
      double nu = pi_f + pi_lambda;
      if (info.contacts[i].n_t > 0)
        nu *= ratio(sigma_f_left + sigma_f, L) + friction_indicator(*left, e, i, force, slip_size_[i]);
      eta *= nu;
      if (n > 0 && pinned_ && tableau_.right_end.size() > 0 && !legitimate_jump) {
        report(FesdCondition::pinned_breaking, left->end_lambda_n[i] * gaps.row(i).sum(), force * L, i);
      }
    }
    if (n > 0) {
      const double difference = e.h - step.elements[n - 1].h;
      report(FesdCondition::step_equilibration, difference * eta, step.H, -1);
      report(FesdCondition::tanh_equilibration, difference * std::tanh(eta), step.H, -1);
    }
  }
}

}  // namespace ricochet
