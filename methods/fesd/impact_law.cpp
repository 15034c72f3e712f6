#include "methods/fesd/impact_law.h"

#include <algorithm>
#include <cmath>

#include "methods/fesd/rounding.h"

namespace ricochet {

ImpactLaw::ImpactLaw(const Problem& problem, const FrictionPolygon& polygon, Counters& counters)
    : problem_(problem),
      polygon_(polygon),
      counters_(counters),
      has_bilateral_(problem.info().has_bilateral()),
      bilateral_(problem) {
  const ProblemInfo& info = problem.info();
  const int n_q = problem.n_q(), n_c = problem.n_c(), n = n_c + info.n_lambda_t;
  friction_.resize(n_c, info.n_lambda_t, polygon);
  touching_.reserve(static_cast<std::size_t>(n_c));
  laws_.reserve(static_cast<std::size_t>(n_c));
  columns_.reserve(static_cast<std::size_t>(n));
  M_.resize(n_q, n_q);
  D_.setZero(n_q, n);
  MD_.setZero(n_q, n);
  if (has_bilateral_) reaction_.setZero(n_c, n);
  G_.resize(n, n);
  packed_n_.resize(info.n_normal_entries);
  packed_t_.resize(info.n_tangent_entries);
  f_.resize(n_q);
  w_.setZero(n_q);
  bias_.resize(n_c);
  T_.resize(info.n_lambda_t, n_q);
  b_.resize(n);
  r_.resize(n);
  if (info.structure.constant_mass) {
    problem.mass_matrix(info.q0.data(), M_.data());
    llt_.compute(M_);
    ++counters_.mass_factorizations;
  }
}

bool ImpactLaw::prepare(const Vector& q, std::span<const int> touching) {
  if (!problem_.info().structure.constant_mass) {
    problem_.mass_matrix(q.data(), M_.data());
    llt_.compute(M_);
    ++counters_.mass_factorizations;
    if (llt_.info() != Eigen::Success) return false;
  }
  touching_.assign(touching.begin(), touching.end());
  problem_.normal_jacobian(q.data(), packed_n_.data());
  if (problem_.info().has_friction()) problem_.tangent_jacobian(q.data(), packed_t_.data());
  const auto solve = [&](auto column) {
    llt_.solveInPlace(column);
    ++counters_.linear_solves;
  };
  if (has_bilateral_ && !bilateral_.prepare(packed_n_.data(), solve)) return false;
  const auto set_column = [&](int column, const ContactInfo& contact, const double* entries) {
    D_.col(column).setZero();
    for (const int row : contact.support) D_(row, column) = *entries++;
    MD_.col(column) = D_.col(column);
    solve(MD_.col(column));
    if (has_bilateral_) bilateral_.impose(MD_.col(column), nullptr, reaction_.col(column));
    return entries;
  };
  for (const int i : touching_) {
    const auto& contact = problem_.info().contacts[i];
    set_column(i, contact, packed_n_.data() + contact.normal_begin);
    const double* entries = packed_t_.data() + contact.tangent_begin;
    for (int d = 0; d < contact.n_t; ++d) entries = set_column(tangent_column(contact, d), contact, entries);
  }
  return true;
}

double ImpactLaw::sliding_delassus(int contact, const double* direction) const {
  const auto& info = problem_.info().contacts[contact];
  double entry = D_.col(contact).dot(MD_.col(contact));
  for (int d = 0; d < info.n_t; ++d)
    entry -= info.mu * direction[d] * D_.col(contact).dot(MD_.col(tangent_column(info, d)));
  return entry;
}

void ImpactLaw::slip_velocity(int contact, const Eigen::Ref<const Vector>& v, double* v_t) const {
  const auto& info = problem_.info().contacts[contact];
  for (int d = 0; d < info.n_t; ++d) v_t[d] = D_.col(tangent_column(info, d)).dot(v);
}

void ImpactLaw::set_slide(Closed& closed, const Eigen::Ref<const Vector>& v, double rounding) const {
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

void ImpactLaw::set_vertex(Closed& closed, int vertex) const {
  const auto d = polygon_.vertex(vertex);
  closed.slides = true;
  closed.is_on_edge = false;
  closed.facet = vertex;
  for (int k = 0; k < 2; ++k) closed.direction[k] = -d[k];
}

void ImpactLaw::set_edge(Closed& closed, int edge) const {
  set_vertex(closed, edge);
  closed.is_on_edge = true;
}

double ImpactLaw::slip_velocity_scale(int contact, const Eigen::Ref<const Vector>& v) const {
  const auto& info = problem_.info().contacts[contact];
  double scale = 0;
  for (int d = 0; d < info.n_t; ++d)
    scale = std::max(scale, D_.col(tangent_column(info, d)).cwiseAbs().dot(v.cwiseAbs()));
  return scale;
}

void ImpactLaw::add_contact(int contact) {
  const auto& info = problem_.info().contacts[contact];
  laws_.push_back({.mu = info.mu, .n_t = info.n_t});
  columns_.push_back(contact);
  for (int d = 0; d < info.n_t; ++d) columns_.push_back(tangent_column(info, d));
}

void ImpactLaw::delassus() {
  for (std::size_t r = 0; r < columns_.size(); ++r) {
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      G_(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = D_.col(columns_[r]).dot(MD_.col(columns_[c]));
    }
  }
}

/// Adds what the first n entries of r_ do to a velocity or acceleration, and the reaction of the bilateral constraints.
void ImpactLaw::apply(Eigen::Index n, Eigen::Ref<Vector> motion, Eigen::Ref<Vector> normal) const {
  for (Eigen::Index k = 0; k < n; ++k) motion += r_[k] * MD_.col(columns_[k]);
  if (!has_bilateral_) return;
  for (const int i : problem_.info().bilateral) {
    for (Eigen::Index k = 0; k < n; ++k) normal[i] += r_[k] * reaction_(i, columns_[k]);
  }
}

LcpStatus ImpactLaw::impact(Eigen::Ref<Vector> v, Eigen::Ref<Vector> Lambda_n, Eigen::Ref<Vector> Lambda_t) {
  laws_.clear();
  columns_.clear();
  for (const int i : touching_) add_contact(i);
  delassus();
  const auto n = static_cast<Eigen::Index>(columns_.size());
  Eigen::Index row = 0;
  double size = 0;
  for (const int i : touching_) {
    const auto& contact = problem_.info().contacts[i];
    size = std::max({size, normal_velocity_scale(i, v), slip_velocity_scale(i, v)});
    b_[row++] = (1 + contact.eps_r) * D_.col(i).dot(v);
    for (int d = 0; d < contact.n_t; ++d) b_[row++] = D_.col(tangent_column(contact, d)).dot(v);
  }
  const LcpStatus status =
      friction_.solve(G_.topLeftCorner(n, n), b_.head(n), kVelocityRounding * size, laws_, r_.head(n));
  ++counters_.complementarity_solves;
  counters_.pivots += friction_.pivots();
  if (status != LcpStatus::solved) return status;
  if (has_bilateral_) bilateral_.impose(v, nullptr, Lambda_n);
  apply(n, v, Lambda_n);
  row = 0;
  for (const int i : touching_) {
    const auto& contact = problem_.info().contacts[i];
    Lambda_n[i] = r_[row++];
    for (int d = 0; d < contact.n_t; ++d) Lambda_t[contact.tangent_index + d] = r_[row++];
  }
  return status;
}

const Vector& ImpactLaw::free_acceleration(const Vector& q, const Vector& v) {
  problem_.force(q.data(), v.data(), problem_.info().u.data(), f_.data());
  ++counters_.force_evaluations;
  w_ = f_;
  llt_.solveInPlace(w_);
  ++counters_.linear_solves;
  return w_;
}

LcpStatus ImpactLaw::contact_forces(const Vector& q, const Vector& v, std::span<Closed> closed,
                                    Eigen::Ref<Vector> lambda_n, Eigen::Ref<Vector> lambda_t) {
  free_acceleration(q, v);
  problem_.gap_acceleration_bias(q.data(), v.data(), bias_.data());
  if (problem_.info().has_friction()) problem_.slip_velocity_derivative(q.data(), v.data(), T_.data());
  if (has_bilateral_) bilateral_.impose(w_, bias_.data(), lambda_n);
  if (closed.empty()) return LcpStatus::solved;

  laws_.clear();
  columns_.clear();
  Eigen::Index row = 0;
  double size = 0;
  for (const Closed& c : closed) {
    size = std::max({size, normal_velocity_scale(c.contact, w_), slip_velocity_scale(c.contact, w_)});
    add_contact(c.contact);
    laws_.back().slides = c.slides;
    laws_.back().is_on_edge = c.is_on_edge;
    laws_.back().facet = c.facet;
    std::copy_n(c.direction, 2, laws_.back().direction);
    const auto& contact = problem_.info().contacts[c.contact];
    b_[row++] = D_.col(c.contact).dot(w_) + bias_[c.contact];
    for (int d = 0; d < contact.n_t; ++d)
      b_[row++] = D_.col(tangent_column(contact, d)).dot(w_) + T_.row(contact.tangent_index + d).dot(v);
  }
  delassus();
  const auto n = static_cast<Eigen::Index>(columns_.size());
  const LcpStatus status =
      friction_.solve(G_.topLeftCorner(n, n), b_.head(n), kVelocityRounding * size, laws_, r_.head(n));
  ++counters_.complementarity_solves;
  counters_.pivots += friction_.pivots();
  if (status != LcpStatus::solved) return status;
  row = 0;
  for (std::size_t k = 0; k < closed.size(); ++k) {
    const auto& contact = problem_.info().contacts[closed[k].contact];
    closed[k].mode = laws_[k].mode;
    closed[k].facet = laws_[k].facet;
    lambda_n[closed[k].contact] = r_[row++];
    for (int d = 0; d < contact.n_t; ++d) lambda_t[contact.tangent_index + d] = r_[row++];
  }
  apply(n, w_, lambda_n);
  return status;
}

}  // namespace ricochet
