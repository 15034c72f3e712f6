#include "methods/fesd/nonunique_motion.h"

#include <algorithm>
#include <cmath>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

// Singular values, motions and parts of x below this are rounding: columns have length one in the metric of M^-1.
constexpr double kRank = 1e-9;

}  // namespace

std::vector<std::string> contacts_of_nonunique_motion(const Problem& problem, const Vector& q, const Vector& v,
                                                      const std::vector<ContactMode>& modes) {
  const ProblemInfo& info = problem.info();
  const Matrix J_n = problem.normal_jacobian(q), J_t = problem.tangent_jacobian(q);
  Matrix A(info.n_q, info.n_c() + info.n_lambda_t), C = A;
  std::vector<int> contact_of;
  const auto add = [&](int i, const Vector& held, const Vector& pushed) {
    const auto n = static_cast<Eigen::Index>(contact_of.size());
    A.col(n) = held;
    C.col(n) = pushed;
    contact_of.push_back(i);
  };
  for (int i = 0; i < info.n_c(); ++i) {
    const auto& contact = info.contacts[i];
    if (!is_closed(modes[i])) continue;
    const Matrix tangents = J_t.middleCols(contact.tangent_index, contact.n_t);
    Vector friction = Vector::Zero(info.n_q);
    if (slip_sign(modes[i]) != 0) friction = contact.mu * slip_sign(modes[i]) * tangents.col(0);
    if (modes[i] == ContactMode::slip) friction = contact.mu * tangents * (tangents.transpose() * v).normalized();
    add(i, J_n.col(i), J_n.col(i) - friction);
    for (int d = 0; modes[i] == ContactMode::stick && d < contact.n_t; ++d) add(i, tangents.col(d), tangents.col(d));
  }
  const auto n = static_cast<Eigen::Index>(contact_of.size());
  if (n == 0) return {};
  // L^-1 C with M = L L': its length is that of the motion in the metric of M.
  const CholeskyFactors M(problem.mass_matrix(q));
  Matrix held = M.solve_lower(problem.force_directions(A.leftCols(n))),
         motion = M.solve_lower(problem.force_directions(C.leftCols(n)));
  const Vector size = held.colwise().norm().transpose().cwiseMax(motion.colwise().norm().transpose());
  held *= size.cwiseInverse().asDiagonal();
  motion *= size.cwiseInverse().asDiagonal();
  const SingularValues svd(held.transpose() * motion);
  std::vector<std::string> names;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Vector x = svd.V.col(k);
    if (svd.values[k] > kRank || (motion * x).norm() <= kRank) continue;  // (1), (2)
    for (Eigen::Index l = 0; l < n; ++l) {
      const std::string& name = info.contacts[contact_of[l]].name;
      if (std::abs(x[l]) > kRank && std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  }
  return names;
}

}  // namespace ricochet
