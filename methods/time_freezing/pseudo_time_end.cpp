#include "methods/time_freezing/pseudo_time_end.h"

#include <algorithm>
#include <cmath>

#include "problems/dense_solve.h"
#include "problems/packed_column.h"

namespace ricochet {
namespace {

constexpr int kMaxCorrections = 4;

/// Adds a packed column to a dense one. @param entries  number of them: those of the support, or those that forces push
void add_column(const ContactInfo& contact, const double* J, std::size_t entries, double factor,
                Eigen::Ref<Vector> column) {
  for (std::size_t p = 0; p < entries; ++p) column[contact.support[p]] += factor * J[p];
}

}  // namespace

PseudoTimeEnd::PseudoTimeEnd(const Problem& problem, const ButcherTableau& tableau, const HeldContacts& held)
    : problem_(problem), info_(problem.info()), held_(held), ends_with_stage_(tableau.is_stiffly_accurate()) {
  M_.resize(info_.n_q, info_.n_q);
  J_n_.resize(info_.n_normal_entries);
  J_t_.resize(info_.n_tangent_entries);
}

void PseudoTimeEnd::correct(PseudoTimeElement& e) {
  if (held_.all().empty() || held_.is_frozen() || (ends_with_stage_ && !held_.has_curved())) return;
  problem_.mass_matrix(e.q1.data(), M_.data());
  if (held_.has_curved()) correct_position(e.q1);
  correct_velocity(e.q1, e.v1);
}

/// (1)
void PseudoTimeEnd::correct_position(Vector& q) {
  Vector violation = Vector::Zero(held_.n_rows()), gap(info_.n_c());
  for (int k = 0; k < kMaxCorrections; ++k) {
    problem_.gap(q.data(), gap.data());
    problem_.normal_jacobian(q.data(), J_n_.data());
    Matrix R = Matrix::Zero(info_.n_q, held_.n_rows()), C = R;
    double largest = 0;
    for (const HeldContact& held : held_.all()) {
      const ContactInfo& contact = info_.contacts[held.contact];
      const double* J_n = J_n_.data() + contact.normal_begin;
      add_column(contact, J_n, contact.support.size(), 1, R.col(held.row));
      add_column(contact, J_n, contact.pushed().size(), 1, C.col(held.row));
      violation[held.row] = gap[held.contact];
      largest = std::max(largest, std::abs(gap[held.contact]));
    }
    if (!remove(R, C, violation, q) || largest < 1e-15 * q.lpNorm<Eigen::Infinity>()) return;
  }
}

/// (2)
void PseudoTimeEnd::correct_velocity(const Vector& q, Vector& v) {
  problem_.normal_jacobian(q.data(), J_n_.data());
  if (held_.has_friction()) problem_.tangent_jacobian(q.data(), J_t_.data());
  Matrix R = Matrix::Zero(info_.n_q, held_.n_rows()), C = R;
  Vector violation = Vector::Zero(held_.n_rows());
  for (const HeldContact& held : held_.all()) {
    const ContactInfo& contact = info_.contacts[held.contact];
    const ContactRegion& region = held_.region(held);
    const std::size_t n = contact.support.size(), n_pushed = contact.pushed().size();
    const double* J_n = J_n_.data() + contact.normal_begin;
    violation[held.row] = packed_dot(contact, J_n, v);
    add_column(contact, J_n, n, 1, R.col(held.row));
    add_column(contact, J_n, n_pushed, 1, C.col(held.row));
    for (int d = 0; d < contact.n_t; ++d) {
      const double* J_t = J_t_.data() + contact.tangent_begin + d * static_cast<int>(n);
      if (region.sticks) {
        violation[held.row + 1 + d] = packed_dot(contact, J_t, v);
        add_column(contact, J_t, n, 1, R.col(held.row + 1 + d));
        add_column(contact, J_t, n_pushed, 1, C.col(held.row + 1 + d));
      } else if (region.slips()) {
        add_column(contact, J_t, n_pushed, -contact.mu * region.direction[d], C.col(held.row));
      }
    }
  }
  remove(R, C, violation, v);
}

/// x <- x - M^-1 C (R' M^-1 C)^-1 violation. @return false where that is not finite
bool PseudoTimeEnd::remove(const Matrix& R, const Matrix& C, const Vector& violation, Vector& x) const {
  const Matrix X = CholeskyFactors(M_).solve_columns(C);
  const Vector nu = least_squares(R.transpose() * X, violation);
  if (!nu.allFinite()) return false;
  x -= X * nu;
  return true;
}

}  // namespace ricochet
