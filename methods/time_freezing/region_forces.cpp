#include "methods/time_freezing/region_forces.h"

#include <vector>

#include "problems/dense_solve.h"

namespace ricochet {

RegionForces::RegionForces(const ProblemInfo& info)
    : lambda_n(Vector::Zero(info.n_c())), lambda_t(Vector::Zero(info.n_lambda_t)), w(Vector::Zero(info.n_q)) {}

bool RegionForces::solve(const InstantSystem& system, const AuxiliaryDynamics& auxiliary, const Regions& regions,
                         const Vector& v, const Vector& y) {
  // Unknown forces have a direction in X and an equation in R; known ones, of pushed contacts, are part of the load.
  const Eigen::Index n_q = w.size();
  std::vector<int> rows;
  for (const int i : system.contacts()) {
    const ContactRegion& region = regions.of[i];
    if (!region.is_held()) continue;
    if (region.region != Region::pushed) rows.push_back(system.column(i));
    for (int d = 0; d < system.n_t(i) && region.sticks; ++d) rows.push_back(system.column(i) + 1 + d);
  }
  const auto n = static_cast<Eigen::Index>(rows.size());
  Matrix directions(n_q, n), D(n, n);
  Vector guess(n), missing(n);
  w = regions.is_frozen ? Vector(Vector::Zero(n_q)) : system.load();
  Eigen::Index k = 0;
  for (const int i : system.contacts()) {
    const ContactRegion& region = regions.of[i];
    const ContactInfo& contact = system.contact(i);
    if (!region.is_held()) {
      lambda_n[i] = 0;
      for (int d = 0; d < contact.n_t; ++d) lambda_t[contact.tangent_index + d] = 0;
      continue;
    }
    Vector along = system.X().col(system.column(i));
    for (int d = 0; d < contact.n_t && region.slips(); ++d)
      along -= contact.mu * region.direction[d] * system.X().col(system.column(i) + 1 + d);
    if (region.region == Region::pushed) {
      lambda_n[i] = auxiliary.push[i];
      w += lambda_n[i] * along;
    } else {
      directions.col(k) = along;
      missing[k] = regions.is_frozen ? 0 : -system.bias()[system.column(i)];
      if (region.region == Region::bouncing)
        missing[k] = -auxiliary.k * y[i] - auxiliary.damping[i] * system.normal_velocity(i, v);
      guess[k++] = lambda_n[i];
    }
    for (int d = 0; d < contact.n_t && region.sticks; ++d) {
      directions.col(k) = system.X().col(system.column(i) + 1 + d);
      missing[k] = regions.is_frozen ? 0 : -system.bias()[system.column(i) + 1 + d];
      guess[k++] = lambda_t[contact.tangent_index + d];
    }
  }
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) D(a, b) = system.R().col(rows[a]).dot(directions.col(b));
    missing[a] -= system.R().col(rows[a]).dot(w);
  }
  // Redundant contacts: of all forces those nearest to the present ones.
  if (n > 0) guess += least_squares(D, missing - D * guess);
  if (!guess.allFinite()) return false;
  if (n > 0) w += directions * guess;
  k = 0;
  for (const int i : system.contacts()) {
    const ContactRegion& region = regions.of[i];
    const ContactInfo& contact = system.contact(i);
    if (!region.is_held()) continue;
    if (region.region != Region::pushed) lambda_n[i] = guess[k++];
    for (int d = 0; d < contact.n_t; ++d)
      lambda_t[contact.tangent_index + d] =
          region.sticks ? guess[k++] : -contact.mu * lambda_n[i] * region.direction[d];
  }
  return true;
}

void project_velocity(const InstantSystem& system, const Regions& regions, Vector& v) {
  std::vector<int> rows;
  for (const int i : system.contacts()) {
    if (regions.of[i].region != Region::sliding) continue;
    rows.push_back(system.column(i));
    for (int d = 0; d < system.n_t(i) && regions.of[i].sticks; ++d) rows.push_back(system.column(i) + 1 + d);
  }
  const auto n = static_cast<Eigen::Index>(rows.size());
  if (n == 0) return;
  Matrix D(n, n);
  Vector rate(n);
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) D(a, b) = system.G()(rows[a], rows[b]);
    rate[a] = system.R().col(rows[a]).dot(v);
  }
  const Vector nu = least_squares(D, rate);
  if (!nu.allFinite()) return;
  for (Eigen::Index a = 0; a < n; ++a) v -= nu[a] * system.X().col(rows[a]);
}

}  // namespace ricochet
