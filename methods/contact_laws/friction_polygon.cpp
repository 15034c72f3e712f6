#include "methods/contact_laws/friction_polygon.h"

namespace ricochet {
namespace {

using Direction = std::array<double, 2>;

Direction minus(const Direction& x) {
  return {-x[0], -x[1]};
}

double dot(const Direction& x, const double* y) {
  return x[0] * y[0] + x[1] * y[1];
}

double cross(const Direction& x, const double* y) {
  return x[0] * y[1] - x[1] * y[0];
}

}  // namespace

FrictionPolygon::FrictionPolygon(int facets)
    : facets_(facets),
      inner_(facets > 0 ? std::cos(std::numbers::pi / facets) : 0),
      half_edge_(facets > 0 ? std::sin(std::numbers::pi / facets) : 0) {
  for (int k = 0; k < facets; ++k) {
    const double angle = std::numbers::pi * (2 * k + 1) / facets;
    vertices_.push_back(facet_direction(2, k, facets));
    normals_.push_back({std::cos(angle), std::sin(angle)});
  }
}

TangentialLaw FrictionPolygon::law(ContactMode mode, int n_t, int facet) const {
  TangentialLaw law;
  if (mode == ContactMode::stick) {
    law.n_held = n_t;
  } else if (mode == ContactMode::vertex_slip) {
    law.along = minus(vertex(facet));
  } else if (mode == ContactMode::edge_slip) {
    law.along = {-inner_ * normal(facet)[0], -inner_ * normal(facet)[1]};
    law.n_held = 1;
    law.held[0] = edge(facet);
  } else {
    law.along = {static_cast<double>(slip_sign(mode)), 0};
  }
  return law;
}

int FrictionPolygon::n_conditions(ContactMode mode) const {
  switch (mode) {
    case ContactMode::stick:
      return facets_;
    case ContactMode::vertex_slip:
      return 2;
    case ContactMode::edge_slip:
      return 3;
    case ContactMode::open:
    case ContactMode::closed:
    case ContactMode::slip_positive:
    case ContactMode::slip_negative:
    case ContactMode::slip:
      return 0;
  }
  return 0;
}

FacetCondition FrictionPolygon::condition(ContactMode mode, int facet, int c) const {
  if (mode == ContactMode::stick) return {true, normal(c), inner_, c};
  if (mode == ContactMode::vertex_slip) {  // the neighbours dissipate less
    if (c == 0) return {false, edge(facet), 0, facet};
    return {false, minus(edge(previous(facet))), 0, previous(facet)};
  }
  if (c == 0) return {true, edge(facet), half_edge_, next(facet)};
  if (c == 1) return {true, minus(edge(facet)), half_edge_, facet};
  return {false, minus(normal(facet)), 0, facet};
}

int FrictionPolygon::nearest_vertex(double angle) const {
  const int k = static_cast<int>(std::lround(angle * facets_ / (2 * std::numbers::pi)));
  return (k + facets_) % facets_;
}

int FrictionPolygon::most_dissipative(const double* v_t) const {
  return nearest_vertex(std::atan2(-v_t[1], -v_t[0]));
}

ContactMode FrictionPolygon::locate(const double* lambda_t, double radius, double rounding, int& facet) const {
  facet = nearest_vertex(std::atan2(lambda_t[1], lambda_t[0]));
  const double across = cross(vertex(facet), lambda_t);
  if (std::abs(across) <= rounding * radius) return ContactMode::vertex_slip;
  if (across < 0) facet = previous(facet);
  return ContactMode::edge_slip;
}

double FrictionPolygon::margin(double mu_lambda_n, const double* lambda_t) const {
  double most = 0;
  for (const Direction& n : normals_) most = std::max(most, dot(n, lambda_t));
  return mu_lambda_n - most / inner_;
}

double FrictionPolygon::speed(const double* v_t) const {
  double most = 0;
  for (const Direction& d : vertices_) most = std::max(most, -dot(d, v_t));
  return most;
}

std::vector<double> FrictionPolygon::facet_forces(ContactMode mode, int facet, const double* lambda_t) const {
  std::vector<double> l(vertices_.size(), 0.0);
  const Direction &d = vertex(facet), &d_next = vertex(next(facet));
  if (mode == ContactMode::vertex_slip) l[facet] = dot(d, lambda_t);
  if (mode == ContactMode::edge_slip) {
    const double area = cross(d, d_next.data());
    l[facet] = -cross(d_next, lambda_t) / area;
    l[next(facet)] = cross(d, lambda_t) / area;
  }
  return l;
}

std::vector<double> FrictionPolygon::facet_rates(const double* v_t) const {
  std::vector<double> rates;
  const double gamma = speed(v_t);
  for (const Direction& d : vertices_) rates.push_back(dot(d, v_t) + gamma);
  return rates;
}

}  // namespace ricochet
