#include "methods/contact_laws/redundant_contacts.h"

#include <cmath>

#include "methods/contact_laws/friction_set.h"
#include "problems/dense_solve.h"

namespace ricochet {
namespace {

constexpr double kNull = 1e-13;  // above the rounding of n eigenvalues, n eps, of a few hundred
constexpr int kMaxProjections = 200000;
constexpr double kOutside = 1e-9;     // distance from the affine space, relative
constexpr double kProjected = 1e-12;  // change of a round of projections, relative, that ends them

/// F_i of (2).
struct Face {
  enum class Kind { zero, ray, cone } kind = Kind::cone;
  double direction[2]{};  // of friction on the ray

  void project(const ContactProblem::Contact& contact, double* x) const {
    const int n_t = contact.n_t;
    if (kind == Kind::cone) return project_on_friction_set(contact.mu, n_t, contact.present, x);
    double along = 0;
    if (kind == Kind::ray) {  // x_t = mu (x_n + p) direction, x_n >= 0
      along = x[0];
      for (int d = 0; d < n_t; ++d)
        along += contact.mu * direction[d] * (x[1 + d] - contact.mu * contact.present * direction[d]);
      along = std::max(0.0, along / (1 + contact.mu * contact.mu));
    }
    x[0] = along;
    for (int d = 0; d < n_t; ++d) x[1 + d] = contact.mu * (along + contact.present) * direction[d];
  }
};

}  // namespace

RedundantContacts::RedundantContacts(const ContactProblem& problem) {
  const int n = problem.G.n_rows();
  Matrix G(n, n);
  problem.G.to_dense(G);
  const SymmetricEigen eigen(0.5 * (G + G.transpose()));
  values_ = eigen.values;
  while (n_null_ < n && values_[n_null_] <= kNull * values_[n - 1]) ++n_null_;
  null_ = eigen.vectors.leftCols(n_null_);
}

double RedundantContacts::condition() const {
  return n_null_ < n_rows() ? values_[n_rows() - 1] / values_[n_null_] : 1;
}

Vector RedundantContacts::internal_part(const Vector& r) const {
  return null_ * (null_.transpose() * r.head(n_rows()));
}

Vector RedundantContacts::least_norm(const ContactProblem& problem, const Vector& r, double tolerance) const {
  const int n = n_rows();
  Vector w(n);
  problem.G.times(r, problem.b, w);
  const double zero = tolerance * scale_of(problem, r).velocity;
  std::vector<Face> faces(problem.contacts.size());
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const auto& contact = problem.contacts[i];
    const double* w_i = w.data() + problem.G.row(i);
    const double speed = tangential_length(w_i + 1, contact.n_t);
    const double opening = w_i[0] - (problem.law == FrictionLaw::associated ? contact.mu * speed : 0);
    const bool slips = contact.n_t > 0 && speed > zero;
    if (slips) {
      for (int d = 0; d < contact.n_t; ++d) faces[i].direction[d] = -w_i[1 + d] / speed;
    }
    // An open contact has the friction of p alone, which is on the ray of its slip, or no impulse at all.
    faces[i].kind = opening > zero && contact.present == 0 ? Face::Kind::zero
                    : slips                                ? Face::Kind::ray
                                                           : Face::Kind::cone;
  }
  const Vector fixed = r.head(n) - internal_part(r);
  Vector x = Vector::Zero(n), correction = Vector::Zero(n);  // Dykstra: an affine space needs no correction of its own
  for (int k = 0; k < kMaxProjections; ++k) {
    const Vector before = x;
    Vector y = fixed + internal_part(x);
    const Vector to_project = y + correction;
    y = to_project;
    for (int i = 0; i < problem.G.n_contacts(); ++i) faces[i].project(problem.contacts[i], y.data() + problem.G.row(i));
    correction = to_project - y;
    x = y;
    // Corrections may grow while x rests, so that rest alone says nothing.
    const double size = r.head(n).norm(), outside = (fixed + internal_part(x) - x).norm();
    if ((x - before).norm() <= kProjected * size && outside <= kOutside * size) break;
  }
  return x;
}

}  // namespace ricochet
