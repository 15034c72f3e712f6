#include "methods/contact_laws/friction_problem.h"

#include <algorithm>
#include <cmath>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

constexpr int kFacetsOfGuess = 8;  // in place of the disc
// A friction force this near to a vertex of the polygon, as part of the radius, is there.
constexpr double kAtVertex = 1e-12;
// Rounding error of the projection equations after a solve, relative to the impulses.
constexpr double kRounding = 1e-12;
constexpr int kMaxNewton = 60;
constexpr int kMaxHalvings = 12;
constexpr int kRestarts = 5;
constexpr int kSweeps = 200;
// A pivot of dependent contact normals, relative to the diagonal: rounding, and not bodies of different weight.
constexpr double kDependentPivot = 1e-11;
// Normal velocity that sticking may leave, as a part of that before: more than rounding of two equations.
constexpr double kLeftBySticking = 1e-9;

}  // namespace

/// Columns of the tangential part of the LCP: facets, or the one direction of (8).
int FrictionProblem::columns_of(const Contact& contact) const {
  if (contact.slides) return contact.is_on_edge ? 1 : 0;
  return contact.n_t == 2 ? facets_in_space_ : 2 * contact.n_t;
}

std::array<double, 2> FrictionProblem::column_direction(const Contact& contact, int f) const {
  if (polygon_.applies(contact.n_t) && !contact.is_on_edge) return polygon_.vertex(f);
  if (!contact.is_on_edge) return facet_direction(contact.n_t, f, kFacetsOfGuess);
  const auto &from = polygon_.vertex(contact.facet), &to = polygon_.vertex(polygon_.next(contact.facet));
  return {to[0] - from[0], to[1] - from[1]};
}

/// @param r  impulse or force of a contact that slips or begins to slip: normal, then tangents
void FrictionProblem::set_slip_mode(Contact& contact, const double* r) const {
  if (polygon_.applies(contact.n_t)) {
    contact.mode = polygon_.locate(r + 1, contact.mu * r[0], kAtVertex, contact.facet);
    return;
  }
  const double against = -r[1];
  contact.mode = slip_mode(contact.n_t, contact.slides ? contact.direction : &against);
}

void FrictionProblem::resize(int most_contacts, int most_tangents, const FrictionPolygon& polygon) {
  most_contacts_ = most_contacts;
  most_tangents_ = most_tangents;
  polygon_ = polygon;
  facets_in_space_ = polygon.facets() > 0 ? polygon.facets() : kFacetsOfGuess;
  const int n = most_contacts + most_tangents;
  const int columns = most_contacts + facets_in_space_ / 2 * most_tangents;
  const int most = most_tangents > 0 ? columns + most_contacts : columns;
  lemke_.resize(most);
  normals_.resize(most_contacts, most_contacts);
  M_.resize(most, most);
  q_.resize(most);
  z_.resize(most);
  directions_.resize(n, columns);
  effects_.resize(n, columns);
  w_.resize(n);
  residual_.resize(n);
  step_.resize(n);
  trial_.resize(n);
}

LcpStatus FrictionProblem::solve(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b, double rounding,
                                 std::span<Contact> contacts, Eigen::Ref<Vector> r) {
  if (contacts.size() == 1 && solve_alone(G, b, contacts.front(), r)) return LcpStatus::solved;
  const int n_c = static_cast<int>(contacts.size()), n_t = static_cast<int>(b.size()) - n_c;
  if (n_c > most_contacts_ || n_t > most_tangents_)
    resize(std::max(n_c, most_contacts_), std::max(n_t, most_tangents_), polygon_);
  lemke_.set_rounding(rounding);
  is_redundant_ = has_dependent_normals(G, contacts);
  const LcpStatus status = solve_polyhedral(G, b, contacts, r);
  const bool has_cones = std::any_of(contacts.begin(), contacts.end(), [&](const Contact& c) {
    return c.n_t == 2 && !c.slides && !polygon_.applies(c.n_t);
  });
  if (status != LcpStatus::solved || !has_cones) return status;
  rounding_ = rounding / G.diagonal().minCoeff();
  return solve_cones(G, b, contacts, r) ? LcpStatus::solved : LcpStatus::iteration_limit;
}

/// @return false where (9) does not hold, or the contact is in space and its direction is not known
bool FrictionProblem::solve_alone(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b,
                                  Contact& contact, Eigen::Ref<Vector> r) const {
  const int n_t = contact.n_t;
  if (contact.is_on_edge || polygon_.applies(n_t) || (n_t == 2 && !contact.slides)) return false;
  const auto slides = [&](double direction_1, double direction_2) {  // (4)
    double G_n = G(0, 0) - contact.mu * direction_1 * G(0, 1);
    if (n_t == 2) G_n -= contact.mu * direction_2 * G(0, 2);
    return G_n;
  };
  const bool is_open = b[0] >= 0;
  contact.mode = ContactMode::open;
  if (n_t == 0) {
    if (!(G(0, 0) > 0)) return false;
    r[0] = is_open ? 0 : -b[0] / G(0, 0);
    if (!is_open) contact.mode = ContactMode::closed;
    return true;
  }
  const double plus = contact.slides ? slides(contact.direction[0], contact.direction[1]) : slides(1, 0);
  const double minus = contact.slides ? plus : slides(-1, 0);
  if (!(plus > 0 && minus > 0)) return false;
  r.setZero();
  if (is_open) return true;
  if (contact.slides) {
    r[0] = -b[0] / plus;
    for (int d = 0; d < n_t; ++d) r[1 + d] = -contact.mu * r[0] * contact.direction[d];
  } else {
    const double determinant = G(0, 0) * G(1, 1) - G(0, 1) * G(1, 0);
    const double stick_n = (G(0, 1) * b[1] - G(1, 1) * b[0]) / determinant;
    const double stick_t = (G(1, 0) * b[0] - G(0, 0) * b[1]) / determinant;
    // Where the normal and the tangent push the same coordinate, the determinant is rounding, and so is what it gives.
    const bool is_left = std::abs(G(0, 0) * stick_n + G(0, 1) * stick_t + b[0]) > kLeftBySticking * std::abs(b[0]);
    if (determinant > 0 && !is_left && stick_n > 0 && std::abs(stick_t) <= contact.mu * stick_n) {
      r[0] = stick_n;
      r[1] = stick_t;
      contact.mode = ContactMode::stick;
      return true;
    }
    // The slip velocity that is left has the sign of the slip.
    r[0] = -b[0] / plus;
    r[1] = -contact.mu * r[0];
    if (G(1, 0) * r[0] + G(1, 1) * r[1] + b[1] < 0) {
      r[0] = -b[0] / minus;
      r[1] = contact.mu * r[0];
    }
  }
  set_slip_mode(contact, r.data());
  return true;
}

/// Cholesky decomposition of the normal part of G without square roots: its smallest pivot.
bool FrictionProblem::has_dependent_normals(const Eigen::Ref<const Matrix>& G, std::span<const Contact> contacts) {
  const auto n = static_cast<Eigen::Index>(contacts.size());
  if (n < 2) return false;
  auto A = normals_.topLeftCorner(n, n);
  Eigen::Index row = 0;
  for (Eigen::Index r = 0; r < n; row += 1 + contacts[r++].n_t) {
    Eigen::Index column = 0;
    for (Eigen::Index c = 0; c < n; column += 1 + contacts[c++].n_t) A(r, c) = G(row, column);
  }
  auto diagonal = w_.head(n);
  diagonal = A.diagonal();
  for (Eigen::Index k = 0; k < n; ++k) {
    if (A(k, k) <= kDependentPivot * diagonal[k]) return true;
    for (Eigen::Index r = k + 1; r < n; ++r) {
      const double factor = A(r, k) / A(k, k);
      for (Eigen::Index c = k + 1; c < n; ++c) A(r, c) -= factor * A(k, c);
    }
  }
  return false;
}

/// (1), (2), (4), (5), (8)
LcpStatus FrictionProblem::solve_polyhedral(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b,
                                            std::span<Contact> contacts, Eigen::Ref<Vector> r) {
  // Columns of the LCP: the (perhaps sliding) normals, then the facets; each a combination of the columns of G.
  const auto n = b.size();
  const auto n_c = static_cast<Eigen::Index>(contacts.size());
  Eigen::Index columns = n_c, frictional = 0;
  for (const Contact& contact : contacts) {
    columns += columns_of(contact);
    frictional += columns_of(contact) > 0;
  }
  const bool is_plain = columns == n_c && n == n_c;
  if (is_plain) {
    const LcpStatus status = lcp(G, b, r);
    for (Eigen::Index k = 0; k < n_c; ++k) contacts[k].mode = r[k] > 0 ? ContactMode::closed : ContactMode::open;
    return status;
  }

  const Eigen::Index size = columns + frictional;
  auto D = directions_.topLeftCorner(n, columns);  // of the impulses
  auto M = M_.topLeftCorner(size, size);
  auto q = q_.head(size);
  D.setZero();
  M.setZero();
  Eigen::Index row = 0, column = n_c;
  for (Eigen::Index k = 0; k < n_c; ++k) {
    const Contact& contact = contacts[k];
    D(row, k) = 1;
    if (contact.slides) {
      for (int d = 0; d < contact.n_t; ++d) D(row + 1 + d, k) = -contact.mu * contact.direction[d];
    }
    for (int f = 0; f < columns_of(contact); ++f, ++column) {
      const auto e = column_direction(contact, f);
      for (int d = 0; d < contact.n_t; ++d) D(row + 1 + d, column) = e[d];
    }
    row += 1 + contact.n_t;
  }
  auto GD = effects_.topLeftCorner(n, columns);
  GD.noalias() = G.lazyProduct(D);
  // Rows: w_n, then the facets' velocities.
  row = 0;
  column = n_c;
  Eigen::Index gamma = columns;
  for (Eigen::Index k = 0; k < n_c; ++k) {
    const Contact& contact = contacts[k];
    M.row(k).head(columns) = GD.row(row);
    q[k] = b[row];
    const int facets = columns_of(contact);
    for (int f = 0; f < facets; ++f, ++column) {
      q[column] = 0;
      const auto e = column_direction(contact, f);
      for (int d = 0; d < contact.n_t; ++d) {
        M.row(column).head(columns) += e[d] * GD.row(row + 1 + d);
        q[column] += e[d] * b[row + 1 + d];
      }
      M(column, gamma) = 1;
      M(gamma, column) = -1;
    }
    if (facets > 0) {
      M(gamma, k) = contact.mu;
      q[gamma++] = 0;
    }
    row += 1 + contact.n_t;
  }
  auto z = z_.head(size);
  const LcpStatus status = lcp(M, q, z);
  if (status != LcpStatus::solved) return status;
  r.noalias() = D.lazyProduct(z.head(columns));

  gamma = columns;
  row = 0;
  for (Eigen::Index k = 0; k < n_c; ++k) {
    Contact& contact = contacts[k];
    const int facets = columns_of(contact);
    const bool slips = contact.slides || (facets > 0 && z[gamma] > 0);
    if (r[row] <= 0) {
      contact.mode = ContactMode::open;
      r.segment(row, 1 + contact.n_t).setZero();  // facets may hold rounding
    } else if (contact.n_t == 0) {
      contact.mode = ContactMode::closed;
    } else if (slips) {
      set_slip_mode(contact, r.data() + row);
    } else {
      contact.mode = ContactMode::stick;
    }
    if (facets > 0) ++gamma;
    row += 1 + contact.n_t;
  }
  return status;
}

bool FrictionProblem::solve_cones(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b,
                                  std::span<Contact> contacts, Eigen::Ref<Vector> r) {
  bool solved = newton(G, b, contacts, r);
  // The prediction led nowhere: Gauss-Seidel sweeps approach the solution from anywhere.
  for (int restart = 0; restart < kRestarts && !solved; ++restart) {
    for (int k = 0; k < kSweeps; ++k) sweep(G, b, contacts, r);
    solved = newton(G, b, contacts, r);
  }
  Eigen::Index row = 0;
  for (Contact& contact : contacts) {
    if (r[row] <= 0) contact.mode = ContactMode::open;
    if (contact.mode == ContactMode::open) r.segment(row, 1 + contact.n_t).setZero();  // rounding
    row += 1 + contact.n_t;
  }
  return solved;
}

/// (6), (7) at r, and where `jacobian` is asked for an element of their generalised Jacobian. Sets the modes; returns
/// ||F||.
double FrictionProblem::projections(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b,
                                    std::span<Contact> contacts, const Eigen::Ref<const Vector>& r, bool jacobian) {
  const auto n = b.size();
  w_.head(n).noalias() = G.lazyProduct(r);
  w_.head(n) += b;
  if (jacobian) jacobian_.setZero(n, n);
  Eigen::Index row = 0;
  for (Contact& contact : contacts) {
    const int n_t = contact.n_t;
    const double rho_n = 1 / G(row, row), pressed = r[row] - rho_n * w_[row];
    if (pressed <= 0) {
      contact.mode = ContactMode::open;
      residual_.segment(row, 1 + n_t) = r.segment(row, 1 + n_t);
      if (jacobian) jacobian_.block(row, row, 1 + n_t, 1 + n_t).setIdentity();
      row += 1 + n_t;
      continue;
    }
    contact.mode = ContactMode::closed;
    residual_[row] = rho_n * w_[row];
    if (jacobian) jacobian_.row(row) = rho_n * G.row(row);
    if (contact.slides) {
      contact.mode = slip_mode(n_t, contact.direction);
      for (int d = 0; d < n_t; ++d) {
        residual_[row + 1 + d] = r[row + 1 + d] + contact.mu * r[row] * contact.direction[d];
        if (!jacobian) continue;
        jacobian_(row + 1 + d, row + 1 + d) = 1;
        jacobian_(row + 1 + d, row) = contact.mu * contact.direction[d];
      }
    } else if (n_t > 0) {
      const double rho_t = 1 / G.diagonal().segment(row + 1, n_t).maxCoeff(), radius = contact.mu * pressed;
      double y[2]{0, 0};
      for (int d = 0; d < n_t; ++d) y[d] = r[row + 1 + d] - rho_t * w_[row + 1 + d];
      const double size = std::hypot(y[0], y[1]);
      const bool sticks = size <= radius;
      const double against = -y[0];
      contact.mode = sticks ? ContactMode::stick : slip_mode(n_t, &against);
      for (int d = 0; d < n_t; ++d) {
        const Eigen::Index t = row + 1 + d;
        residual_[t] = sticks ? rho_t * w_[t] : r[t] - radius * y[d] / size;
        if (!jacobian) continue;
        if (sticks) {
          jacobian_.row(t) = rho_t * G.row(t);
          continue;
        }
        jacobian_(t, t) += 1;
        jacobian_(t, row) -= contact.mu * y[d] / size;
        jacobian_.row(t) += contact.mu * y[d] / size * rho_n * G.row(row);
        for (int e = 0; e < n_t; ++e) {
          const double across = radius / size * ((d == e ? 1 : 0) - y[d] * y[e] / (size * size));
          jacobian_(t, row + 1 + e) -= across;
          jacobian_.row(t) += across * rho_t * G.row(row + 1 + e);
        }
      }
    }
    row += 1 + n_t;
  }
  return residual_.head(n).norm();
}

bool FrictionProblem::newton(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b,
                             std::span<Contact> contacts, Eigen::Ref<Vector> r) {
  const auto n = b.size();
  double error = projections(G, b, contacts, r, true);
  for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
    if (error == 0) return true;
    // Redundant contacts make the matrix singular; the smallest correction keeps their forces where they are.
    step_.head(n) = -least_squares(jacobian_, residual_.head(n));
    if (!step_.head(n).allFinite()) return false;
    double length = 1, trial = 0;
    for (int halving = 0; halving < kMaxHalvings; ++halving, length /= 2) {
      trial_.head(n) = r + length * step_.head(n);
      trial = projections(G, b, contacts, trial_.head(n), false);
      if (trial < error) break;
    }
    const bool is_exact = error <= kRounding * r.cwiseAbs().maxCoeff() + rounding_;
    if (!(trial < error)) {
      projections(G, b, contacts, r, false);
      return is_exact;
    }
    r = trial_.head(n);
    error = projections(G, b, contacts, r, true);
  }
  return error <= kRounding * r.cwiseAbs().maxCoeff() + rounding_;
}

/// One projected Gauss-Seidel sweep over the contacts.
void FrictionProblem::sweep(const Eigen::Ref<const Matrix>& G, const Eigen::Ref<const Vector>& b,
                            std::span<const Contact> contacts, Eigen::Ref<Vector> r) const {
  Eigen::Index row = 0;
  for (const Contact& contact : contacts) {
    r[row] = std::max(0.0, r[row] - (G.row(row).dot(r) + b[row]) / G(row, row));
    auto r_t = r.segment(row + 1, contact.n_t);
    if (contact.slides) {
      for (int d = 0; d < contact.n_t; ++d) r_t[d] = -contact.mu * r[row] * contact.direction[d];
    } else if (contact.n_t > 0) {
      double largest = 0;
      for (int d = 0; d < contact.n_t; ++d) largest = std::max(largest, G(row + 1 + d, row + 1 + d));
      for (int d = 0; d < contact.n_t; ++d) r_t[d] -= (G.row(row + 1 + d).dot(r) + b[row + 1 + d]) / largest;
      const double size = r_t.norm(), cone = contact.mu * r[row];
      if (size > cone) r_t *= size > 0 ? cone / size : 0;
    }
    row += 1 + contact.n_t;
  }
}

}  // namespace ricochet
