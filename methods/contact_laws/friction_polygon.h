#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Tangent direction of facet f of a polygon in place of the friction disc: +-1 in the plane, points of the unit circle
/// in space. @param n_t  1 or 2; @param facets  of the polygon, 2 in the plane
inline std::array<double, 2> facet_direction(int n_t, int f, int facets) {
  if (n_t == 1) return {f == 0 ? 1.0 : -1.0, 0.0};
  const double angle = 2 * std::numbers::pi * f / facets;
  return {std::cos(angle), std::sin(angle)};
}

inline bool has_friction_in_space(const ProblemInfo& info) {
  return std::any_of(info.contacts.begin(), info.contacts.end(), [](const auto& contact) { return contact.n_t == 2; });
}

/// The friction of a closed contact while its mode lasts, where it is linear: a known part along lambda_n, and unknown
/// components x_k in directions in which nothing slips,
///
///   lambda_t = -mu lambda_n along + sum_k x_k held_k,   held_k' v_t = 0                  (1)
///
/// Slip on the friction disc in space is not linear; it has along = 0 and nothing held here.
struct TangentialLaw {
  std::array<double, 2> along{};
  int n_held = 0;
  std::array<std::array<double, 2>, 2> held{{{1, 0}, {0, 1}}};
};

/// Condition on a contact on a polygon while its mode lasts,
///
///   direction' v_t >= 0   or   cone mu lambda_n - direction' lambda_t >= 0.               (2)
struct FacetCondition {
  bool is_of_force = false;
  std::array<double, 2> direction{};
  double cone = 0;
  int facet = -1;  ///< the edge or vertex that the contact comes to when (2) becomes zero; in vertex slip an edge
};

/// Friction in space with a regular polygon of `facets` vertices d_k in place of the disc of directions: lambda_t in mu
/// lambda_n conv{d_k}, and there the one that dissipates most. A contact that slips has its force
///
///   at a vertex, mu lambda_n d_k, as long as d_k' v_t is the least of all d_f' v_t; or
///   on the edge from d_k to d_k+1, with unit tangent e_k and unit outer normal n_k:
///     lambda_t = mu lambda_n cos(pi/F) n_k + x e_k,   |x| <= mu lambda_n sin(pi/F),   e_k' v_t = 0,   n_k' v_t <= 0.
///
/// Edges attract: v_t turns until it is normal to one, and stays so while a force on the edge can hold it there. In the
/// plane two facets are the cone itself, so that the polygon changes nothing there.
class FrictionPolygon {
 public:
  /// 0 facets: there is no polygon, friction in space has the disc.
  explicit FrictionPolygon(int facets = 0);

  int facets() const { return facets_; }
  /// Whether a contact with n_t tangent directions has a polygon.
  bool applies(int n_t) const { return facets_ > 0 && n_t == 2; }

  int next(int k) const { return k + 1 == facets_ ? 0 : k + 1; }
  int previous(int k) const { return k == 0 ? facets_ - 1 : k - 1; }
  const std::array<double, 2>& vertex(int k) const { return vertices_[static_cast<std::size_t>(k)]; }
  const std::array<double, 2>& normal(int k) const { return normals_[static_cast<std::size_t>(k)]; }
  std::array<double, 2> edge(int k) const { return {-normal(k)[1], normal(k)[0]}; }

  /// (1) of a contact with n_t tangent directions. @param facet  of vertex_slip and edge_slip
  TangentialLaw law(ContactMode mode, int n_t, int facet) const;

  /// Number of conditions (2) of a mode of a contact in space, and one of them.
  int n_conditions(ContactMode mode) const;
  FacetCondition condition(ContactMode mode, int facet, int c) const;

  /// Vertex that dissipates most at v_t, not zero.
  int most_dissipative(const double* v_t) const;

  /// Place of a force on the border of the polygon: at a vertex, up to `rounding` of the radius, or on an edge.
  /// @return vertex_slip or edge_slip; facet is set
  ContactMode locate(const double* lambda_t, double radius, double rounding, int& facet) const;

  /// mu lambda_n - the radius that lambda_t needs: the least of (2) of a sticking contact, divided by cos(pi/F).
  double margin(double mu_lambda_n, const double* lambda_t) const;

  /// gamma = -min_f d_f' v_t, the dissipation of the polygon per mu lambda_n.
  double speed(const double* v_t) const;

  /// l_f >= 0 with lambda_t = sum_f l_f d_f of a contact that slips; where it sticks they are not unique: zero.
  std::vector<double> facet_forces(ContactMode mode, int facet, const double* lambda_t) const;

  /// d_f' v_t + gamma >= 0
  std::vector<double> facet_rates(const double* v_t) const;

 private:
  int nearest_vertex(double angle) const;

  int facets_;
  double inner_, half_edge_;  // distance of an edge from the centre, half its length
  std::vector<std::array<double, 2>> vertices_, normals_;
};

}  // namespace ricochet
