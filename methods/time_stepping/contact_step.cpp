#include "methods/time_stepping/contact_step.h"

#include <algorithm>
#include <cmath>

#include "problems/packed_column.h"

namespace ricochet {

ContactStep::ContactStep(const Problem& problem, const ContactSolverOptions& options, const ContactLaws& laws,
                         Counters& counters, ContactObserver* observer)
    : scene_(problem),
      info_(problem.info()),
      counters_(counters),
      observer_(observer),
      normal_only_(laws.normal_only),
      has_bilateral_(info_.has_bilateral()),
      options_(options_for(info_, options)),
      is_affine_(std::ranges::all_of(info_.contacts, &ContactInfo::is_affine)),
      bilateral_(problem),
      solver_(make_contact_solver(options_)) {
  const int n_c = info_.n_c(), rows = n_c + info_.n_lambda_t;
  problem_.law = laws.friction;
  if (n_c <= kMaxDenseContacts) problem_.G.reserve(n_c, rows);
  problem_.b.setZero(rows);
  problem_.contacts.reserve(n_c);
  packed_n_.resize(info_.n_normal_entries);
  packed_t_.resize(info_.n_tangent_entries);
  for (auto* list : {&active_, &sizes_, &reach_begin_, &touched_begin_, &neighbours_}) list->reserve(n_c + 1);
  effect_begin_.reserve(n_c + 1);
  const auto most = static_cast<std::size_t>(n_c <= kMaxDenseContacts ? n_c * info_.n_q : 0);
  for (auto* list : {&reach_, &touched_, &visitors_}) list->reserve(most);
  effects_.reserve(3 * most);
  mark_.assign(n_c, -1);
  scatter_.setZero(info_.n_q);
  product_.setZero(info_.n_q);
  if (has_bilateral_) reactions_.setZero(n_c, rows);
  for (auto* x : {&r_, &w_}) x->setZero(rows);
  last_n_.setZero(n_c);
  velocity_rounding_.setZero(n_c);
  last_t_.setZero(info_.n_lambda_t);
  Lambda_n_.setZero(n_c);
  Lambda_t_.setZero(info_.n_lambda_t);
}

double ContactStep::dot(int i, int d, const Vector& v) const {
  return packed_dot(info_.contacts[i], column(i, d), v);
}

double ContactStep::slip_speed(int contact, const Vector& v) const {
  const int n = normal_only_ ? 0 : info_.contacts[contact].n_t;
  return n == 0 ? 0 : n == 1 ? std::abs(dot(contact, 1, v)) : std::hypot(dot(contact, 1, v), dot(contact, 2, v));
}

void ContactStep::add_column(int k, int d, double impulse, Vector& v) const {
  const int n = reach_begin_[k + 1] - reach_begin_[k];
  const int* at = reach_.data() + reach_begin_[k];
  const double* effect = effects_.data() + effect_begin_[k] + d * n;
  for (int s = 0; s < n; ++s) v[at[s]] += impulse * effect[s];
}

void ContactStep::set_position(const Vector& q) {
  if (is_affine_ && has_position_) return;
  scene_.normal_jacobian(q.data(), packed_n_.data());
  if (info_.has_friction() && !normal_only_) scene_.tangent_jacobian(q.data(), packed_t_.data());
  has_position_ = is_new_ = true;
}

void ContactStep::set_active(std::span<const int> active) {
  if (std::ranges::equal(active_, active)) return;
  is_new_ = true;
  active_.assign(active.begin(), active.end());
  problem_.contacts.clear();
  sizes_.clear();
  for (const int i : active_) {
    const auto& contact = info_.contacts[i];
    const int tangents = normal_only_ ? 0 : contact.n_t;
    problem_.contacts.push_back({.id = i, .n_t = tangents, .mu = contact.mu});
    sizes_.push_back(1 + tangents);
  }
}

/// Which blocks of W each active contact touches, and so which contacts move which: the pattern of the operator.
void ContactStep::find_neighbours(const BlockInverse& W) {
  const int n_active = static_cast<int>(active_.size());
  touched_.clear();
  touched_begin_.assign(1, 0);
  visitors_begin_.assign(W.n_blocks() + 1, 0);
  for (const int i : active_) {
    const auto begin = static_cast<std::ptrdiff_t>(touched_.size());
    for (const int at : info_.contacts[i].pushed()) touched_.push_back(W.block_of(at));
    std::sort(touched_.begin() + begin, touched_.end());
    touched_.erase(std::unique(touched_.begin() + begin, touched_.end()), touched_.end());
    for (auto block = touched_.begin() + begin; block != touched_.end(); ++block) ++visitors_begin_[*block + 1];
    touched_begin_.push_back(static_cast<int>(touched_.size()));
  }
  for (int block = 0; block < W.n_blocks(); ++block) visitors_begin_[block + 1] += visitors_begin_[block];
  visitors_.resize(touched_.size());
  for (int k = n_active - 1; k >= 0; --k) {  // downwards, so that each list ascends once its beginning has moved back
    for (int s = touched_begin_[k]; s < touched_begin_[k + 1]; ++s) visitors_[--visitors_begin_[touched_[s] + 1]] = k;
  }
  // visitors_begin_[b + 1] is now the beginning of block b.
  problem_.G.set_sizes(sizes_);
  for (int k = 0; k < n_active; ++k) {
    neighbours_.clear();
    for (int s = touched_begin_[k]; s < touched_begin_[k + 1]; ++s) {
      const int block = touched_[s];
      const int end = block + 2 <= W.n_blocks() ? visitors_begin_[block + 2] : static_cast<int>(visitors_.size());
      for (int p = visitors_begin_[block + 1]; p < end; ++p) {
        const int j = visitors_[p];
        if (mark_[j] == k) continue;
        mark_[j] = k;
        neighbours_.push_back(j);
      }
    }
    std::sort(neighbours_.begin(), neighbours_.end());
    problem_.G.add_row(neighbours_);
  }
  std::fill_n(mark_.begin(), n_active, -1);
}

/// W J, where bilateral constraints are with their reaction.
ContactStatus ContactStep::set_columns(const BlockInverse& W) {
  if (has_bilateral_) {
    const auto solve = [&](auto column) {
      scatter_ = column;
      W.apply(scatter_, product_);
      column = product_;
    };
    const bool ok = bilateral_.prepare(packed_n_.data(), solve);
    scatter_.setZero();
    if (!ok) return ContactStatus::dependent;
  }
  reach_.clear();
  effects_.clear();
  reach_begin_.assign(1, 0);
  effect_begin_.clear();
  for (int k = 0; k < static_cast<int>(active_.size()); ++k) {
    const auto pushed = info_.contacts[active_[k]].pushed();
    for (int s = touched_begin_[k]; s < touched_begin_[k + 1]; ++s)
      reach_.insert(reach_.end(), W.coordinates(touched_[s]), W.coordinates(touched_[s]) + W.size(touched_[s]));
    reach_begin_.push_back(static_cast<int>(reach_.size()));
    effect_begin_.push_back(effects_.size());
    for (int d = 0; d <= n_t(k); ++d) {
      const double* entry = column(active_[k], d);
      for (const int at : pushed) scatter_[at] = *entry++;
      for (int s = touched_begin_[k]; s < touched_begin_[k + 1]; ++s) W.apply(touched_[s], scatter_, product_);
      for (const int at : pushed) scatter_[at] = 0;
      if (has_bilateral_) bilateral_.impose(product_, nullptr, reactions_.col(problem_.G.row(k) + d));
      for (int s = reach_begin_[k]; s < reach_begin_[k + 1]; ++s) effects_.push_back(product_[reach_[s]]);
    }
  }
  return ContactStatus::solved;
}

void ContactStep::set_blocks() {
  const auto begin = [&](int k, int d) { add_column(k, d, 1, scatter_); };
  const auto entry = [&](int k, int d) { return dot(active_[k], d, scatter_); };
  const auto end = [&](int k) {
    for (int s = reach_begin_[k]; s < reach_begin_[k + 1]; ++s) scatter_[reach_[s]] = 0;
  };
  problem_.G.fill(begin, entry, end);
}

ContactStatus ContactStep::set_inverse_mass(const BlockInverse& W) {
  if (!is_new_ && W_ == &W && W_version_ == W.version()) return ContactStatus::solved;
  is_new_ = false;
  W_ = &W;
  W_version_ = W.version();
  find_neighbours(W);
  const ContactStatus status = set_columns(W);
  if (status == ContactStatus::solved) set_blocks();
  return status;
}

void ContactStep::add_normal_impulse(std::size_t k, double impulse, Vector& v, Vector& Lambda_n) const {
  const int contact = static_cast<int>(k);
  add_column(contact, 0, impulse, v);
  Lambda_n[active_[k]] += impulse;
  for (const int i : info_.bilateral) Lambda_n[i] += impulse * reactions_(i, problem_.G.row(contact));
}

ContactStatus ContactStep::solve(Vector& v, const Vector& shift, const Vector& present) {
  Lambda_n_.setZero();
  Lambda_t_.setZero();
  velocity_rounding_.setZero();
  if (has_bilateral_) bilateral_.impose(v, shift.data(), Lambda_n_);  // (3)
  const int n_active = static_cast<int>(active_.size());
  if (n_active == 0) return ContactStatus::solved;
  for (int k = 0; k < n_active; ++k) {
    const int i = active_[k], row = problem_.G.row(k);
    problem_.contacts[k].present = present.size() > 0 ? present[k] : 0;
    for (int d = 0; d <= n_t(k); ++d) {
      problem_.b[row + d] = dot(active_[k], d, v) + (d == 0 ? shift[i] : 0);
      r_[row + d] = d == 0 ? last_n_[i] : last_t_[info_.contacts[i].tangent_index + d - 1];
    }
  }
  if (observer_) observer_->before(counters_.steps, problem_, r_);
  const ContactStatus status = solver_->solve(problem_, r_);
  if (observer_) observer_->after(problem_, r_, status);
  ++counters_.complementarity_solves;
  solver_->count(counters_);
  if (status != ContactStatus::solved) return status;
  const bool iterates = options_.kind != ContactSolverKind::lemke;
  const double largest = iterates ? scale_of(problem_, r_).velocity : 0;
  for (int k = 0; k < n_active; ++k) {
    const int i = active_[k];
    for (int d = 0; d <= n_t(k); ++d) {
      const int row = problem_.G.row(k) + d;
      const double impulse = r_[row];
      if (d == 0) {
        Lambda_n_[i] = last_n_[i] = impulse;
        if (impulse > 0)
          velocity_rounding_[i] =
              options_.tolerance * (std::abs(problem_.b[row]) + problem_.G.diagonal(k, 0) * impulse + largest);
      } else {
        Lambda_t_[info_.contacts[i].tangent_index + d - 1] = last_t_[info_.contacts[i].tangent_index + d - 1] = impulse;
      }
      if (impulse == 0) continue;
      add_column(k, d, impulse, v);  // (1)
      for (const int b : info_.bilateral) Lambda_n_[b] += impulse * reactions_(b, row);
    }
  }
  return status;
}

double ContactStep::residual(const Vector& v_plus, const Vector& shift) {
  const double bilateral = has_bilateral_ ? bilateral_.residual(v_plus, shift.data(), Lambda_n_) : 0;
  if (active_.empty()) return bilateral;
  // Velocities are known to the rounding of their terms, |J|' |v+|.
  ContactScale scale = scale_of(problem_, r_);
  const double before = scale.velocity;
  for (int k = 0; k < static_cast<int>(active_.size()); ++k) {
    const int i = active_[k];
    for (int d = 0; d <= n_t(k); ++d) {
      w_[problem_.G.row(k) + d] = dot(i, d, v_plus) + (d == 0 ? shift[i] : 0);
      scale.velocity = std::max(scale.velocity, packed_terms(info_.contacts[i], column(i, d), v_plus));
    }
  }
  if (before > 0) scale.impulse *= scale.velocity / before;
  return std::max(bilateral, violation(problem_, r_, w_, scale, solver_->polygon()));
}

}  // namespace ricochet
