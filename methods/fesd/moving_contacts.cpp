#include "methods/fesd/moving_contacts.h"

#include "problems/packed_column.h"

namespace ricochet {

MovingContacts::MovingContacts(const Problem& problem) : problem_(problem) {
  const ProblemInfo& info = problem.info();
  for (const auto& contact : info.contacts) n_rows_ += contact.is_moving ? 1 + contact.n_t : 0;
  if (empty()) return;
  J_n_.resize(info.n_normal_entries);
  J_t_.resize(info.n_tangent_entries);
  bias_.resize(info.n_c());
  T_.resize(info.n_lambda_t, info.n_q);
}

const Matrix& MovingContacts::accelerations(const Element& element) {
  const ProblemInfo& info = problem_.info();
  accelerations_.resize(n_rows_, element.a.cols());
  for (Eigen::Index j = 0; j < element.a.cols(); ++j) {
    const auto v = element.v.col(j), w = element.a.col(j);
    const double* q = element.q.col(j).data();
    problem_.normal_jacobian(q, J_n_.data());
    problem_.tangent_jacobian(q, J_t_.data());
    problem_.gap_acceleration_bias(q, v.data(), bias_.data());
    problem_.slip_velocity_derivative(q, v.data(), T_.data());
    Eigen::Index row = 0;
    for (int i = 0; i < info.n_c(); ++i) {
      const ContactInfo& contact = info.contacts[i];
      if (!contact.is_moving) continue;
      accelerations_(row++, j) = packed_dot(contact, J_n_.data() + contact.normal_begin, w) + bias_[i];
      const double* J_t = J_t_.data() + contact.tangent_begin;
      for (int d = 0; d < contact.n_t; ++d, J_t += contact.support.size())
        accelerations_(row++, j) = packed_dot(contact, J_t, w) + T_.row(contact.tangent_index + d).dot(v);
    }
  }
  return accelerations_;
}

}  // namespace ricochet
