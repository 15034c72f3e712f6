#include "methods/elements/stage_unknowns.h"

#include <algorithm>
#include <cmath>

namespace ricochet {

double StageUnknowns::correct(const double* dx, double h, const StageDerivatives& K, Element& e) const {
  const int n_q = info_.n_q;
  double largest = 0;
  for (int j = 0; j < n_s_; ++j) {
    double* a = e.a.data() + j * n_q;
    for (int i = 0; i < n_q; ++i) {
      a[i] += dx[i];
      largest = std::max(largest, std::abs(dx[i]));
    }
    dx += n_q;
    for (const ActiveContact& active : active_.closed()) {
      const auto& contact = info_.contacts[active.contact];
      const double* force = K.forces[j].data() + active.entry;
      for (int d = 0; d < active.n_rows; ++d) {
        for (const int at : contact.pushed())
          largest = std::max(largest, std::abs(*force++ * dx[d]) / K.M[j][at * (n_q + 1)]);
        force += contact.is_moving;
      }
      e.lambda_n(active.contact, j) += *dx;
      if (contact.n_t > 0) set_friction(active, j, dx + 1, e);
      dx += active.n_rows;
    }
  }
  return h * largest;
}

/// lambda_t of a closed contact at a stage, from lambda_n and its own unknowns with their corrections dx, which may be
/// null.
void StageUnknowns::set_friction(const ActiveContact& active, int j, const double* dx, Element& e) const {
  const auto& contact = info_.contacts[active.contact];
  double* lambda_t = e.lambda_t.col(j).data() + contact.tangent_index;
  if (active.n_rows == 1 + contact.n_t) {  // stick, and slip on the disc: all of it is unknown
    for (int d = 0; d < contact.n_t && dx; ++d) lambda_t[d] += dx[d];
    return;
  }
  double x = 0;
  const auto &along = active.law.along, &held = active.law.held[0];
  if (active.law.n_held > 0) x = held[0] * lambda_t[0] + held[1] * lambda_t[1] + (dx ? dx[0] : 0);
  const double cone = contact.mu * e.lambda_n(active.contact, j);
  for (int d = 0; d < contact.n_t; ++d) lambda_t[d] = (active.law.n_held > 0 ? x * held[d] : 0) - cone * along[d];
}

void StageUnknowns::set_dependent_forces(Element& e) const {
  for (std::size_t i = 0; i < e.modes.size(); ++i) {
    if (e.modes[i] != ContactMode::open) continue;
    const auto& contact = info_.contacts[i];
    e.lambda_n.row(static_cast<Eigen::Index>(i)).setZero();
    if (contact.n_t > 0) e.lambda_t.middleRows(contact.tangent_index, contact.n_t).setZero();
  }
  for (const ActiveContact& active : active_.closed()) {
    for (int j = 0; active_.has_friction() && j < n_s_; ++j) {
      if (info_.contacts[active.contact].n_t > 0) set_friction(active, j, nullptr, e);
    }
  }
}

void StageUnknowns::gather_forces(const Element& e, Vector& all) const {
  for (int j = 0; j < n_s_; ++j) {
    for (const ActiveContact& active : active_.closed()) {
      double* x = all.data() + j * active_.n_unknowns() + info_.n_q + active.row;
      *x++ = e.lambda_n(active.contact, j);
      const auto& contact = info_.contacts[active.contact];
      for (int m = 0; m < active.n_rows - 1; ++m, ++x) {
        *x = 0;
        for (int d = 0; d < contact.n_t; ++d) *x += active.law.held[m][d] * e.lambda_t(contact.tangent_index + d, j);
      }
    }
  }
}

double StageUnknowns::velocity_scale(const Element& e, double h, double load) const {
  double v = 0, a = load;
  for (int i = 0; i < info_.n_mechanical(); ++i) v = std::max(v, std::abs(e.v0[i]));
  for (Eigen::Index i = 0; i < e.a.size(); ++i) a = std::max(a, std::abs(e.a.data()[i]));
  return v + h * a;
}

}  // namespace ricochet
