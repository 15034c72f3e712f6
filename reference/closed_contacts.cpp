#include "reference/closed_contacts.h"

namespace ricochet::reference {

ClosedContacts::ClosedContacts(const Problem& problem)
    : problem_(problem),
      modes_(problem.info().contacts.size(), ContactMode::open),
      direction_(Vector::Zero(problem.info().n_lambda_t)),
      holds_direction_(problem.info().contacts.size(), false),
      packed_n_(problem.info().n_normal_entries),
      packed_t_(problem.info().n_tangent_entries) {
  for (const int i : problem.info().bilateral) modes_[i] = ContactMode::closed;
  set_modes(std::vector(modes_));
}

void ClosedContacts::set_modes(const std::vector<ContactMode>& modes) {
  modes_ = modes;
  closed_.clear();
  parts_.clear();
  columns_.clear();
  unknowns_.clear();
  is_affine_ = true;
  follows_velocity_ = false;
  for (int i = 0; i < problem_.n_c(); ++i) {
    holds_direction_[i] = false;
    if (!is_closed(modes[i])) continue;
    const auto& contact = problem_.info().contacts[i];
    const int n_t = modes[i] == ContactMode::closed ? 0 : contact.n_t, n_stuck = is_slipping(modes[i]) ? 0 : n_t;
    closed_.push_back(i);
    parts_.push_back({&contact, i, std::ssize(columns_), std::ssize(unknowns_), n_t, n_stuck});
    for (int k = 0; k <= n_t; ++k) {
      const double* J = k == 0 ? packed_n_.data() + contact.normal_begin
                               : packed_t_.data() + contact.tangent_begin + (k - 1) * std::ssize(contact.support);
      columns_.push_back({&contact, J, std::ssize(columns_)});
      if (k <= n_stuck) unknowns_.push_back(columns_.back());
    }
    is_affine_ = is_affine_ && contact.is_affine;
    follows_velocity_ = follows_velocity_ || modes[i] == ContactMode::slip;
    if (is_slipping(modes[i]) && modes[i] != ContactMode::slip) direction_[contact.tangent_index] = slip_sign(modes[i]);
  }
}

void ClosedContacts::hold_direction(int i, const Vector& d) {
  holds_direction_[i] = d.size() > 0;
  if (d.size() > 0) direction_.segment(problem_.info().contacts[i].tangent_index, d.size()) = d;
}

void ClosedContacts::evaluate(const double* q) {
  problem_.normal_jacobian_of(closed_, q, packed_n_.data());
  if (columns_.size() > parts_.size()) problem_.tangent_jacobian_of(closed_, q, packed_t_.data());
}

void ClosedContacts::set_directions(const double* v) {
  for (const Part& part : parts_) {
    if (modes_[part.contact] != ContactMode::slip || holds_direction_[part.contact]) continue;
    double* d = direction_.data() + part.info->tangent_index;
    for (int k = 0; k < part.n_t; ++k) d[k] = columns_[part.column + 1 + k].dot(v);
    Eigen::Map<Vector>(d, part.n_t).normalize();
  }
}

}  // namespace ricochet::reference
