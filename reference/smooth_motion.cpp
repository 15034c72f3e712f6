#include "reference/smooth_motion.h"

#include <algorithm>

#include "problems/packed_column.h"

namespace ricochet::reference {
namespace {

int number_of_roots(const Problem& problem) {
  const auto& contacts = problem.info().contacts;
  return problem.n_c() + static_cast<int>(problem.info().region.size()) +
         static_cast<int>(
             std::count_if(contacts.begin(), contacts.end(), [](const auto& contact) { return contact.n_t > 0; }));
}

std::vector<int> curved(const ProblemInfo& info) {
  std::vector<int> curved;
  for (const int i : info.unilateral) {
    if (!info.contacts[i].is_affine) curved.push_back(i);
  }
  return curved;
}

bool has_impulses(const ProblemInfo& info) {
  return info.has_friction() || (info.clock >= 0 && info.n_c() > 0);
}

/// Sizes of the unknowns: q, v, the curved gaps, the normal and the tangential impulses.
Vector sizes(const Problem& problem, const Scales& scales) {
  const auto& info = problem.info();
  std::vector<double> sizes(scales.position().begin(), scales.position().end());
  sizes.insert(sizes.end(), scales.velocity().begin(), scales.velocity().end());
  const Vector gaps = scales.gap(problem.normal_jacobian(info.q0), info.q0);
  for (const int i : curved(info)) sizes.push_back(gaps[i]);
  if (has_impulses(info)) {
    sizes.insert(sizes.end(), scales.impulse().begin(), scales.impulse().end());
    for (int i = 0; i < info.n_c(); ++i) sizes.insert(sizes.end(), info.contacts[i].n_t, scales.impulse()[i]);
  }
  return Eigen::Map<const Vector>(sizes.data(), std::ssize(sizes));
}

/// Time until the first open gap closes with the free accelerations of the start, limited to 1e-3 to 1e-1 of the run
/// [s]: a body between surfaces has the sizes of a flight, however long the run is.
double first_flight(const Problem& problem) {
  const auto& info = problem.info();
  const double T = info.end_time;
  const Matrix J = problem.normal_jacobian(info.q0);
  const Vector gap = problem.gap(info.q0), rate = J.transpose() * info.v0;
  const Vector free = problem.free_acceleration(info.q0, info.v0);
  const Vector a = J.transpose() * free + problem.gap_acceleration_bias(info.q0, info.v0);
  double first = T / 10;
  for (const int i : info.unilateral) {
    const double flight = gap[i] > 0 ? Flights::closing_time(gap[i], rate[i], a[i]) : T;
    first = std::min(first, std::max(flight, T / 1e3));
  }
  return first;
}

}  // namespace

SmoothMotion::SmoothMotion(const Problem& problem, const Scales& scales, const EventLocatedSettings& settings,
                           ContactDynamics& dynamics, const Slips& slips, const Flights& flights)
    : problem_(problem),
      scales_(scales),
      settings_(settings),
      dynamics_(dynamics),
      slips_(slips),
      flights_(flights),
      n_q_(problem.n_q()),
      n_c_(problem.n_c()),
      n_s_(static_cast<int>(problem.info().region.size())),
      n_roots_(number_of_roots(problem)),
      curved_(curved(problem.info())),
      has_impulses_(has_impulses(problem.info())),
      floor_(sizes(problem, Scales(problem, first_flight(problem)))),
      integrator_(settings.integrator(*this)),
      friction_root_(static_cast<std::size_t>(n_c_), -1),
      force_size_(scales.force()) {
  packed_n_.setZero(problem.info().n_normal_entries);
  packed_t_.setZero(problem.info().n_tangent_entries);
  lambda_n_.setZero(n_c_);
  lambda_t_.setZero(problem.info().n_lambda_t);
  a_.setZero(n_q_);
  for (int i = 0, k = n_c_; i < n_c_; ++i) friction_root_[i] = slips_.has_friction(i) ? k++ : -1;
}

void SmoothMotion::error_weights(const double* y, double* weights) const {
  const Eigen::Map<const Vector> state(y, floor_.size());
  Eigen::Map<Vector>(weights, floor_.size()) = (settings_.tolerance * (state.cwiseAbs() + floor_)).cwiseInverse();
}

/// v, v', the rates of curved gaps, the forces.
bool SmoothMotion::rates(const double* y, double* y_dot) {
  std::copy_n(y + n_q_, n_q_, y_dot);
  if (!accelerate(y, y + n_q_, y_dot + n_q_)) return false;
  std::fill(y_dot + 2 * n_q_, y_dot + floor_.size(), 0);
  const auto& info = problem_.info();
  double* gap_rate = y_dot + 2 * n_q_;
  if (!curved_.empty()) problem_.normal_jacobian(y, packed_n_.data());
  for (const int i : curved_) {
    const auto& contact = info.contacts[i];
    const double* J_n = packed_n_.data() + contact.normal_begin;
    *gap_rate++ = is_closed_now(i) ? 0 : packed_dot(contact, J_n, y + n_q_);
  }
  if (!has_impulses_) return true;
  double* lambda = gap_rate;
  for (const int i : dynamics_.closed()) {
    const auto& contact = info.contacts[i];
    lambda[i] = lambda_n_[i];
    std::copy_n(lambda_t_.data() + contact.tangent_index, contact.n_t, lambda + n_c_ + contact.tangent_index);
  }
  return true;
}

bool SmoothMotion::roots(const double* y, double* values) {
  problem_.gap(y, values);  // (1)
  Eigen::Map<Vector>(values, n_c_) += flights_.offset();
  const bool has_friction = problem_.info().has_friction();
  if (has_friction) std::fill_n(values + n_c_, n_roots_ - n_s_ - n_c_, 1);
  if (n_s_ > 0) set_borders(y, y + n_q_, values + n_roots_ - n_s_);
  if (dynamics_.closed().empty()) return true;
  if (!accelerate_for_roots(y)) return false;
  for (const int i : dynamics_.closed()) values[i] = lambda_n_[i];  // (1)
  for (const int i : problem_.info().bilateral) values[i] = 1;
  if (has_friction) set_friction_roots(y, values);
  return true;
}

/// regions.h (1), (2)
void SmoothMotion::set_borders(const double* q, const double* v, double* values) const {
  problem_.switching(q, v, values);
  for (int k = 0; k < n_s_; ++k) {
    const double inside = problem_.info().region[k] * values[k];
    values[k] = std::min(inside + settings_.border_offset[k], settings_.border_limit[k] - inside);
  }
}

int SmoothMotion::border_at_end(StepEnd end) const {
  if (n_s_ == 0 || end != StepEnd::root) return -1;
  std::vector<int> found(static_cast<std::size_t>(n_roots_), 0);
  integrator_->roots_found(found.data());
  for (int k = 0; k < n_s_; ++k) {
    if (found[n_roots_ - n_s_ + k] != 0) return k;
  }
  return -1;
}

double SmoothMotion::inside(int k, const Vector& q, const Vector& v) const {
  Vector psi(n_s_);
  problem_.switching(q.data(), v.data(), psi.data());
  return problem_.info().region[k] * psi[k];
}

int SmoothMotion::border_passed(const Vector& q, const Vector& v) const {
  Vector values(n_s_);
  if (n_s_ > 0) set_borders(q.data(), v.data(), values.data());
  for (int k = 0; k < n_s_; ++k) {
    if (values[k] < 0) return k;
  }
  return -1;
}

/// accelerate(), with the result reused for the same y: integrators evaluate the roots at the end of a step, and
/// StepWatch evaluates them there again.
bool SmoothMotion::accelerate_for_roots(const double* y) {
  if (known_.has && std::equal(known_.y.begin(), known_.y.end(), y)) {
    a_ = known_.a;
    lambda_n_ = known_.lambda_n;
    lambda_t_ = known_.lambda_t;
    return true;
  }
  known_.has = accelerate(y, y + n_q_, a_.data());
  if (known_.has) known_ = {true, Eigen::Map<const Vector>(y, 2 * n_q_), a_, lambda_n_, lambda_t_};
  return known_.has;
}

/// (2) and (3), with the forces of the last accelerate().
void SmoothMotion::set_friction_roots(const double* y, double* values) {
  problem_.tangent_jacobian(y, packed_t_.data());
  for (const int i : dynamics_.closed()) {
    if (dynamics_.modes()[i] == ContactMode::stick)
      values[friction_root_[i]] = cone_slack(i);
    else if (is_slipping(dynamics_.modes()[i]))
      values[friction_root_[i]] = slips_.root(i, packed_t_.data(), y + n_q_);
  }
}

void SmoothMotion::load(Vector& q, Vector& v) const {
  load_from(integrator_->state(), q, v);
}

void SmoothMotion::load(double t, Vector& q, Vector& v) {
  load_from(integrator_->at(t), q, v);
}

/// Flights lower than the errors of the integration may have negative gaps on their way up: a growing gap does not
/// close; a negative and falling one does.
Roots SmoothMotion::roots_at_end(StepEnd end, const Vector& q, const Vector& v) const {
  std::vector<int> found(static_cast<std::size_t>(n_roots_), 0);
  if (end == StepEnd::root) integrator_->roots_found(found.data());
  const Matrix J = problem_.normal_jacobian(q);
  const Vector gap = problem_.gap(q) + flights_.offset(), rate = J.transpose() * v;
  const Vector error = settings_.tolerance * scales_.gap(J, q);
  Roots roots = no_roots();
  for (int i = 0; i < n_c_; ++i) {
    const bool is_lost = flights_.is_low(i) && gap[i] < 0 && gap[i] > -error[i];
    roots.normal[i] = is_closed_now(i) ? found[i] != 0 : rate[i] <= 0 && (found[i] != 0 || is_lost);
    roots.friction[i] = friction_root_[i] >= 0 && found[friction_root_[i]] != 0;
  }
  return roots;
}

void SmoothMotion::note_forces() {
  for (const int i : dynamics_.closed()) force_size_[i] = std::max(force_size_[i], std::abs(lambda_n_[i]));
}

void SmoothMotion::restart(double t, const Vector& q, const Vector& v) {
  known_.has = false;
  double* y = integrator_->state();
  std::copy_n(q.data(), n_q_, y);
  std::copy_n(v.data(), n_q_, y + n_q_);
  // The start values of the impulses are arbitrary. From zero an integrator would limit its first step to lambda h <=
  // tolerance. It would be so short that a gap after an impact does not grow beyond rounding and is a root again.
  std::copy(floor_.begin() + 2 * n_q_, floor_.end(), y + 2 * n_q_);
  const double T = problem_.info().end_time;
  integrator_->restart(t, T, t + flights_.first_step() < T ? flights_.first_step() : 0);
}

void SmoothMotion::count(Counters& counters) const {
  const auto [steps, iterations, factorizations] = integrator_->work();
  counters.steps += steps;
  counters.elements += steps;
  counters.inner_iterations += iterations;
  counters.matrix_factorizations += factorizations;
  counters.force_evaluations = dynamics_.force_evaluations;
  counters.mass_factorizations = dynamics_.mass_factorizations;
}

}  // namespace ricochet::reference
