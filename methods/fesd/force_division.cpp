#include "methods/fesd/force_division.h"

#include <algorithm>

#include "methods/elements/redundant_system.h"
#include "problems/dense_solve.h"

namespace ricochet {
namespace {

constexpr int kMaxProjections = 500;
constexpr double kRelaxation = 1.8;
constexpr double kRounding = 1e-13;  // of a force, relative to the largest

/// The nearest point of ||x_t|| <= mu x_n. @param x  1 + n_t, x_n first
void project_onto_cone(double mu, Eigen::Ref<Vector> x) {
  if (x.size() == 1) {
    x[0] = std::max(x[0], 0.0);
    return;
  }
  const double force = x.tail(x.size() - 1).norm();
  if (force <= mu * x[0]) return;
  if (mu * force <= -x[0]) {
    x.setZero();
    return;
  }
  const double normal = (x[0] + mu * force) / (1 + mu * mu);
  x.tail(x.size() - 1) *= mu * normal / force;
  x[0] = normal;
}

}  // namespace

bool ForceDivision::into_cones(Element& element) const {
  const auto is_on_polygon = [](ContactMode mode) {
    return mode == ContactMode::vertex_slip || mode == ContactMode::edge_slip;
  };
  if (std::ranges::any_of(element.modes, is_on_polygon)) return false;
  Matrix lambda_n = element.lambda_n, lambda_t = element.lambda_t;
  for (Eigen::Index j = 0; j < lambda_n.cols(); ++j) {
    if (!divide(element.q.col(j), element.modes, lambda_n.col(j), lambda_t.col(j))) return false;
  }
  Vector end_lambda_n = element.end_lambda_n, end_lambda_t = element.end_lambda_t;
  if (!divide(element.q1, element.modes, end_lambda_n, end_lambda_t)) return false;
  element.lambda_n = lambda_n;
  element.lambda_t = lambda_t;
  element.end_lambda_n = end_lambda_n;
  element.end_lambda_t = end_lambda_t;
  return true;
}

ForceDivision::Forces ForceDivision::forces(const Vector& q, const std::vector<ContactMode>& modes,
                                            const Vector& lambda_n, const Vector& lambda_t, bool slide) const {
  const ProblemInfo& info = problem_.info();
  const Matrix J_n = problem_.force_directions(problem_.normal_jacobian(q)),
               J_t = problem_.force_directions(problem_.tangent_jacobian(q));
  Forces all;
  Matrix D(info.n_q, info.n_c() + info.n_lambda_t);
  Vector x(D.cols());
  Eigen::Index n = 0;
  const auto add = [&](const auto& column, double force) {
    D.col(n) = column;
    x[n++] = force;
  };
  for (int i = 0; i < info.n_c(); ++i) {
    if (!is_closed(modes[i])) continue;
    const auto& contact = info.contacts[i];
    const auto tangents = J_t.middleCols(contact.tangent_index, contact.n_t);
    const auto force = lambda_t.segment(contact.tangent_index, contact.n_t);
    const bool slides = slide && is_slipping(modes[i]);
    Cone cone{.contact = i, .normal = n, .n_t = slides ? 0 : contact.n_t, .friction = {}};
    if (slides) cone.friction = lambda_n[i] != 0 ? Vector(force / lambda_n[i]) : Vector(Vector::Zero(contact.n_t));
    add(slides ? Vector(J_n.col(i) + tangents * cone.friction) : Vector(J_n.col(i)), lambda_n[i]);
    for (int d = 0; d < cone.n_t; ++d) add(tangents.col(d), force[d]);
    all.cones.push_back(cone);
  }
  all.x = x.head(n);
  all.N = RankDecomposition(D.leftCols(n), RedundantSystem::kRank).null_space;  // (1)
  return all;
}

bool ForceDivision::divide(const Vector& q, const std::vector<ContactMode>& modes, Eigen::Ref<Vector> lambda_n,
                           Eigen::Ref<Vector> lambda_t) const {
  const Forces in_any_direction = forces(q, modes, lambda_n, lambda_t, false);
  const bool has_friction = std::ranges::any_of(in_any_direction.cones, [](const Cone& cone) { return cone.n_t > 0; });
  if (has_friction && can_wedge(in_any_direction)) return false;
  Forces divided = forces(q, modes, lambda_n, lambda_t, true);
  if (!reach_cones(divided.cones, divided.N, divided.x)) return false;
  for (const Cone& cone : divided.cones) {
    const auto& contact = problem_.info().contacts[cone.contact];
    lambda_n[cone.contact] = divided.x[cone.normal];
    auto force = lambda_t.segment(contact.tangent_index, contact.n_t);
    if (cone.n_t == 0)
      force = cone.friction * divided.x[cone.normal];
    else
      force = divided.x.segment(cone.normal + 1, cone.n_t);
  }
  return true;
}

/// Moves x by N y into the cones (2).
bool ForceDivision::reach_cones(const std::vector<Cone>& cones, const Matrix& N, Vector& x) const {
  const Vector start = x;
  for (int k = 0; k < kMaxProjections; ++k) {
    Vector inside = x;
    for (const Cone& cone : cones) {
      const auto& contact = problem_.info().contacts[cone.contact];
      if (!contact.is_bilateral) project_onto_cone(contact.mu, inside.segment(cone.normal, 1 + cone.n_t));
    }
    if ((inside - x).lpNorm<Eigen::Infinity>() <= kRounding * x.lpNorm<Eigen::Infinity>()) return true;
    if (N.cols() == 0) return false;
    x += kRelaxation * (inside - x);
    x = start + N * (N.transpose() * (x - start));
  }
  return false;
}

/// (3), with friction in any direction: where one contact of a wedge slides and another sticks, both stand still.
bool ForceDivision::can_wedge(const Forces& all) const {
  const Matrix& N = all.N;
  Vector normals = Vector::Zero(N.rows());
  for (const Cone& cone : all.cones) normals[cone.normal] = problem_.info().contacts[cone.contact].is_bilateral ? 0 : 1;
  const Vector y = N.transpose() * normals;
  if (y.norm() <= kRounding) return false;
  Vector x = N * y / y.squaredNorm();  // sum_i x_n^i = 1
  const Matrix Q = y.householderQr().householderQ() * Matrix::Identity(y.size(), y.size());
  return reach_cones(all.cones, N * Q.rightCols(y.size() - 1), x);  // the other columns change no sum
}

}  // namespace ricochet
