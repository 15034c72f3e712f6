#include "methods/fesd/conditions.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

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
    {"impulse restitution", "Lambda_n J_n'(v_n0 + eps_r v_n) = 0"},
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

double max_abs(const auto& x) {
  return x.size() > 0 ? x.cwiseAbs().maxCoeff() : 0.0;
}

double ratio(double value, double size) {
  return size > 0 ? value / size : (value > 0 ? 1.0 : 0.0);
}

}  // namespace

FesdAudit::FesdAudit(const Problem& problem, const ButcherTableau& tableau, bool pinned, double gap_tolerance)
    : problem_(problem),
      tableau_(tableau),
      stiffly_accurate_(tableau.is_stiffly_accurate()),
      pinned_(pinned),
      gap_tolerance_(gap_tolerance),
      gap_size_(Vector::Zero(problem.n_c())),
      speed_size_(Vector::Zero(problem.n_c())) {
  for (const auto& [name, formula] : kTexts) residuals_.push_back({.name = name, .formula = formula});
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

/// An impulse elsewhere changes contact forces at once, and so does a contact that stops or reverses its slip.
bool FesdAudit::forces_jump(const Stages& left, const Stages& right) {
  for (std::size_t i = 0; i < left.modes.size(); ++i) {
    const bool stops = is_slipping(left.modes[i]) && right.modes[i] == ContactMode::stick;
    if (stops || slip_sign(left.modes[i]) * slip_sign(right.modes[i]) < 0) return true;
  }
  return false;
}

/// Of slip: at the last stage, when it is the right end, P has acted; the direction of slip in space was there before.
Vector FesdAudit::stage_velocity(const Stages& e, int j, int n_t) const {
  return stiffly_accurate_ && n_t == 1 && j + 1 == tableau_.n_s ? e.v1 : Vector(e.v.col(j));
}

/// What v_{n+1} has besides the velocity of the Runge-Kutta step and what P took away, an impulse of closed contacts.
Vector FesdAudit::end_velocity_residual(const Stages& e, const Matrix& accelerations) const {
  const ProblemInfo& info = problem_.info();
  Vector residual = e.v1 - e.v0 - e.h * accelerations * tableau_.b;
  if (!e.is_projected) return residual;
  const Matrix M = problem_.mass_matrix(e.q1), J_n = problem_.normal_jacobian(e.q1),
               J_t = problem_.tangent_jacobian(e.q1);
  Matrix held = Matrix::Zero(info.n_q, info.n_c() + info.n_lambda_t);
  for (int i = 0; i < info.n_c(); ++i) {
    const auto& contact = info.contacts[i];
    if (is_closed(e.modes[i])) held.col(i) = J_n.col(i);
    if (const int sign = slip_sign(e.modes[i]); sign != 0)
      held.col(i) -= sign * contact.mu * J_t.col(contact.tangent_index);
    if (e.modes[i] == ContactMode::stick || e.modes[i] == ContactMode::slip)  // in space the direction turns
      held.middleCols(info.n_c() + contact.tangent_index, contact.n_t) =
          J_t.middleCols(contact.tangent_index, contact.n_t);
  }
  const Vector impulse = held.completeOrthogonalDecomposition().solve(M * residual);
  return residual - M.llt().solve(held * impulse);
}

/// What P and the forces at the right end are to achieve.
void FesdAudit::add_right_end(const Stages& e, const Vector& force_size) {
  const Matrix J_n = problem_.normal_jacobian(e.q1), J_t = problem_.tangent_jacobian(e.q1);
  const Eigen::LLT<Matrix> M(problem_.mass_matrix(e.q1));
  const Vector load = M.solve(problem_.force(e.q1, e.v1)),
               a = load + M.solve(J_n * e.end_lambda_n + J_t * e.end_lambda_t),
               bias_n = problem_.gap_acceleration_bias(e.q1, e.v1),
               bias_t = problem_.slip_acceleration_bias(e.q1, e.v1);
  for (int i = 0; i < problem_.n_c(); ++i) {
    if (!is_closed(e.modes[i])) continue;
    const auto hold = [&](const Vector& J, double bias) {
      const double acceleration =
          J.cwiseAbs().dot(load.cwiseAbs()) + J.dot(M.solve(J)) * force_size[i] + std::abs(bias);
      report(FesdCondition::end_tangency, J.dot(e.v1), J.cwiseAbs().dot(e.v1.cwiseAbs()) + e.h * acceleration, i);
      report(FesdCondition::end_force, J.dot(a) + bias, acceleration, i);
    };
    hold(J_n.col(i), bias_n[i]);
    const auto& contact = problem_.info().contacts[i];
    for (int t = contact.tangent_index; e.modes[i] == ContactMode::stick && t < contact.tangent_index + contact.n_t;
         ++t)
      hold(J_t.col(t), bias_t[t]);
  }
}

/// @param gaps  n_c x n_s, at the stages
void FesdAudit::add_bilateral(const Stages& e, const Matrix& gaps) {
  const Vector left = problem_.gap(e.q0), right = problem_.gap(e.q1);
  const Matrix J_left = problem_.normal_jacobian(e.q0), J_right = problem_.normal_jacobian(e.q1);
  for (const int i : problem_.info().bilateral) {
    report(FesdCondition::bilateral_gap, std::max({max_abs(gaps.row(i)), std::abs(left[i]), std::abs(right[i])}),
           gap_size_[i], i);
    report(FesdCondition::bilateral_velocity,
           std::max(std::abs(J_left.col(i).dot(e.v0)), std::abs(J_right.col(i).dot(e.v1))), speed_size_[i], i);
  }
}

/// Coulomb's law of a contact, in one element and at its left end.
void FesdAudit::add_friction(const FesdStep& step, int n, int i, double force, double Lambda_size, double slip_size) {
  const auto& contact = problem_.info().contacts[i];
  const Stages& e = step.elements[n];
  const int n_t = contact.n_t, n_s = tableau_.n_s;
  const Vector Lambda_t = step.Lambda_t.col(n).segment(contact.tangent_index, n_t);
  const double cone = contact.mu * step.Lambda_n(i, n);
  const Vector slip_left = slip(i, e.q0, e.v0);
  report(FesdCondition::impulse_cone, std::max(Lambda_t.norm() - cone, 0.0), Lambda_size, i);
  report(FesdCondition::impulse_slip, max_abs(cone * slip_left + slip_left.norm() * Lambda_t), Lambda_size * slip_size,
         i);

  double most_positive = 0, most_negative = 0, fastest = 0;  // of xi+, xi-, ||v_t|| over j'
  const auto at_point = [&](const Vector& v_t) {
    most_positive = std::max(most_positive, v_t[0]);
    most_negative = std::max(most_negative, -v_t[0]);
    fastest = std::max(fastest, v_t.norm());
  };
  at_point(slip_left);
  at_point(slip(i, e.q1, e.v1));
  for (int j = 0; j < n_s; ++j) {
    const Vector v_t = slip(i, e.q.col(j), stage_velocity(e, j, n_t)),
                 lambda_t = e.lambda_t.col(j).segment(contact.tangent_index, n_t);
    const double mu_lambda = contact.mu * e.lambda_n(i, j);
    at_point(v_t);
    if (!e.is_projected || j + 1 < n_s)
      report(FesdCondition::stage_cone, std::max(lambda_t.norm() - mu_lambda, 0.0), force, i);
    report(FesdCondition::stage_slip, max_abs(mu_lambda * v_t + v_t.norm() * lambda_t), force * slip_size, i);
  }
  if (e.is_projected) {
    const double outside = e.end_lambda_t.segment(contact.tangent_index, n_t).norm() - contact.mu * e.end_lambda_n[i];
    report(FesdCondition::stage_cone, std::max(outside, 0.0), force, i);
  }
  for (int j = 0; j < n_s; ++j) {
    const Vector lambda_t = e.lambda_t.col(j).segment(contact.tangent_index, n_t);
    const double mu_lambda = contact.mu * e.lambda_n(i, j);
    const double product = n_t == 1 ? std::max(most_positive * std::abs(mu_lambda + lambda_t[0]),
                                               most_negative * std::abs(mu_lambda - lambda_t[0]))
                                    : fastest * std::abs(mu_lambda - lambda_t.norm());
    report(FesdCondition::cross_friction, product, force * slip_size, i);
  }
}

void FesdAudit::add_pinned_sliding(const Stages& left, const Stages& e, int i, double force, double slip_size) {
  const auto& contact = problem_.info().contacts[i];
  const int n_t = contact.n_t;
  const double beta = contact.mu * left.end_lambda_n[i] - left.end_lambda_t.segment(contact.tangent_index, n_t).norm();
  double sum = 0;
  for (int j = 0; j < tableau_.n_s; ++j) sum += slip(i, e.q.col(j), stage_velocity(e, j, n_t)).norm();
  report(FesdCondition::pinned_sliding, beta * sum, force * slip_size, i);
}

/// sum pi^{xi+-} + pi^beta: positive when a closed contact goes on slipping in its direction, or sticking.
double FesdAudit::friction_indicator(const Stages& left, const Stages& e, int i, double force, double slip_size) const {
  const auto& contact = problem_.info().contacts[i];
  const auto sums = [&](const Stages& element) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // of xi+, xi-, beta; in space of ||v_t||, 0, beta
    for (int j = 0; j < tableau_.n_s; ++j) {
      const Vector v_t = slip(i, element.q.col(j), stage_velocity(element, j, contact.n_t));
      sum[0] += contact.n_t == 1 ? std::max(v_t[0], 0.0) : v_t.norm();
      sum[1] += contact.n_t == 1 ? std::max(-v_t[0], 0.0) : 0;
      sum[2] += contact.mu * element.lambda_n(i, j) -
                element.lambda_t.col(j).segment(contact.tangent_index, contact.n_t).norm();
    }
    return sum;
  };
  const Eigen::Vector3d before = sums(left), after = sums(e);
  return ratio(before[0], slip_size) * ratio(after[0], slip_size) +
         ratio(before[1], slip_size) * ratio(after[1], slip_size) + ratio(before[2], force) * ratio(after[2], force);
}

void FesdAudit::add(const FesdStep& step, const FesdStep* previous, double t) {
  t_ = t;
  const ProblemInfo& info = problem_.info();
  const int n_c = info.n_c(), n_s = tableau_.n_s, N = step.n_elements;

  // Sizes that belong to the whole step.
  Vector force_size = Vector::Zero(n_c), slip_size = Vector::Zero(n_c);
  double length = 0;
  for (int n = 0; n < N; ++n) {
    const Stages& e = step.elements[n];
    length += e.h;
    const Matrix J = problem_.normal_jacobian(e.q0).cwiseAbs(), J_t = problem_.tangent_jacobian(e.q0);
    const Eigen::LLT<Matrix> M(problem_.mass_matrix(e.q0));
    Vector load = M.solve(problem_.force(e.q0, e.v0)).cwiseAbs();
    for (const int i : info.bilateral)
      load += M.solve(problem_.normal_jacobian(e.q0).col(i)).cwiseAbs() * max_abs(e.lambda_n.row(i));
    for (int i = 0; i < n_c; ++i) {
      const double speed = std::max(J.col(i).dot(e.v0.cwiseAbs()), J.col(i).dot(step.v_minus.col(n).cwiseAbs()));
      gap_size_[i] = std::max(gap_size_[i], J.col(i).dot(e.q0.cwiseAbs() + step.H * step.H * load) + step.H * speed);
      const double delassus = J.col(i).dot(M.solve(J.col(i)));
      force_size[i] = std::max({force_size[i], max_abs(e.lambda_n.row(i)), J.col(i).dot(load) / delassus});
      speed_size_[i] = std::max(speed_size_[i], speed + step.H * delassus * force_size[i]);
      for (int d = 0; d < info.contacts[i].n_t; ++d) {
        const Vector direction = J_t.col(info.contacts[i].tangent_index + d).cwiseAbs();
        const double mobility = direction.dot(M.solve(direction));
        const double impulse = step.H * info.contacts[i].mu * force_size[i];
        slip_size[i] = std::max({slip_size[i], direction.dot(e.v0.cwiseAbs() + step.H * load) + mobility * impulse,
                                 direction.dot(step.v_minus.col(n).cwiseAbs())});
      }
    }
  }
  report(FesdCondition::step_length, length - step.H, step.H, -1);

  Matrix accelerations(info.n_q, n_s), gaps(n_c, n_s);
  double acceleration_size = 0;  // of the terms of M^-1 (f_v + J_n lambda)
  for (int n = 0; n < N; ++n) {
    const Stages& e = step.elements[n];
    const Matrix M0 = problem_.mass_matrix(e.q0);

    // Runge-Kutta equations.
    for (int k = 0; k < n_s; ++k) {
      const Vector q = e.q.col(k), v = e.v.col(k);
      const Eigen::LLT<Matrix> M(problem_.mass_matrix(q));
      const Vector load = M.solve(problem_.force(q, v)),
                   contact = M.solve(problem_.normal_jacobian(q) * e.lambda_n.col(k) +
                                     problem_.tangent_jacobian(q) * e.lambda_t.col(k));
      accelerations.col(k) = load + contact;
      acceleration_size = std::max({acceleration_size, max_abs(load), max_abs(contact)});
      gaps.col(k) = problem_.gap(q);
    }
    const double q_size = max_abs(e.q0) + e.h * max_abs(e.v), v_size = max_abs(e.v0) + e.h * acceleration_size;
    report(FesdCondition::stage_position, max_abs((e.q - e.h * e.v * tableau_.A.transpose()).colwise() - e.q0), q_size,
           -1);
    report(FesdCondition::stage_velocity,
           max_abs((e.v - e.h * accelerations * tableau_.A.transpose()).colwise() - e.v0), v_size, -1);
    report(FesdCondition::end_position, max_abs(e.q1 - e.q0 - e.h * e.v * tableau_.b), q_size, -1);
    report(FesdCondition::end_velocity, max_abs(end_velocity_residual(e, accelerations)), v_size, -1);

    // Left end.
    const Stages* left = n > 0 ? &step.elements[n - 1] : previous ? &previous->last() : nullptr;
    if (left) report(FesdCondition::continuity, max_abs(e.q0 - left->q1), max_abs(e.q0), -1);
    if (n_c == 0) continue;
    const Vector v_minus = step.v_minus.col(n), Lambda = step.Lambda_n.col(n);
    const Matrix J = problem_.normal_jacobian(e.q0);
    const Vector grid_gaps = problem_.gap(e.q0), end_gaps = problem_.gap(e.q1);
    const double momentum = max_abs(M0 * e.v0.cwiseAbs()) + max_abs(M0 * v_minus.cwiseAbs());
    report(FesdCondition::impulse_balance,
           max_abs(M0 * (e.v0 - v_minus) - J * Lambda - problem_.tangent_jacobian(e.q0) * step.Lambda_t.col(n)),
           momentum, -1);
    add_bilateral(e, gaps);
    if (e.is_projected) add_right_end(e, force_size);

    double eta = 1;
    const bool legitimate_jump = max_abs(Lambda) > 0 || (left && forces_jump(*left, e));
    for (const int i : info.unilateral) {
      const double L = gap_size_[i], force = force_size[i];
      const double separation = J.col(i).dot(e.v0 + info.contacts[i].eps_r * v_minus);
      const double Lambda_size = momentum > 0 ? momentum / max_abs(J.col(i)) : 0;
      report(FesdCondition::impulse_sign, std::min(Lambda[i], 0.0), Lambda_size, i);
      report(FesdCondition::impulse_gap, Lambda[i] * grid_gaps[i], Lambda_size * L, i);
      report(FesdCondition::impulse_restitution, Lambda[i] * separation, Lambda_size * speed_size_[i], i);
      if (grid_gaps[i] <= 1e-15 * L)  // what a switch leaves; the solver treats gaps up to 64 roundings as closed
        report(FesdCondition::closed_separation, std::min(separation, 0.0), speed_size_[i], i);
      report(FesdCondition::grid_gap, std::min(grid_gaps[i], 0.0), L, i);

      const bool breaks = left && is_closed(left->modes[i]) && e.modes[i] == ContactMode::open && Lambda[i] == 0;
      const double allowed = breaks ? gap_tolerance_ : 0;

      // Stages.
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
        add_friction(step, n, i, force, Lambda_size, slip_size[i]);
        if (n > 0 && pinned_ && tableau_.right_end.size() > 0 && !legitimate_jump)
          add_pinned_sliding(*left, e, i, force, slip_size[i]);
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
        nu *= ratio(sigma_f_left + sigma_f, L) + friction_indicator(*left, e, i, force, slip_size[i]);
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
