#include "methods/contact_laws/impact_solver.h"

#include <algorithm>
#include <cmath>

#include "methods/contact_laws/impact_laws/stated_impact.h"
#include "problems/dense_solve.h"

namespace ricochet {
namespace {

// Contacts up to which an island does not predict their modes: where friction admits several solutions, Lemke's method
// chooses.
constexpr std::size_t kMaxUnpredicted = 8;
// Largest error of the velocities that an impact makes zero, relative to those before it.
constexpr double kResidual = 1e-11;
// Time until the next moment, at which a contact without a load is decided, as a fraction of the end time.
constexpr double kNextMoment = 1e-8;

}  // namespace

ImpactSolver::ImpactSolver(const Problem& problem, const FrictionPolygon& polygon, const ContactScales& scales,
                           Counters& counters)
    : problem_(problem),
      polygon_(polygon),
      scales_(scales),
      counters_(counters),
      has_bilateral_(problem.info().has_bilateral()),
      mass_inverse_(problem, counters),
      operator_(problem) {
  const ProblemInfo& info = problem.info();
  const int n_q = problem.n_q(), n_c = problem.n_c(), n = n_c + info.n_lambda_t;
  const int few = std::min(n_c, static_cast<int>(kMaxUnpredicted));
  // A single contact is solved in closed form, unless it is in space: solve() makes room where it needs some.
  const bool is_alone = n_c == 1 && info.n_lambda_t <= 1;
  friction_.resize(is_alone ? 0 : few, is_alone ? 0 : std::min(2 * few, info.n_lambda_t), polygon);
  for (auto* list : {&contacts_, &contacts_of_island_}) list->reserve(n_c);
  islands_.reserve(n_c);
  laws_.reserve(n_c);
  f_.resize(n_q);
  w_.setZero(n_q);
  size_.setZero(n_q);
  bias_.resize(n_c);
  load_size_.setZero(n_c);
  for (const auto& contact : info.contacts)
    has_turning_friction_ = has_turning_friction_ || (contact.n_t > 0 && !contact.is_affine);
  if (has_turning_friction_) T_.resize(info.n_lambda_t, n_q);
  eps_r_.setZero(n_c);
  b_.resize(n);
  r_.resize(n);
}

bool ImpactSolver::prepare(const Vector& q, std::span<const int> touching) {
  if (!mass_inverse_.set_position(q)) return false;
  operator_.set_directions(q, touching);
  return operator_.set_responses(touching, mass_inverse_);
}

void ImpactSolver::keep_islands_of(std::span<const int> some, std::vector<int>& contacts) {
  operator_.find_islands(contacts, islands_);
  has_some_.assign(static_cast<std::size_t>(islands_.count()), 0);
  for (int k = 0; k < islands_.n(); ++k) {
    if (std::ranges::binary_search(some, contacts[k])) has_some_[islands_.of(k)] = 1;
  }
  int k = 0;
  std::erase_if(contacts, [&](int) { return !has_some_[islands_.of(k++)]; });
}

double ImpactSolver::tangential_delassus(int contact) const {
  double largest = 0;
  for (int d = 1; d <= n_t(contact); ++d) largest = std::max(largest, operator_.own_delassus(contact, d, d));
  return largest;
}

double ImpactSolver::sliding_delassus(int contact, const double* direction) const {
  double entry = operator_.own_delassus(contact, 0, 0);
  for (int d = 0; d < n_t(contact); ++d)
    entry -= problem_.info().contacts[contact].mu * direction[d] * operator_.own_delassus(contact, 0, 1 + d);
  return entry;
}

void ImpactSolver::slip_velocity(int contact, const Eigen::Ref<const Vector>& v, double* v_t) const {
  for (int d = 0; d < n_t(contact); ++d) v_t[d] = operator_.dot(contact, 1 + d, v);
}

void ImpactSolver::set_slide(ClosedContact& closed, const Eigen::Ref<const Vector>& v, double rounding) const {
  double v_t[2]{0, 0};
  slip_velocity(closed.contact, v, v_t);
  const double speed = std::hypot(v_t[0], v_t[1]);
  closed.slides = speed > rounding;
  if (!closed.slides) return;
  for (int d = 0; d < 2; ++d) closed.direction[d] = v_t[d] / speed;
  if (!polygon_.applies(problem_.info().contacts[closed.contact].n_t)) return;
  const int vertex = polygon_.most_dissipative(v_t);
  set_vertex(closed, vertex);
  for (const int edge : {vertex, polygon_.previous(vertex)}) {
    const auto e = polygon_.edge(edge);
    if (std::abs(e[0] * v_t[0] + e[1] * v_t[1]) <= rounding) set_edge(closed, edge);
  }
}

void ImpactSolver::set_vertex(ClosedContact& closed, int vertex) const {
  const auto d = polygon_.vertex(vertex);
  closed.slides = true;
  closed.is_on_edge = false;
  closed.facet = vertex;
  for (int k = 0; k < 2; ++k) closed.direction[k] = -d[k];
}

void ImpactSolver::set_edge(ClosedContact& closed, int edge) const {
  set_vertex(closed, edge);
  closed.is_on_edge = true;
}

double ImpactSolver::slip_velocity_scale(int contact, const Eigen::Ref<const Vector>& v) const {
  double scale = 0;
  for (int d = 0; d < n_t(contact); ++d) scale = std::max(scale, operator_.terms(contact, 1 + d, v));
  return scale;
}

void ImpactSolver::set_contacts_of(int island) {
  contacts_of_island_.clear();
  for (const int member : islands_.members(island)) contacts_of_island_.push_back(contacts_[member]);
}

/// Impulses or forces r_ of the island at hand, for b_ and laws_.
LcpStatus ImpactSolver::solve_island(double rounding) {
  operator_.assemble(contacts_of_island_, delassus_);
  const Eigen::Index n = delassus_.n_rows();
  ++counters_.complementarity_solves;
  const bool may_predict = std::ranges::none_of(laws_, [&](const auto& law) { return polygon_.applies(law.n_t); });
  if (laws_.size() > kMaxUnpredicted && may_predict &&
      prediction_.solve(delassus_, b_.head(n), rounding, laws_, r_.head(n)))
    return LcpStatus::solved;
  if (G_.rows() < n) G_.resize(n, n);
  delassus_.to_dense(G_);
  const LcpStatus status = friction_.solve(G_.topLeftCorner(n, n), b_.head(n), rounding, laws_, r_.head(n));
  counters_.pivots += friction_.pivots();
  return status;
}

/// Impulses r_ of the island at hand by the law that the scene states.
LcpStatus ImpactSolver::solve_stated(const Eigen::Ref<const Vector>& v) {
  operator_.assemble(contacts_of_island_, delassus_);
  const Eigen::Index n = delassus_.n_rows();
  if (G_.rows() < n) G_.resize(n, n);
  delassus_.to_dense(G_);
  Eigen::Index row = 0;
  for (const int i : contacts_of_island_) {
    for (int d = 0; d <= n_t(i); ++d) b_[row++] = operator_.dot(i, d, v);
  }
  return stated_impact(problem_.info(), contacts_of_island_, G_.topLeftCorner(n, n), b_.head(n), r_.head(n));
}

/// Adds what r_ of the island at hand does to a velocity or acceleration, and to the bilateral constraints.
void ImpactSolver::push(Eigen::Ref<Vector> motion, Eigen::Ref<Vector> normal) const {
  const double* r = r_.data();
  for (const int i : contacts_of_island_) {
    for (int d = 0; d <= n_t(i); ++d) operator_.push(i, d, *r++, motion, normal);
  }
}

/// The velocity that an impact should make zero and does not, in direction d of the k-th contact of the island [m/s].
/// @param row  of that contact in b_
double ImpactSolver::residual(int k, int row, int d, const Eigen::Ref<const Vector>& v) const {
  const int i = contacts_of_island_[k];
  const double e = eps_r_[i];
  return operator_.dot(i, d, v) + (d == 0 ? e / (1 + e) * b_[row] : 0);  // b_n = (1 + e) J_n' v-
}

bool ImpactSolver::has_residual(const Eigen::Ref<const Vector>& v) const {
  const double allowed = kResidual * b_.head(delassus_.n_rows()).cwiseAbs().maxCoeff();
  for (std::size_t k = 0, row = 0; k < laws_.size(); row += 1 + laws_[k++].n_t) {
    if (is_closed(laws_[k].mode) && std::abs(residual(k, row, 0, v)) > allowed) return true;
  }
  return false;
}

/// Impulses of very different masses are known to rounding times the ratio of masses, and b - G r no better than they
/// are. The velocities J' v that they make are exact, so that an equation for a correction has an exact right side: a
/// step of iterative refinement, which keeps the modes. It allocates.
void ImpactSolver::refine(Eigen::Ref<Vector> v, Eigen::Ref<Vector> Lambda_n) {
  const Eigen::Index n = delassus_.n_rows();
  if (G_.rows() < n) G_.resize(n, n);
  delassus_.to_dense(G_);
  std::vector<int> rows;
  Matrix directions = Matrix::Zero(n, n);  // of the unknowns
  Vector left(n);
  for (std::size_t k = 0, row = 0; k < laws_.size(); row += 1 + laws_[k++].n_t) {
    if (!is_closed(laws_[k].mode)) continue;
    const auto r_k = r_.segment(row, 1 + laws_[k].n_t);
    for (int d = 0; d <= (laws_[k].mode == ContactMode::stick ? laws_[k].n_t : 0); ++d) {
      const auto column = static_cast<Eigen::Index>(rows.size());
      rows.push_back(static_cast<int>(row) + d);
      directions(row + d, column) = 1;
      left[column] = residual(k, row, d, v);
      if (is_slipping(laws_[k].mode)) directions.col(column).segment(row, r_k.size()) = r_k / r_k[0];
    }
  }
  const auto count = static_cast<Eigen::Index>(rows.size());
  const auto D = directions.leftCols(count);
  const Matrix A = (G_.topLeftCorner(n, n) * D)(rows, Eigen::all);
  const Vector r = r_.head(n), correction = -(D * least_squares(A, left.head(count)));
  r_.head(n) = correction;
  push(v, Lambda_n);
  r_.head(n) += r;
}

const Vector& ImpactSolver::impulse_size(std::span<const int> together, const Eigen::Ref<const Vector>& Lambda_n,
                                         const Eigen::Ref<const Vector>& Lambda_t) {
  size_.setZero();
  for (const int i : together) {
    for (int d = 0; d <= n_t(i); ++d) {
      const double impulse = d == 0 ? Lambda_n[i] : Lambda_t[problem_.info().contacts[i].tangent_index + d - 1];
      operator_.add_size(i, d, impulse, size_);
    }
  }
  return size_;
}

LcpStatus ImpactSolver::impact(std::span<const int> together, std::span<const int> approaching, Eigen::Ref<Vector> v,
                               Eigen::Ref<Vector> Lambda_n, Eigen::Ref<Vector> Lambda_t, Rebound rebound) {
  contacts_.assign(together.begin(), together.end());
  operator_.find_islands(contacts_, islands_);
  for (int island = 0; island < islands_.count(); ++island) {
    set_contacts_of(island);
    const bool must_bounce =
        std::ranges::any_of(contacts_of_island_, [&](int i) { return std::ranges::binary_search(approaching, i); });
    if (!must_bounce) continue;
    laws_.clear();
    Eigen::Index row = 0;
    double size = 0;
    for (const int i : contacts_of_island_) {
      const auto& contact = problem_.info().contacts[i];
      laws_.push_back({.mu = contact.mu, .n_t = contact.n_t});
      size = std::max({size, scales_.approach(i), scales_.slip(i)});
      for (int d = 0; d <= contact.n_t; ++d) {
        const double rate = operator_.dot(i, d, v);
        if (d == 0) eps_r_[i] = rebound == Rebound::none ? 0 : contact.restitution(rate);
        b_[row++] = d == 0 ? (1 + eps_r_[i]) * rate : rate;
      }
    }
    const bool is_newton =
        rebound == Rebound::none || problem_.info().impact_law.hypothesis == ImpactHypothesis::newton;
    LcpStatus status = is_newton ? solve_island(ContactScales::kVelocityRounding * size) : solve_stated(v);
    if (const double allowed = scales_.redundant() * size; status != LcpStatus::solved && is_newton && allowed > 0) {
      if (b_.head(row).minCoeff() >= -allowed) continue;  // rates that contradict each other, and are none
      status = solve_island(allowed);
    }
    if (status != LcpStatus::solved) return status;
    if (has_bilateral_) operator_.bilateral().impose(v, nullptr, Lambda_n);
    push(v, Lambda_n);
    if (is_newton && laws_.size() > 1 && has_residual(v)) refine(v, Lambda_n);
    const double* r = r_.data();
    for (const int i : contacts_of_island_) {
      const auto& contact = problem_.info().contacts[i];
      Lambda_n[i] = *r++;
      for (int d = 0; d < contact.n_t; ++d) Lambda_t[contact.tangent_index + d] = *r++;
    }
  }
  return LcpStatus::solved;
}

const Vector& ImpactSolver::free_acceleration(const Vector& q, const Vector& v) {
  problem_.force(q.data(), v.data(), problem_.info().u.data(), f_.data());
  ++counters_.force_evaluations;
  w_ = f_;
  mass_inverse_.solve_in_place(w_);
  return w_;
}

LcpStatus ImpactSolver::contact_forces(const Vector& q, const Vector& v, std::span<ClosedContact> closed,
                                       Eigen::Ref<Vector> lambda_n, Eigen::Ref<Vector> lambda_t) {
  free_acceleration(q, v);
  contacts_.clear();
  for (const ClosedContact& c : closed) contacts_.push_back(c.contact);
  problem_.gap_acceleration_bias_of(contacts_, q.data(), v.data(), bias_.data());
  if (has_bilateral_) problem_.gap_acceleration_bias_of(problem_.info().bilateral, q.data(), v.data(), bias_.data());
  if (has_turning_friction_) problem_.slip_velocity_derivative(q.data(), v.data(), T_.data());
  if (has_bilateral_) operator_.bilateral().impose(w_, bias_.data(), lambda_n);
  for (const ClosedContact& c : closed) {
    load_size_[c.contact] = normal_velocity_scale(c.contact, w_) + std::abs(bias_[c.contact]);
  }
  operator_.find_islands(contacts_, islands_);
  for (int island = 0; island < islands_.count(); ++island) {
    const auto members = islands_.members(island);
    set_contacts_of(island);
    laws_.clear();
    Eigen::Index row = 0;
    double size = 0;
    for (const int member : members) {
      const ClosedContact& c = closed[member];
      const auto& contact = problem_.info().contacts[c.contact];
      laws_.push_back({.mu = contact.mu,
                       .n_t = contact.n_t,
                       .slides = c.slides,
                       .direction = {c.direction[0], c.direction[1]},
                       .is_on_edge = c.is_on_edge,
                       .facet = c.facet});
      size = std::max({size, load_size_[c.contact], slip_velocity_scale(c.contact, w_)});
      b_[row++] = operator_.dot(c.contact, 0, w_) + bias_[c.contact];
      for (int d = 0; d < contact.n_t; ++d) {
        b_[row] = operator_.dot(c.contact, 1 + d, w_);
        for (std::size_t s = 0; s < contact.support.size() && !contact.is_affine; ++s)
          b_[row] += T_(contact.tangent_index + d, contact.support[s]) * v[contact.support[s]];
        ++row;
      }
    }
    const bool is_newton = problem_.info().impact_law.hypothesis == ImpactHypothesis::newton;
    LcpStatus status = is_newton ? solve_island(ContactScales::kVelocityRounding * size) : solve_stated(v);
    if (status != LcpStatus::solved && is_newton && scales_.redundant() > 0)
      status = solve_island(scales_.redundant() * size);
    if (status != LcpStatus::solved) return status;
    const double* r = r_.data();
    for (std::size_t k = 0; k < members.size(); ++k) {
      ClosedContact& c = closed[members[k]];
      const auto& contact = problem_.info().contacts[c.contact];
      c.mode = laws_[k].mode;
      c.facet = laws_[k].facet;
      // Bodies that fall together need no force, and rounding is none.
      if (r[0] * normal_delassus(c.contact) <= ContactScales::kStageRounding * load_size_[c.contact])
        c.mode = ContactMode::open;
      lambda_n[c.contact] = *r++;
      for (int d = 0; d < contact.n_t; ++d) lambda_t[contact.tangent_index + d] = *r++;
    }
    push(w_, lambda_n);
  }
  return LcpStatus::solved;
}

void ImpactSolver::decide_unloaded(const Vector& q, const Vector& v, std::span<ClosedContact> closed,
                                   Eigen::Ref<Vector> lambda_n, Eigen::Ref<Vector> lambda_t) {
  const auto is_unloaded = [&](const ClosedContact& c) {
    return c.mode == ContactMode::open && !is_pulled_apart(c.contact);
  };
  if (std::ranges::none_of(closed, is_unloaded)) return;
  NextMoment& next = next_moment_;
  next.is_unloaded.clear();
  for (const ClosedContact& c : closed) next.is_unloaded.push_back(is_unloaded(c));
  next.closed.assign(closed.begin(), closed.end());
  next.w = w_;
  next.bias = bias_;
  next.load_size = load_size_;
  next.lambda_n = lambda_n;
  next.lambda_t = lambda_t;
  const double dt = kNextMoment * problem_.info().end_time;
  next.q = q + dt * v;
  next.v = v + dt * w_;
  const LcpStatus status = contact_forces(next.q, next.v, next.closed, next.lambda_n, next.lambda_t);
  for (std::size_t k = 0; k < closed.size() && status == LcpStatus::solved; ++k) {
    const int i = closed[k].contact;
    if (!next.is_unloaded[k] || !is_closed(next.closed[k].mode)) continue;
    closed[k].mode = next.closed[k].mode;
    closed[k].facet = next.closed[k].facet;
    lambda_n[i] = next.lambda_n[i];
    const auto& contact = problem_.info().contacts[i];
    for (int d = contact.tangent_index; d < contact.tangent_index + contact.n_t; ++d) lambda_t[d] = next.lambda_t[d];
  }
  w_ = next.w;
  bias_ = next.bias;
  load_size_ = next.load_size;
}

}  // namespace ricochet
