#include "methods/contact_laws/impact_law.h"

#include <algorithm>
#include <cmath>

#include "problems/packed_column.h"

namespace ricochet {
namespace {

// Contacts up to which a group does not predict their modes: where friction admits several solutions, Lemke's method
// chooses.
constexpr std::size_t kMaxUnpredicted = 8;

}  // namespace

ImpactLaw::ImpactLaw(const Problem& problem, const FrictionPolygon& polygon, const ContactScales& scales,
                     Counters& counters)
    : problem_(problem),
      polygon_(polygon),
      scales_(scales),
      counters_(counters),
      has_bilateral_(problem.info().has_bilateral()),
      bilateral_(problem) {
  const ProblemInfo& info = problem.info();
  const int n_q = problem.n_q(), n_c = problem.n_c(), n = n_c + info.n_lambda_t;
  const int few = std::min(n_c, static_cast<int>(kMaxUnpredicted));
  friction_.resize(few, std::min(2 * few, info.n_lambda_t), polygon);
  for (auto* list : {&touching_, &contacts_, &grouped_, &sizes_, &neighbours_, &cursor_}) list->reserve(n_c);
  group_begin_.reserve(n_c + 1);
  groups_.reserve(n_c);
  laws_.reserve(n_c);
  M_.resize(n_q, n_q);
  packed_n_.resize(info.n_normal_entries);
  packed_t_.resize(info.n_tangent_entries);
  find_moved();
  if (has_bilateral_) reaction_.setZero(n_c, n);
  f_.resize(n_q);
  w_.setZero(n_q);
  size_.setZero(n_q);
  column_.setZero(n_q);
  scatter_.setZero(n_q);
  visitor_.assign(n_q, -1);
  visitors_.resize(n_q);
  bias_.resize(n_c);
  load_size_.setZero(n_c);
  for (const auto& contact : info.contacts)
    has_turning_friction_ = has_turning_friction_ || (contact.n_t > 0 && !contact.is_affine);
  if (has_turning_friction_) T_.resize(info.n_lambda_t, n_q);
  b_.resize(n);
  r_.resize(n);
  if (info.structure.constant_mass) set_mass(info.q0);
}

/// The coordinates that an impulse of each contact moves: those that M couples with its support, or all of them where
/// bilateral constraints do.
void ImpactLaw::find_moved() {
  const ProblemInfo& info = problem_.info();
  DisjointSets sets(info.n_q);
  if (!info.structure.diagonal_mass) sets.join(info.structure.couplings);
  if (has_bilateral_) sets.join_all();
  std::vector<std::vector<int>> members(info.n_q);
  for (int k = 0; k < info.n_q; ++k) members[sets.of(k)].push_back(k);
  moved_begin_.assign(1, 0);
  Eigen::Index effects = 0;
  for (const auto& contact : info.contacts) {
    std::vector<int> parts;
    for (const int k : contact.pushed()) parts.push_back(sets.of(k));
    std::sort(parts.begin(), parts.end());
    parts.erase(std::unique(parts.begin(), parts.end()), parts.end());
    const auto begin = static_cast<std::ptrdiff_t>(moved_.size());
    for (const int part : parts) moved_.insert(moved_.end(), members[part].begin(), members[part].end());
    std::sort(moved_.begin() + begin, moved_.end());
    for (const int k : contact.support)
      support_in_moved_.push_back(
          static_cast<int>(std::lower_bound(moved_.begin() + begin, moved_.end(), k) - moved_.begin() - begin));
    moved_begin_.push_back(static_cast<int>(moved_.size()));
    effect_begin_.push_back(static_cast<int>(effects));
    effects += (1 + contact.n_t) * (moved_begin_.back() - static_cast<Eigen::Index>(begin));
  }
  effects_.setZero(effects);
}

bool ImpactLaw::set_mass(const Vector& q) {
  problem_.mass_matrix(q.data(), M_.data());
  ++counters_.mass_factorizations;
  if (problem_.info().structure.diagonal_mass) return (M_.diagonal().array() > 0).all();
  llt_.compute(M_);
  return llt_.info() == Eigen::Success;
}

void ImpactLaw::solve_mass(Eigen::Ref<Vector> x) {
  ++counters_.linear_solves;
  if (problem_.info().structure.diagonal_mass)
    x.array() /= M_.diagonal().array();
  else
    llt_.solveInPlace(x);
}

bool ImpactLaw::prepare(const Vector& q, std::span<const int> touching) {
  if (!problem_.info().structure.constant_mass && !set_mass(q)) return false;
  touching_.assign(touching.begin(), touching.end());
  problem_.normal_jacobian(q.data(), packed_n_.data());
  if (problem_.info().has_friction()) problem_.tangent_jacobian(q.data(), packed_t_.data());
  if (has_bilateral_ && !bilateral_.prepare(packed_n_.data(), [&](auto column) { solve_mass(column); })) return false;
  const bool is_diagonal = problem_.info().structure.diagonal_mass && !has_bilateral_;
  for (const int i : touching_) {
    const auto& contact = problem_.info().contacts[i];
    double* entry = effects_.data() + effect_begin_[i];
    for (int d = 0; d <= contact.n_t; ++d) {
      const double* J = column(i, d);
      if (is_diagonal) {
        for (const int at : contact.pushed()) *entry++ = *J++ / M_(at, at);
        ++counters_.linear_solves;
        continue;
      }
      column_.setZero();
      for (const int at : contact.pushed()) column_[at] = *J++;
      solve_mass(column_);
      const int tangent = problem_.n_c() + contact.tangent_index + d - 1;
      if (has_bilateral_) bilateral_.impose(column_, nullptr, reaction_.col(d == 0 ? i : tangent));
      for (int s = 0; s < n_moved(i); ++s) *entry++ = column_[moved(i)[s]];
    }
  }
  return true;
}

double ImpactLaw::dot(int contact, int d, const Eigen::Ref<const Vector>& x) const {
  return packed_dot(problem_.info().contacts[contact], column(contact, d), x);
}

double ImpactLaw::terms(int contact, int d, const Eigen::Ref<const Vector>& x) const {
  return packed_terms(problem_.info().contacts[contact], column(contact, d), x);
}

/// D_row' P M^-1 D_d of a contact
double ImpactLaw::own_delassus(int contact, int row, int d) const {
  const auto& info = problem_.info().contacts[contact];
  const double *J = column(contact, row), *response = effect(contact, d);
  double sum = 0;
  for (std::size_t s = 0; s < info.pushed().size(); ++s)
    sum += J[s] * response[support_in_moved_[info.normal_begin + s]];
  return sum;
}

double ImpactLaw::mobility(int contact) const {
  double largest = 0;
  for (int d = 1; d <= n_t(contact); ++d) largest = std::max(largest, own_delassus(contact, d, d));
  return largest;
}

double ImpactLaw::sliding_delassus(int contact, const double* direction) const {
  double entry = own_delassus(contact, 0, 0);
  for (int d = 0; d < n_t(contact); ++d)
    entry -= problem_.info().contacts[contact].mu * direction[d] * own_delassus(contact, 0, 1 + d);
  return entry;
}

void ImpactLaw::slip_velocity(int contact, const Eigen::Ref<const Vector>& v, double* v_t) const {
  for (int d = 0; d < n_t(contact); ++d) v_t[d] = dot(contact, 1 + d, v);
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
  double scale = 0;
  for (int d = 0; d < n_t(contact); ++d) scale = std::max(scale, terms(contact, 1 + d, v));
  return scale;
}

/// Groups of contacts_ that share a coordinate they move.
void ImpactLaw::set_groups() {
  const int n = static_cast<int>(contacts_.size());
  groups_.reset(n);
  for (int k = 0; k < n; ++k) {
    for (int s = 0; s < n_moved(contacts_[k]); ++s) {
      int& visitor = visitor_[moved(contacts_[k])[s]];
      if (visitor >= 0) groups_.join(k, visitor);
      visitor = k;
    }
  }
  for (const int i : contacts_) {
    for (int s = 0; s < n_moved(i); ++s) visitor_[moved(i)[s]] = -1;
  }
  // Counting sort by the least number of each group.
  cursor_.assign(n, 0);
  for (int k = 0; k < n; ++k) ++cursor_[groups_.of(k)];
  group_begin_.assign(1, 0);
  for (int k = 0; k < n; ++k) {
    if (groups_.of(k) != k) continue;
    const int size = cursor_[k];
    cursor_[k] = group_begin_.back();
    group_begin_.push_back(group_begin_.back() + size);
  }
  grouped_.resize(n);
  for (int k = 0; k < n; ++k) grouped_[cursor_[groups_.of(k)]++] = k;
}

/// G of members of contacts_, in their order.
void ImpactLaw::set_delassus(std::span<const int> members) {
  const int n = static_cast<int>(members.size());
  sizes_.clear();
  for (int k = 0; k < n; ++k) {
    const int i = contacts_[members[k]];
    sizes_.push_back(1 + n_t(i));
    for (int s = 0; s < n_moved(i); ++s) visitors_[moved(i)[s]].push_back(k);
  }
  delassus_.set_sizes(sizes_);
  for (const int member : members) {
    neighbours_.clear();
    for (const int at : problem_.info().contacts[contacts_[member]].pushed())
      neighbours_.insert(neighbours_.end(), visitors_[at].begin(), visitors_[at].end());
    std::sort(neighbours_.begin(), neighbours_.end());
    neighbours_.erase(std::unique(neighbours_.begin(), neighbours_.end()), neighbours_.end());
    delassus_.add_row(neighbours_);
  }
  const auto contact = [&](int k) { return contacts_[members[k]]; };
  const auto begin = [&](int k, int d) {
    const int j = contact(k);
    for (int s = 0; s < n_moved(j); ++s) scatter_[moved(j)[s]] = effect(j, d)[s];
  };
  const auto entry = [&](int k, int d) { return dot(contact(k), d, scatter_); };
  const auto end = [&](int k) {
    for (int s = 0; s < n_moved(contact(k)); ++s) scatter_[moved(contact(k))[s]] = 0;
  };
  delassus_.fill(begin, entry, end);
  for (const int member : members) {
    const int i = contacts_[member];
    for (int s = 0; s < n_moved(i); ++s) visitors_[moved(i)[s]].clear();
  }
}

/// Impulses or forces r_ of a group, for b_ and laws_.
LcpStatus ImpactLaw::solve_group(std::span<const int> members, double rounding) {
  set_delassus(members);
  const Eigen::Index n = delassus_.n_rows();
  ++counters_.complementarity_solves;
  const bool may_predict = std::ranges::none_of(laws_, [&](const auto& law) { return polygon_.applies(law.n_t); });
  if (members.size() > kMaxUnpredicted && may_predict &&
      prediction_.solve(delassus_, b_.head(n), rounding, laws_, r_.head(n)))
    return LcpStatus::solved;
  if (G_.rows() < n) G_.resize(n, n);
  delassus_.to_dense(G_);
  const LcpStatus status = friction_.solve(G_.topLeftCorner(n, n), b_.head(n), rounding, laws_, r_.head(n));
  counters_.pivots += friction_.pivots();
  return status;
}

/// Adds what r_ of a group does to a velocity or acceleration, and the reaction of the bilateral constraints.
void ImpactLaw::apply(std::span<const int> members, Eigen::Ref<Vector> motion, Eigen::Ref<Vector> normal) const {
  const double* r = r_.data();
  for (const int member : members) {
    const int j = contacts_[member], tangent = problem_.n_c() + problem_.info().contacts[j].tangent_index;
    for (int d = 0; d <= n_t(j); ++d, ++r) {
      for (int s = 0; s < n_moved(j); ++s) motion[moved(j)[s]] += *r * effect(j, d)[s];
      for (const int i : problem_.info().bilateral) normal[i] += *r * reaction_(i, d == 0 ? j : tangent + d - 1);
    }
  }
}

const Vector& ImpactLaw::impulse_size(std::span<const int> together, const Eigen::Ref<const Vector>& Lambda_n,
                                      const Eigen::Ref<const Vector>& Lambda_t) {
  size_.setZero();
  for (const int i : together) {
    for (int d = 0; d <= n_t(i); ++d) {
      const double impulse =
          std::abs(d == 0 ? Lambda_n[i] : Lambda_t[problem_.info().contacts[i].tangent_index + d - 1]);
      for (int s = 0; s < n_moved(i); ++s) size_[moved(i)[s]] += impulse * std::abs(effect(i, d)[s]);
    }
  }
  return size_;
}

LcpStatus ImpactLaw::impact(std::span<const int> together, std::span<const int> approaching, Eigen::Ref<Vector> v,
                            Eigen::Ref<Vector> Lambda_n, Eigen::Ref<Vector> Lambda_t) {
  contacts_.assign(together.begin(), together.end());
  set_groups();
  for (std::size_t g = 0; g + 1 < group_begin_.size(); ++g) {
    const std::span<const int> members(grouped_.data() + group_begin_[g], grouped_.data() + group_begin_[g + 1]);
    const bool must_bounce = std::ranges::any_of(
        members, [&](int member) { return std::ranges::binary_search(approaching, contacts_[member]); });
    if (!must_bounce) continue;
    laws_.clear();
    Eigen::Index row = 0;
    double size = 0;
    for (const int member : members) {
      const int i = contacts_[member];
      const auto& contact = problem_.info().contacts[i];
      laws_.push_back({.mu = contact.mu, .n_t = contact.n_t});
      size = std::max({size, scales_.approach(i), scales_.slip(i)});
      for (int d = 0; d <= contact.n_t; ++d) {
        const double rate = dot(i, d, v);
        b_[row++] = d == 0 ? (1 + contact.eps_r) * rate : rate;
      }
    }
    const LcpStatus status = solve_group(members, ContactScales::kVelocityRounding * size);
    if (status != LcpStatus::solved) return status;
    if (has_bilateral_) bilateral_.impose(v, nullptr, Lambda_n);
    apply(members, v, Lambda_n);
    const double* r = r_.data();
    for (const int member : members) {
      const auto& contact = problem_.info().contacts[contacts_[member]];
      Lambda_n[contacts_[member]] = *r++;
      for (int d = 0; d < contact.n_t; ++d) Lambda_t[contact.tangent_index + d] = *r++;
    }
  }
  return LcpStatus::solved;
}

const Vector& ImpactLaw::free_acceleration(const Vector& q, const Vector& v) {
  problem_.force(q.data(), v.data(), problem_.info().u.data(), f_.data());
  ++counters_.force_evaluations;
  w_ = f_;
  solve_mass(w_);
  return w_;
}

LcpStatus ImpactLaw::contact_forces(const Vector& q, const Vector& v, std::span<Closed> closed,
                                    Eigen::Ref<Vector> lambda_n, Eigen::Ref<Vector> lambda_t) {
  free_acceleration(q, v);
  problem_.gap_acceleration_bias(q.data(), v.data(), bias_.data());
  if (has_turning_friction_) problem_.slip_velocity_derivative(q.data(), v.data(), T_.data());
  if (has_bilateral_) bilateral_.impose(w_, bias_.data(), lambda_n);
  contacts_.clear();
  for (const Closed& c : closed) {
    contacts_.push_back(c.contact);
    load_size_[c.contact] = normal_velocity_scale(c.contact, w_) + std::abs(bias_[c.contact]);
  }
  set_groups();
  for (std::size_t g = 0; g + 1 < group_begin_.size(); ++g) {
    const std::span<const int> members(grouped_.data() + group_begin_[g], grouped_.data() + group_begin_[g + 1]);
    laws_.clear();
    Eigen::Index row = 0;
    double size = 0;
    for (const int member : members) {
      const Closed& c = closed[member];
      const auto& contact = problem_.info().contacts[c.contact];
      laws_.push_back({.mu = contact.mu,
                       .n_t = contact.n_t,
                       .slides = c.slides,
                       .direction = {c.direction[0], c.direction[1]},
                       .is_on_edge = c.is_on_edge,
                       .facet = c.facet});
      size = std::max({size, load_size_[c.contact], slip_velocity_scale(c.contact, w_)});
      b_[row++] = dot(c.contact, 0, w_) + bias_[c.contact];
      for (int d = 0; d < contact.n_t; ++d) {
        b_[row] = dot(c.contact, 1 + d, w_);
        for (std::size_t s = 0; s < contact.support.size() && !contact.is_affine; ++s)
          b_[row] += T_(contact.tangent_index + d, contact.support[s]) * v[contact.support[s]];
        ++row;
      }
    }
    const LcpStatus status = solve_group(members, ContactScales::kVelocityRounding * size);
    if (status != LcpStatus::solved) return status;
    const double* r = r_.data();
    for (std::size_t k = 0; k < members.size(); ++k) {
      Closed& c = closed[members[k]];
      const auto& contact = problem_.info().contacts[c.contact];
      c.mode = laws_[k].mode;
      c.facet = laws_[k].facet;
      // Bodies that fall together need no force, and rounding is none.
      if (r[0] * normal_delassus(c.contact) <= ContactScales::kStageRounding * load_size_[c.contact])
        c.mode = ContactMode::open;
      lambda_n[c.contact] = *r++;
      for (int d = 0; d < contact.n_t; ++d) lambda_t[contact.tangent_index + d] = *r++;
    }
    apply(members, w_, lambda_n);
  }
  return LcpStatus::solved;
}

}  // namespace ricochet
