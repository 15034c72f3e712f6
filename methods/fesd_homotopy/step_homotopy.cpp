#include "methods/fesd_homotopy/step_homotopy.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "methods/regions/time_switch.h"
#include "problems/dense_solve.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

// A gap up to here at the end of a step is closed: what the crossover solves to [m].
constexpr double kTouching = 1e-9;
// sigma_0 of the retries; the last one for all others. Impulses and gaps of small bounces have products of 1e-6: a
// larger sigma leaves the guess there.
constexpr double kRetrySigmas[] = {1e-3, 1e-1, 1e-6};
// Places where the smallest gap of a free flight is looked for.
constexpr int kProbes = 20;
// A closed contact with at most this normal velocity rests [m/s].
constexpr double kResting = 1e-6;
// An impact is not guessed nearer to an end of the step than this part of it; a change of a branch not nearer than the
// shortest element.
constexpr double kMargin = 0.01;
// delta of side_check.h: what the crossover solves to, with the factors of several equations; without a crossover this
// many times what the relaxation leaves of the pairs.
constexpr double kSideAccuracy = 1e-9;
constexpr double kOfComplementarity = 10;

}  // namespace

StepHomotopy::StepHomotopy(const Problem& problem, const ButcherTableau& tableau, const Options& options, double H)
    : problem_(problem),
      info_(problem.info()),
      tableau_(tableau),
      options_(options),
      H_(H),
      equations_(problem, tableau, options.equations, mpcc_),
      initial_(equations_.add_initial_state(info_.q0, info_.v0)),
      right_(equations_.add_interval(initial_, add_control(), H, -1, 1)),
      solver_(mpcc_, options.homotopy) {
  if (equations_.step_functions().size() > 0) side_check_.emplace(problem, equations_.step_functions(), tableau_);
  if (side_check_ && options.guess == Guess::pivoting)
    throw InputError("guess", "pivoting", "another one is required where forces have abs, sign, min, max or if");
  if (options.guess == Guess::pivoting)
    pivoting_.emplace(problem, tableau, PivotingSolver::Options{.n_fe = options.equations.n_fe}, pivoting_counters_);
}

/// The control of the plain simulation, fixed.
std::vector<int> StepHomotopy::add_control() {
  std::vector<int> u;
  for (int k = 0; k < info_.n_u; ++k)
    u.push_back(mpcc_.nlp.add_variable(info_.u[k], info_.u[k], info_.u[k], fmt::format("u[{}]", k)));
  return u;
}

void StepHomotopy::start(const Vector& q, const Vector& v) {
  q_ = q;
  v_ = v;
  n_steps_ = 0;
  const Vector gap = problem_.gap(q);
  is_resting_.assign(info_.contacts.size(), false);
  is_closed_.assign(info_.contacts.size(), false);
  for (int i = 0; i < info_.n_c(); ++i) is_closed_[i] = gap[i] <= kTouching;
  if (pivoting_) pivoting_->start(q, v);
}

Status StepHomotopy::advance(double seconds) {
  const auto begin = std::chrono::steady_clock::now();
  double left = seconds;
  equations_.set_initial_state(initial_, q_, v_, is_closed_);
  const bool has_pivoted = pivoting_ && pivoting_->advance(H_) == Status::success;
  if (pivoting_ && !has_pivoted) pivoting_.reset();
  const bool is_cold = options_.guess == Guess::cold;
  equations_.set_guess(has_pivoted ? pivoting_->step() : is_cold ? cold() : flight(false), 0);
  for (attempts_ = 1;; ++attempts_) {
    solver_.set_options(attempt_options(left));
    solution_ = solver_.solve();
    if (side_check_ && solution_.succeeded()) check_sides();
    if (solution_.succeeded() || attempts_ > options_.retries) break;
    if (seconds > 0) left = seconds - std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (left < 0) break;
    equations_.set_guess(flight(true), 0);
  }
  if (solution_.succeeded()) accept();
  return solution_.status;
}

/// A start near a solution keeps its distance from the bounds below what the relaxation leaves.
HomotopyOptions StepHomotopy::attempt_options(double seconds) const {
  HomotopyOptions homotopy = options_.homotopy;
  if (seconds > 0) homotopy.time_limit = seconds;
  if (attempts_ > 1) {
    const int retry = std::min(attempts_ - 1, static_cast<int>(std::size(kRetrySigmas)));
    homotopy.sigma_0 = std::max(kRetrySigmas[retry - 1], homotopy.sigma_final);
  }
  homotopy.barrier = std::min(homotopy.barrier, homotopy.sigma_0);
  homotopy.push = std::min(homotopy.push, homotopy.sigma_0);
  return homotopy;
}

/// Rejects a solution that is no motion of the scene.
void StepHomotopy::check_sides() {
  const FesdStep step = equations_.read(solution_.x, 0);
  std::vector<Matrix> theta;
  for (int n = 0; n < step.n_elements; ++n) theta.push_back(equations_.theta(solution_.x, 0, n));
  const double accuracy = std::max(kSideAccuracy, kOfComplementarity * solution_.complementarity);
  const std::string why = (*side_check_)(step, theta, accuracy, n_steps_ == 0);
  if (why.empty()) return;
  solution_.status = Status::infeasible;
  solution_.message = why;
}

void StepHomotopy::accept() {
  current_ = 1 - current_;
  steps_[current_] = equations_.read(solution_.x, 0);
  ++n_steps_;
  FesdStep& step = steps_[current_];
  step.touches = true;
  // Removes the impulses that a relaxation leaves at open gaps; a crossover leaves none.
  for (int n = 0; n < step.n_elements; ++n) {
    const Vector gap = problem_.gap(step.elements[n].q0);
    for (int i = 0; i < info_.n_c(); ++i) {
      if (step.Lambda_n(i, n) <= gap[i]) step.Lambda_n(i, n) = 0;
    }
  }
  q_ = step.last().q1;
  v_ = step.last().v1;
  for (std::size_t i = 0; i < is_closed_.size(); ++i)
    is_closed_[i] = is_closed(step.last().modes[i]) || solution_.x[right_.gap[i]] <= kTouching;
}

FesdStep StepHomotopy::cold() const {
  FesdStep step;
  const int n_fe = options_.equations.n_fe;
  step.resize(problem_, tableau_.n_s, n_fe);
  step.n_elements = n_fe;
  for (auto& element : step.elements) {
    element.h = H_ / n_fe;
    element.q0 = element.q1 = q_;
    element.v0 = element.v1 = v_;
    element.q = q_.replicate(1, tableau_.n_s);
    element.v = v_.replicate(1, tableau_.n_s);
    element.a.setZero();
    element.lambda_n.setConstant(FesdEquations::kPositive);
    element.lambda_t.setZero();
  }
  step.v_minus = v_.replicate(1, n_fe);
  step.Lambda_n.setConstant(FesdEquations::kPositive);
  return step;
}

/// (2)
Vector StepHomotopy::element_friction(const Vector& q, const Vector& v, const Vector& force, const Matrix& J_t,
                                      const Matrix& M_J_t) const {
  Vector lambda_t = Vector::Zero(info_.n_lambda_t);
  const Vector v_t = problem_.tangent_jacobian(q).transpose() * v;
  int z = info_.n_mechanical();
  for (const ContactInfo& contact : info_.contacts) {
    if (!contact.is_friction_element) continue;
    const double bound = std::max(-force[z++], 0.0);
    double G = 0;
    for (int d = contact.tangent_index; d < contact.tangent_index + contact.n_t; ++d)
      G = std::max(G, J_t.col(d).dot(M_J_t.col(d)));
    const auto slip = v_t.segment(contact.tangent_index, contact.n_t);
    const double speed = std::max(slip.norm(), H_ * G * bound);
    if (speed > 0) lambda_t.segment(contact.tangent_index, contact.n_t) = -bound / speed * slip;
  }
  return lambda_t;
}

/// (1), with the forces that hold the contacts that are closed, as far as they push. @param lambda  overwritten
Vector StepHomotopy::acceleration(const Vector& q, const Vector& v, Forces& lambda) const {
  const CholeskyFactors M(problem_.mass_matrix(q));
  const Vector force = problem_.force(q, v);
  Vector a = M.solve(force);
  lambda.t.setZero(info_.n_lambda_t);
  if (info_.n_friction_elements > 0) {
    const Matrix J_t = problem_.force_directions(problem_.tangent_jacobian(q)), M_J_t = M.solve_columns(J_t);
    lambda.t = element_friction(q, v, force, J_t, M_J_t);
    a += M_J_t * lambda.t;
  }
  Vector& lambda_n = lambda.n;
  lambda_n.setZero(info_.n_c());
  std::vector<int> closed;
  for (int i = 0; i < info_.n_c(); ++i) {
    if (is_resting_[i]) closed.push_back(i);
  }
  if (closed.empty()) return a;
  const Matrix J = problem_.normal_jacobian(q)(Eigen::all, closed), M_J = M.solve_columns(problem_.force_directions(J));
  const Vector bias = problem_.gap_acceleration_bias(q, v)(closed);
  const Vector forces = least_squares(J.transpose() * M_J, -J.transpose() * a - bias);
  lambda_n(closed) = forces.cwiseMax(0);
  return a + M_J * lambda_n(closed);
}

/// (1) over a time h by one step of the classical Runge-Kutta method.
void StepHomotopy::fly(double h, Vector& q, Vector& v) const {
  Forces ignored;
  const Vector a1 = acceleration(q, v, ignored), v2 = v + h / 2 * a1;
  const Vector a2 = acceleration(q + h / 2 * v, v2, ignored), v3 = v + h / 2 * a2;
  const Vector a3 = acceleration(q + h / 2 * v2, v3, ignored), v4 = v + h * a3;
  const Vector a4 = acceleration(q + h * v3, v4, ignored);
  q += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
  v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
}

/// An element of length h in flight from (q, v), which become its right end.
void StepHomotopy::fly_element(double h, Vector& q, Vector& v, Element& element) const {
  element.h = h;
  element.q0 = q;
  element.v0 = v;
  Forces lambda;
  double c = 0;
  for (int j = 0; j < tableau_.n_s; ++j) {
    fly((tableau_.c[j] - c) * h, q, v);
    c = tableau_.c[j];
    element.q.col(j) = q;
    element.v.col(j) = v;
    element.a.col(j) = acceleration(q, v, lambda);
    element.lambda_n.col(j) = lambda.n;
    element.lambda_t.col(j) = lambda.t;
  }
  fly((1 - c) * h, q, v);
  element.q1 = q;
  element.v1 = v;
}

/// First contact of the flight, or, if it meets none, its nearest approach to one.
StepHomotopy::Approach StepHomotopy::nearest_approach(Vector q, Vector v) const {
  Approach nearest{-1, 0, kInfinity};
  for (int k = 1; k <= kProbes; ++k) {
    const double t = H_ * k / kProbes;
    const Vector before = problem_.gap(q);
    fly(H_ / kProbes, q, v);
    const Vector gap = problem_.gap(q);
    for (int i = 0; i < info_.n_c(); ++i) {
      if (is_resting_[i] || gap[i] >= nearest.gap) continue;
      const double beyond = gap[i] < 0 && before[i] > 0 ? gap[i] / (gap[i] - before[i]) : 0;
      nearest = {i, t - beyond * H_ / kProbes, gap[i]};
    }
    if (nearest.gap <= 0) break;
  }
  return nearest;
}

/// The impact law of one contact by itself. @return its impulse
double StepHomotopy::bounce(int contact, const Vector& q, Vector& v) const {
  const Vector J = problem_.normal_jacobian(q).col(contact);
  const Vector M_J = CholeskyFactors(problem_.mass_matrix(q)).solve_columns(problem_.force_directions(J));
  const double Lambda = (1 + info_.contacts[contact].eps_r) * std::abs(J.dot(v)) / J.dot(M_J);
  v += Lambda * M_J;
  return Lambda;
}

/// Closes a contact that bounces so little that its acceleration brings it back within a time h.
void StepHomotopy::capture(int contact, double h, const Vector& q, Vector& v) {
  Forces ignored;
  const Vector J = problem_.normal_jacobian(q).col(contact);
  if (J.dot(v) + h * J.dot(acceleration(q, v, ignored)) > 0) return;
  is_resting_[contact] = true;
  const Vector M_J = CholeskyFactors(problem_.mass_matrix(q)).solve_columns(problem_.force_directions(J));
  v -= J.dot(v) / J.dot(M_J) * M_J;
}

/// Adds where psi_k changes its sign in a flight from (q, v), which become its end.
void StepHomotopy::add_branch_changes(double from, double to, Vector& q, Vector& v,
                                      std::vector<Boundary>& boundaries) const {
  const auto psi_at = [&] {
    Vector psi(static_cast<Eigen::Index>(info_.switches.size()));
    problem_.switching(q.data(), v.data(), psi.data());
    return psi;
  };
  const double dt = (to - from) / kProbes;
  for (int m = 0; m < kProbes && dt > 0; ++m) {
    const Vector before = psi_at(), q_before = q;
    fly(dt, q, v);
    const Vector after = psi_at();
    const double begin = from + m * dt;
    for (int k = 0; k < equations_.step_functions().size(); ++k) {
      if (info_.switches[static_cast<std::size_t>(k)].is_of_time) {
        const double t = q_before[info_.clock], end = q[info_.clock];
        const double at = first_time_switch(problem_, k, {t, end}, q_before, v);
        if (at < end) boundaries.push_back({begin + at - t, -1});
      } else if (before[k] * after[k] < 0) {
        boundaries.push_back({begin + dt * before[k] / (before[k] - after[k]), -1});
      }
    }
  }
}

/// The first N_FE - 1 boundaries between elements in a step that begins at (q, v).
std::vector<StepHomotopy::Boundary> StepHomotopy::boundaries(const Vector& q, const Vector& v, bool has_impact) const {
  std::vector<Boundary> all;
  const Approach nearest = nearest_approach(q, v);
  has_impact = nearest.contact >= 0 && (has_impact || nearest.gap <= 0);
  const std::size_t most = static_cast<std::size_t>(options_.equations.n_fe) - 1;
  if (side_check_) {
    Vector q_t = q, v_t = v;
    add_branch_changes(0, has_impact ? nearest.t : H_, q_t, v_t, all);
    if (has_impact && nearest.gap > 0 && all.size() >= most) has_impact = false;  // what the flight has goes first
    if (has_impact) {
      bounce(nearest.contact, q_t, v_t);
      add_branch_changes(nearest.t, H_, q_t, v_t, all);
    }
  }
  if (has_impact) all.push_back({nearest.t, nearest.contact});
  std::ranges::sort(all, {}, &Boundary::t);
  all.resize(std::min(all.size(), most));
  for (Boundary& boundary : all) {
    const double margin = (boundary.contact >= 0 ? kMargin : options_.equations.shortest) * H_;
    boundary.t = std::clamp(boundary.t, margin, H_ - margin);
  }
  return all;
}

FesdStep StepHomotopy::flight(bool has_impact) {
  const int n_fe = options_.equations.n_fe;
  FesdStep step;
  step.resize(problem_, tableau_.n_s, n_fe);
  step.n_elements = n_fe;
  Vector q = q_, v = v_;
  step.v_minus.col(0) = v;
  const Vector approach = problem_.normal_jacobian(q).transpose() * v;
  for (int i = 0; i < info_.n_c(); ++i) {
    is_resting_[i] = is_closed_[i] && std::abs(approach[i]) <= kResting;
    if (is_closed_[i] && approach[i] < -kResting) step.Lambda_n(i, 0) = bounce(i, q, v);
  }
  const std::vector<Boundary> between = boundaries(q, v, has_impact);
  const int n_boundaries = static_cast<int>(between.size());
  double begin = 0;
  int first = 0;  // element of the part that begins there
  for (int m = 0; m <= n_boundaries; ++m) {
    const double end = m < n_boundaries ? between[m].t : H_;
    const int next = m < n_boundaries ? std::clamp(static_cast<int>(std::lround(n_fe * end / H_)), first + 1,
                                                   n_fe - (n_boundaries - m))
                                      : n_fe;
    const int hit = m > 0 ? between[m - 1].contact : -1;
    for (int n = first; n < next; ++n) {
      if (n > 0) step.v_minus.col(n) = v;
      const bool is_hit = n == first && hit >= 0;
      if (is_hit) step.Lambda_n(hit, n) = bounce(hit, q, v);
      const Vector v_plus = v;
      if (is_hit) capture(hit, H_ - begin, q, v);
      fly_element((end - begin) / (next - first), q, v, step.elements[n]);
      step.elements[n].v0 = v_plus;
    }
    begin = end;
    first = next;
  }
  return step;
}

}  // namespace ricochet
