#include "methods/contact_laws/contact_operator.h"

#include <algorithm>
#include <cmath>

namespace ricochet {

ContactOperator::ContactOperator(const Problem& problem, bool normal_only, Joints joints)
    : problem_(problem),
      info_(problem.info()),
      normal_only_(normal_only),
      has_bilateral_(joints == Joints::eliminated && info_.has_bilateral()),
      bilateral_(problem) {
  const int n_c = info_.n_c();
  packed_n_.resize(info_.n_normal_entries);
  packed_t_.resize(info_.n_tangent_entries);
  column_.setZero(info_.n_q);
  product_.setZero(info_.n_q);
  if (has_bilateral_) reactions_.setZero(n_c, n_c + info_.n_lambda_t);
  islands_.reserve(info_.n_q);
  for (auto* list : {&sizes_, &neighbours_}) list->reserve(n_c);
  mark_.assign(n_c, -1);
  sets_.reserve(n_c);
}

void ContactOperator::set_directions(const Vector& q) {
  problem_.normal_jacobian(q.data(), packed_n_.data());
  if (info_.has_friction() && !normal_only_) problem_.tangent_jacobian(q.data(), packed_t_.data());
}

void ContactOperator::set_directions(const Vector& q, std::span<const int> contacts) {
  for (const std::span<const int> some : {contacts, std::span<const int>(info_.bilateral)}) {
    if (some.empty()) continue;
    problem_.normal_jacobian_of(some, q.data(), packed_n_.data());
    if (info_.has_friction() && !normal_only_) problem_.tangent_jacobian_of(some, q.data(), packed_t_.data());
  }
}

/// The islands that each contact touches, and so the coordinates that it moves.
void ContactOperator::set_islands(const Islands& islands) {
  if (islands_ == islands) return;
  islands_ = islands;
  for (auto* list : {&touched_, &moved_}) list->clear();
  for (auto* list : {&touched_begin_, &moved_begin_}) list->assign(1, 0);
  response_begin_.clear();
  support_in_moved_.assign(info_.n_normal_entries, -1);
  std::vector<int> place(info_.n_q);
  std::size_t n_responses = 0;
  for (int i = 0; i < info_.n_c(); ++i) {
    const auto pushed = info_.contacts[i].pushed();
    const auto begin = static_cast<std::ptrdiff_t>(touched_.size());
    for (const int at : pushed) touched_.push_back(islands.of(at));
    std::sort(touched_.begin() + begin, touched_.end());
    touched_.erase(std::unique(touched_.begin() + begin, touched_.end()), touched_.end());
    touched_begin_.push_back(static_cast<int>(touched_.size()));
    for (const int island : touched(i))
      moved_.insert(moved_.end(), islands.members(island).begin(), islands.members(island).end());
    moved_begin_.push_back(static_cast<int>(moved_.size()));
    const auto coordinates = moved(i);
    for (std::size_t s = 0; s < coordinates.size(); ++s) place[coordinates[s]] = static_cast<int>(s);
    for (std::size_t s = 0; s < pushed.size(); ++s)
      support_in_moved_[info_.contacts[i].normal_begin + s] = place[pushed[s]];
    response_begin_.push_back(n_responses);
    n_responses += (1 + n_t(i)) * coordinates.size();
  }
  responses_.assign(n_responses, 0);
  visitors_.resize(touched_.size());
  first_visitor_.assign(islands.count(), -1);
}

/// column_ = D_d of a contact.
void ContactOperator::scatter(int contact, int d) {
  const double* entry = column(contact, d);
  for (const int at : info_.contacts[contact].pushed()) column_[at] = *entry++;
}

/// The response of a contact from product_ = W D_d; column_ is zero again.
void ContactOperator::gather(int contact, int d) {
  for (const int at : info_.contacts[contact].pushed()) column_[at] = 0;
  if (has_bilateral_) bilateral_.impose(product_, nullptr, reactions_.col(reaction_column(contact, d)));
  double* entry = responses_.data() + response_begin_[contact] + d * moved(contact).size();
  for (const int at : moved(contact)) *entry++ = product_[at];
}

void ContactOperator::push(int contact, int d, double r, Eigen::Ref<Vector> x, Eigen::Ref<Vector> Lambda_n) const {
  const double* entry = response(contact, d);
  for (const int at : moved(contact)) x[at] += r * *entry++;
  if (!has_bilateral_) return;
  for (const int i : info_.bilateral) Lambda_n[i] += r * reactions_(i, reaction_column(contact, d));
}

void ContactOperator::add_size(int contact, int d, double r, Vector& size) const {
  const double* entry = response(contact, d);
  for (const int at : moved(contact)) size[at] += std::abs(r) * std::abs(*entry++);
}

double ContactOperator::own_delassus(int contact, int row, int d) const {
  const auto& info = info_.contacts[contact];
  const double *D = column(contact, row), *entries = response(contact, d);
  double sum = 0;
  for (std::size_t s = 0; s < info.pushed().size(); ++s)
    sum += D[s] * entries[support_in_moved_[info.normal_begin + s]];
  return sum;
}

/// Blocks of G: which contacts touch the same islands.
void ContactOperator::find_pattern(std::span<const int> contacts, Delassus& G) {
  const int n = static_cast<int>(contacts.size());
  sizes_.clear();
  for (const int i : contacts) sizes_.push_back(1 + n_t(i));
  G.set_sizes(sizes_);
  for (int k = n - 1; k >= 0; --k) {  // downwards, so that the visitors of an island ascend
    for (int s = touched_begin_[contacts[k]]; s < touched_begin_[contacts[k] + 1]; ++s) {
      visitors_[s] = {.number = k, .next = first_visitor_[touched_[s]]};
      first_visitor_[touched_[s]] = s;
    }
  }
  for (int k = 0; k < n; ++k) {
    neighbours_.clear();
    for (const int island : touched(contacts[k])) {
      for (int s = first_visitor_[island]; s >= 0; s = visitors_[s].next) {
        const int j = visitors_[s].number;
        if (mark_[j] == k) continue;
        mark_[j] = k;
        neighbours_.push_back(j);
      }
    }
    std::sort(neighbours_.begin(), neighbours_.end());
    G.add_row(neighbours_);
  }
  for (const int i : contacts) {
    for (const int island : touched(i)) first_visitor_[island] = -1;
  }
  std::fill_n(mark_.begin(), n, -1);
}

void ContactOperator::assemble(std::span<const int> contacts, Delassus& G) {
  find_pattern(contacts, G);
  const auto begin = [&](int k, int d) {
    const double* entry = response(contacts[k], d);
    for (const int at : moved(contacts[k])) column_[at] = *entry++;
  };
  const auto entry = [&](int k, int d) { return dot(contacts[k], d, column_); };  // (2)
  const auto end = [&](int k) {
    for (const int at : moved(contacts[k])) column_[at] = 0;
  };
  G.fill(begin, entry, end);
}

void ContactOperator::find_islands(std::span<const int> contacts, Islands& islands) {
  const int n = static_cast<int>(contacts.size());
  sets_.reset(n);
  for (int k = 0; k < n; ++k) {
    for (const int island : touched(contacts[k])) {
      int& visitor = first_visitor_[island];
      if (visitor >= 0) sets_.join(k, visitor);
      visitor = k;
    }
  }
  for (const int i : contacts) {
    for (const int island : touched(i)) first_visitor_[island] = -1;
  }
  islands.assign(sets_);
}

}  // namespace ricochet
