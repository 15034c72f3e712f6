#include "methods/contact_laws/contact_problem.h"

#include <cmath>
#include <limits>

namespace ricochet {
namespace {

/// Derivative of the projection of y onto the circle of radius 1, times |y|: the part across y.
double across(const double* direction, int d, int e) {
  return (d == e ? 1 : 0) - direction[d] * direction[e];
}

double length(const double* x, int n) {
  return n == 0 ? 0 : n == 1 ? std::abs(x[0]) : std::hypot(x[0], x[1]);
}

/// F = r - P_K(r - rho w)
void project_on_cone(ContactMap& map, double mu, int n_t, double rho, const double* r, const double* w) {
  double y[3]{}, direction[2]{};
  for (int d = 0; d <= n_t; ++d) y[d] = r[d] - rho * w[d];
  const double size = length(y + 1, n_t);
  double P[3]{}, P_y[3][3]{};
  if (size <= mu * y[0]) {
    for (int d = 0; d <= n_t; ++d) {
      P[d] = y[d];
      P_y[d][d] = 1;
    }
  } else if (y[0] + mu * size > 0) {  // onto the ray (1, mu y_t / |y_t|)
    const double norm = 1 + mu * mu, s = (y[0] + mu * size) / norm;
    for (int d = 0; d < n_t; ++d) direction[d] = y[1 + d] / size;
    P[0] = s;
    P_y[0][0] = 1 / norm;
    for (int d = 0; d < n_t; ++d) {
      P[1 + d] = mu * s * direction[d];
      P_y[0][1 + d] = P_y[1 + d][0] = mu / norm * direction[d];
      for (int e = 0; e < n_t; ++e)
        P_y[1 + d][1 + e] = mu * mu / norm * direction[d] * direction[e] + mu * s / size * across(direction, d, e);
    }
  }
  for (int d = 0; d <= n_t; ++d) {
    map.F[d] = r[d] - P[d];
    for (int e = 0; e <= n_t; ++e) {
      map.F_r[d][e] = (d == e ? 1 : 0) - P_y[d][e];
      map.F_w[d][e] = rho * P_y[d][e];
    }
  }
}

double largest_diagonal(const Delassus& G, int i, int from = 0) {
  double largest = 0;
  for (int d = from; d < G.size(i); ++d) largest = std::max(largest, G.diagonal(i, d));
  return largest;
}

double largest_free_velocity(const ContactProblem& problem, int i) {
  const double* b = problem.b.data() + problem.G.row(i);
  double largest = 0;
  for (int d = 0; d < problem.G.size(i); ++d) largest = std::max(largest, std::abs(b[d]));
  return largest;
}

// Rounding of velocities, relative to the sum of their terms: that of a sum, and of a linear solve before it.
constexpr double kEpsilon = std::numeric_limits<double>::epsilon(), kRounding = 16 * kEpsilon;
// Part of V_i that rounding may have where impulses are large: masses of 1 and 1e8 need 1e-6.
constexpr double kMostRounding = 1e-5;
// Smaller parts of E sqrt(g_i) are zero: rounding of the velocities that b is made of.
constexpr double kLeastPart = 1e-5;

/// (7). @param E  velocity_scale()
double contact_violation(const ContactProblem& problem, int i, double E, const Vector& r, const Vector& w,
                         const FrictionPolygon& polygon, const Vector& known) {
  const auto& G = problem.G;
  const auto& contact = problem.contacts[i];
  const int row = G.row(i), n_t = contact.n_t;
  const double *r_i = r.data() + row, *w_i = w.data() + row;
  const double g = largest_diagonal(G, i), most = E * std::sqrt(g);
  // A friction impulse is worth the slip that it makes: none at the dead centre of a crank. The projection of the
  // associated law is onto a cone of both directions, which needs one unit.
  const double slip = n_t > 0 ? largest_diagonal(G, i, 1) : 0;
  const double g_t = slip > 0 && problem.law == FrictionLaw::coulomb ? slip : g;
  double impulse = 0;
  for (int d = 0; d <= n_t; ++d) {
    if (!std::isfinite(r_i[d]) || !std::isfinite(w_i[d])) return std::numeric_limits<double>::infinity();
    impulse = std::max(impulse, std::abs(r_i[d]));
  }
  double V = std::max(largest_free_velocity(problem, i), kLeastPart * most), worst = 0;  // as a velocity
  const bool is_polygon = polygon.applies(n_t);
  if (!is_polygon) {
    ContactMap map;
    map.evaluate(problem.law, contact, 1 / g, 1 / g_t, r_i, w_i);
    for (int d = 0; d <= n_t; ++d) worst = std::max(worst, (d == 0 ? g : g_t) * std::abs(map.F[d]));
    // Nothing is left. What other impulses would swallow, they swallow at their own contacts.
    if (worst <= kRounding * most && kEpsilon * g * impulse <= kMostRounding * V) return 0;
  }
  const double R = G.row_terms(i, r.data(), problem.b.data());
  V = std::max(V, std::min(R, most));
  const double rounding = std::min(kRounding * R, kMostRounding * V) + kRounding * most;
  if (known.size() > 0) V = std::max(V, known.segment(row, 1 + n_t).maxCoeff());
  if (is_polygon) {
    const double speed = polygon.speed(w_i + 1), pressed = contact.mu * (r_i[0] + contact.present);
    const double opening = w_i[0] - (problem.law == FrictionLaw::associated ? contact.mu * speed : 0);
    const double friction = std::abs(r_i[1] * w_i[1] + r_i[2] * w_i[2] + pressed * speed), size = std::max(V, R) / g;
    worst = std::max(std::abs(std::min(g * r_i[0], opening)), -g_t * polygon.margin(pressed, r_i + 1));
    if (size > 0) worst = std::max(worst, friction / size);
  }
  // Impulses of such a size swallow b, and w says nothing.
  if (kEpsilon * R > kMostRounding * V) return R / V;
  return worst > rounding ? (worst - rounding) / V : 0;
}

}  // namespace

void ContactMap::evaluate(FrictionLaw law, const ContactProblem::Contact& contact, double rho_n, double rho_t,
                          const double* r, const double* w, double tie) {
  const int n_t = contact.n_t;
  if (law == FrictionLaw::associated && n_t > 0) return project_on_cone(*this, contact.mu, n_t, rho_n, r, w);
  *this = {};
  const double pressed = r[0] - rho_n * w[0];
  const bool is_closed = pressed + tie > 0;
  F[0] = is_closed ? rho_n * w[0] : r[0];  // (5)
  F_r[0][0] = is_closed ? 0 : 1;
  F_w[0][0] = is_closed ? rho_n : 0;
  if (n_t == 0) return;
  const double radius = contact.mu * ((is_closed ? pressed : 0) + contact.present);
  double y[2]{}, direction[2]{};
  for (int d = 0; d < n_t; ++d) y[d] = r[1 + d] - rho_t * w[1 + d];
  const double size = length(y, n_t);
  for (int d = 0; d < n_t; ++d) {  // (6)
    if (size <= radius) {
      F[1 + d] = rho_t * w[1 + d];
      F_w[1 + d][1 + d] = rho_t;
      continue;
    }
    for (int e = 0; e < n_t; ++e) direction[e] = y[e] / size;
    F[1 + d] = r[1 + d] - radius * direction[d];
    for (int e = 0; e < n_t; ++e) {
      const double turn = radius / size * across(direction, d, e);
      F_r[1 + d][1 + e] = (d == e ? 1 : 0) - turn;
      F_w[1 + d][1 + e] = rho_t * turn;
    }
    if (is_closed) {
      F_r[1 + d][0] = -contact.mu * direction[d];
      F_w[1 + d][0] = contact.mu * rho_n * direction[d];
    }
  }
}

void clear_open_contacts(const ContactProblem& problem, Vector& r) {
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    auto r_i = r.segment(problem.G.row(i), problem.G.size(i));
    if (!(r_i[0] > 0) && problem.contacts[i].present == 0) r_i.setZero();
    r_i[0] = std::max(0.0, r_i[0]);
  }
}

ContactScale scale_of(const ContactProblem& problem, const Vector& r) {
  ContactScale scale;
  const int n = problem.G.n_rows();
  if (n == 0) return scale;
  scale.velocity = problem.b.head(n).cwiseAbs().maxCoeff();
  double smallest = 0;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    for (int d = 0; d < problem.G.size(i); ++d) {
      const double g = problem.G.diagonal(i, d);
      scale.velocity = std::max(scale.velocity, g * std::abs(r[problem.G.row(i) + d]));
      if (g > 0) smallest = smallest == 0 ? g : std::min(smallest, g);
    }
  }
  if (smallest > 0) scale.impulse = scale.velocity / smallest;
  return scale;
}

double velocity_scale(const ContactProblem& problem) {
  double square = 0;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const double velocity = largest_free_velocity(problem, i), g = largest_diagonal(problem.G, i);
    if (g > 0) square = std::max(square, velocity * velocity / g);
  }
  return std::sqrt(square);
}

double violation(const ContactProblem& problem, const Vector& r, const Vector& w, const FrictionPolygon& polygon,
                 const Vector& known) {
  const double E = velocity_scale(problem);
  double worst = 0;
  for (int i = 0; i < problem.G.n_contacts(); ++i)
    worst = std::max(worst, contact_violation(problem, i, E, r, w, polygon, known));
  return worst;
}

double violation(const ContactProblem& problem, const Vector& r, const FrictionPolygon& polygon, Vector& w) {
  problem.G.times(r, problem.b, w);
  return violation(problem, r, w, polygon);
}

int worst_contact(const ContactProblem& problem, const Vector& r, const Vector& w, const FrictionPolygon& polygon) {
  const double E = velocity_scale(problem);
  int contact = -1;
  double worst = 0;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const double value = contact_violation(problem, i, E, r, w, polygon, {});
    if (value <= worst) continue;
    worst = value;
    contact = i;
  }
  return contact;
}

}  // namespace ricochet
