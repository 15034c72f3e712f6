#include "reference/contact_laws.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "problems/dense_solve.h"
#include "reference/active_set.h"
#include "reference/stated_impact.h"

namespace ricochet::reference {
namespace {

constexpr double kStopped = 1e-14;  // of its terms, a slip velocity that an impact has ended: what adding it up leaves

// Residual velocities of an impact, relative to those before it, above which its impulses are corrected.
constexpr double kRefinedImpact = 1e-11;

// Contacts without friction of which all combinations are tried: 2^8 take some 0.1 ms.
constexpr Eigen::Index kEnumerated = 8;

/// The law of contacts without friction.
std::optional<Vector> solve_lcp(const Matrix& G, const Vector& b) {
  return b.size() <= kEnumerated ? solve_lcp_by_enumeration(G, b) : solve_lcp_by_dual_steps(G, b);
}

/// Solves R' M^-1 R x = b, in the least-squares sense for redundant columns of R.
Vector least_correction(const Matrix& R, const Matrix& MR, const Vector& b) {
  const Vector s = R.cwiseProduct(MR).colwise().sum().cwiseSqrt().cwiseInverse();
  const Matrix A = s.asDiagonal() * (R.transpose() * MR) * s.asDiagonal();
  return s.asDiagonal() * least_squares(A, s.cwiseProduct(b));
}

}  // namespace

std::string ContactLaws::names(const std::vector<int>& contacts) const {
  std::vector<std::string> names;
  for (const int i : contacts) names.push_back("'" + problem_.info().contacts[i].name + "'");
  return fmt::format("{}", fmt::join(names, ", "));
}

/// n_q x (1 + n_t of each): normal, then tangents, contact after contact.
Matrix ContactLaws::jacobian(const Vector& q, const std::vector<int>& contacts) const {
  const Matrix J_n = problem_.normal_jacobian(q), J_t = problem_.tangent_jacobian(q);
  Matrix J(problem_.n_q(), problem_.n_c() + problem_.info().n_lambda_t);
  Eigen::Index n = 0;
  for (const int i : contacts) {
    const auto& contact = problem_.info().contacts[i];
    J.col(n) = J_n.col(i);
    J.middleCols(n + 1, contact.n_t) = J_t.middleCols(contact.tangent_index, contact.n_t);
    n += 1 + contact.n_t;
  }
  return J.leftCols(n);
}

Matrix ContactLaws::under_constraints(const Vector& q, const Matrix& right_hand_side) const {
  const auto& info = problem_.info();
  if (!info.has_bilateral()) return CholeskyFactors(problem_.mass_matrix(q)).solve_columns(right_hand_side);
  const Matrix G = problem_.normal_jacobian(q)(Eigen::all, info.bilateral);
  const Eigen::Index n = info.n_q + info.n_bilateral();
  Matrix K = Matrix::Zero(n, n);
  K.topLeftCorner(info.n_q, info.n_q) = problem_.mass_matrix(q);
  K.topRightCorner(info.n_q, info.n_bilateral()) = -problem_.force_directions(G);
  K.bottomLeftCorner(info.n_bilateral(), info.n_q) = G.transpose();
  return solve_partial_pivoting(K, right_hand_side);
}

Matrix ContactLaws::response(const Vector& q, const Matrix& p) const {
  Matrix right_hand_side = Matrix::Zero(p.rows() + problem_.info().n_bilateral(), p.cols());
  right_hand_side.topRows(p.rows()) = problem_.force_directions(p);
  return under_constraints(q, right_hand_side).topRows(p.rows());
}

Vector ContactLaws::free_acceleration(const Vector& q, const Vector& v) const {
  const auto& info = problem_.info();
  Vector right_hand_side(info.n_q + info.n_bilateral());
  right_hand_side << problem_.force(q, v), -problem_.gap_acceleration_bias(q, v)(info.bilateral);
  return under_constraints(q, right_hand_side).topRows(info.n_q);  // (2)
}

ContactLaws::Decision ContactLaws::coulomb_law(ContactQuestion question, const std::vector<int>& contacts,
                                               const std::vector<Vector>& directions) const {
  for (const int i : contacts) {
    const auto& contact = problem_.info().contacts[i];
    question.contacts.push_back({contact.n_t, contact.mu, directions.empty() ? Vector() : directions[i]});
    question.names.push_back(contact.name);
  }
  const ContactAnswer answer = answer_coulomb_law(question);
  Decision decision{answer.failure, answer.reason, answer.modes, {}, {}, {}};
  if (!decision.failure.empty()) return decision;
  decision.normal = Vector::Zero(problem_.n_c());
  decision.tangential = Vector::Zero(problem_.info().n_lambda_t);
  Eigen::Index n = 0;
  for (const int i : contacts) {
    const auto& contact = problem_.info().contacts[i];
    decision.normal[i] = std::max(0.0, answer.z[n]);  // down to rounding it may be negative
    decision.tangential.segment(contact.tangent_index, contact.n_t) = answer.z.segment(n + 1, contact.n_t);
    n += 1 + contact.n_t;
  }
  decision.motion = question.free + question.MJ * answer.z;
  return decision;
}

ContactLaws::Decision ContactLaws::impact(const Vector& q, const Vector& v_minus, const std::vector<int>& touching,
                                          const std::vector<char>& last) const {
  const Matrix J = jacobian(q, touching);
  const Matrix MJ = response(q, J);
  Vector b = J.transpose() * v_minus;
  Eigen::Index n = 0;
  for (const int i : touching) {
    const auto& contact = problem_.info().contacts[i];
    if (last.empty() || !last[i]) b[n] *= 1 + contact.restitution(b[n]);  // (1)
    n += 1 + contact.n_t;
  }
  Decision decision;
  if (problem_.info().impact_law.hypothesis != ImpactHypothesis::newton) {
    decision = stated_law(J, MJ, v_minus, touching, last);
  } else if (problem_.info().has_friction()) {
    const Vector b_size = 2 * scales_.speed(J, v_minus);
    decision = coulomb_law({"impact law", {}, {}, J, MJ, v_minus, b, b_size, false}, touching, {});
  } else if (const auto z = solve_lcp(J.transpose() * MJ, b)) {
    decision.motion = v_minus + MJ * *z;
    decision.normal = Vector::Zero(problem_.n_c());
    decision.normal(touching) = *z;
  } else {
    decision.failure = "the impact law has no solution at " + names(touching);
  }
  if (decision.failure.empty() && problem_.info().impact_law.hypothesis == ImpactHypothesis::newton)
    refine_impact(J, MJ, v_minus, b, touching, decision);
  if (decision.failure.empty() && problem_.info().has_bilateral()) add_bilateral_impulses(q, v_minus, decision);
  return decision;
}

/// The rounding errors of impulses grow with the ratio of masses; those of velocities do not. If the velocities violate
/// (1), the impulses of closed contacts are corrected.
void ContactLaws::refine_impact(const Matrix& J, const Matrix& MJ, const Vector& v_minus, const Vector& b,
                                const std::vector<int>& touching, Decision& decision) const {
  Matrix R(J.rows(), J.cols()), MR(J.rows(), J.cols());
  Vector left(J.cols());
  std::vector<double*> impulses;
  Eigen::Index n = 0, columns = 0;
  const auto add = [&](Eigen::Index column, double target, double& impulse) {
    R.col(columns) = J.col(column);
    MR.col(columns) = MJ.col(column);
    left[columns++] = J.col(column).dot(decision.motion) - target;
    impulses.push_back(&impulse);
  };
  for (std::size_t k = 0; k < touching.size(); n += 1 + problem_.info().contacts[touching[k++]].n_t) {
    const int i = touching[k];
    const auto& contact = problem_.info().contacts[i];
    if (!(decision.normal[i] > 0)) continue;
    const ContactMode mode = decision.modes.empty() ? ContactMode::closed : decision.modes[k];
    const bool has_friction = contact.n_t > 0 && decision.tangential.size() > 0;
    const int n_t = has_friction ? contact.n_t : 0;
    auto tangential = decision.tangential.segment(has_friction ? contact.tangent_index : 0, n_t);
    add(n, J.col(n).dot(v_minus) - b[n], decision.normal[i]);  // b has 1 + e times that velocity
    if (is_slipping(mode)) MR.col(columns - 1) += MJ.middleCols(n + 1, n_t) * tangential / decision.normal[i];
    for (int d = 0; mode == ContactMode::stick && d < n_t; ++d) add(n + 1 + d, 0, tangential[d]);
  }
  if (columns < 2 || left.head(columns).cwiseAbs().maxCoeff() <= kRefinedImpact * b.cwiseAbs().maxCoeff()) return;
  const Vector x = least_correction(R.leftCols(columns), MR.leftCols(columns), left.head(columns));
  if (!x.allFinite()) return;
  decision.motion -= MR.leftCols(columns) * x;
  for (Eigen::Index c = 0; c < columns; ++c) *impulses[c] -= x[c];
}

/// Applies the law of the scene instead of (1).
ContactLaws::Decision ContactLaws::stated_law(const Matrix& J, const Matrix& MJ, const Vector& v_minus,
                                              const std::vector<int>& touching, const std::vector<char>& last) const {
  ProblemInfo info = problem_.info();
  for (const int i : touching) {
    if (last.empty() || !last[i] || touching.size() > 1) continue;
    info.contacts[i].eps_r = 0;
    info.contacts[i].eps_r_of_speed = nullptr;
  }
  const auto [failure, r] = stated_impulses(info, touching, J.transpose() * MJ, J.transpose() * v_minus);
  Decision decision;
  decision.failure = failure;
  if (!failure.empty()) return decision;
  decision.motion = v_minus + MJ * r;
  decision.normal = Vector::Zero(problem_.n_c());
  decision.tangential = Vector::Zero(info.n_lambda_t);
  const Vector slip = J.transpose() * decision.motion, slip_size = scales_.speed(J, v_minus);
  Eigen::Index n = 0;
  for (const int i : touching) {
    const auto& contact = info.contacts[i];
    decision.normal[i] = r[n];
    decision.tangential.segment(contact.tangent_index, contact.n_t) = r.segment(n + 1, contact.n_t);
    const bool sticks = contact.n_t > 0 && std::abs(slip[n + 1]) <= kStopped * slip_size[n + 1];
    decision.modes.push_back(contact.n_t == 0 ? ContactMode::closed : sticks ? ContactMode::stick : ContactMode::slip);
    n += 1 + contact.n_t;
  }
  return decision;
}

/// (2) with p from the impulses of the decision
void ContactLaws::add_bilateral_impulses(const Vector& q, const Vector& v_minus, Decision& decision) const {
  const auto& info = problem_.info();
  Vector right_hand_side = Vector::Zero(info.n_q + info.n_bilateral());
  Vector impulse = problem_.normal_jacobian(q) * decision.normal;
  if (info.has_friction()) impulse += problem_.tangent_jacobian(q) * decision.tangential;
  right_hand_side.head(info.n_q) = problem_.mass_matrix(q) * v_minus + problem_.force_directions(impulse);
  const Vector solution = under_constraints(q, right_hand_side);
  decision.motion = solution.head(info.n_q);
  decision.normal(info.bilateral) = solution.tail(info.n_bilateral());
}

ContactLaws::Decision ContactLaws::decide(const Vector& q, const Vector& v, const std::vector<int>& candidates,
                                          const std::vector<Vector>& directions) const {
  const auto& info = problem_.info();
  const Matrix J = jacobian(q, candidates);
  const Matrix MJ = response(q, J);
  const Vector normal_bias = problem_.gap_acceleration_bias(q, v);
  const Vector slip_bias = problem_.slip_acceleration_bias(q, v);
  const Vector free = free_acceleration(q, v);
  Vector bias(J.cols());
  Eigen::Index n = 0;
  for (const int i : candidates) {
    const auto& contact = problem_.info().contacts[i];
    bias[n] = normal_bias[i];
    bias.segment(n + 1, contact.n_t) = slip_bias.segment(contact.tangent_index, contact.n_t);
    n += 1 + contact.n_t;
  }
  const Vector b = J.transpose() * free + bias;
  if (info.has_friction()) {
    const Vector b_size = J.cwiseAbs().transpose() * free.cwiseAbs() + bias.cwiseAbs();
    return coulomb_law({"contact law", {}, {}, J, MJ, free, b, b_size, true}, candidates, directions);
  }
  Decision decision;
  const auto z = solve_lcp(J.transpose() * MJ, b);
  if (!z) {
    decision.failure = "the contact force problem has no solution at " + names(candidates);
    return decision;
  }
  for (const double force : *z) decision.modes.push_back(force > 0 ? ContactMode::closed : ContactMode::open);
  decision.motion = free + MJ * *z;
  decision.normal = Vector::Zero(problem_.n_c());
  decision.normal(candidates) = *z;
  return decision;
}

bool ContactLaws::project(Vector& q, Vector& v, const std::vector<int>& touching, const std::vector<int>& closed,
                          const std::vector<char>& resting) const {
  for (int iteration = 0; iteration < 2 && !touching.empty();
       ++iteration) {  // the drift is small: the second is rounding
    const Matrix J_n = problem_.normal_jacobian(q)(Eigen::all, touching);
    const Matrix MJ = CholeskyFactors(problem_.mass_matrix(q)).solve_columns(problem_.force_directions(J_n));
    q -= MJ * least_correction(J_n, MJ, problem_.gap(q)(touching));
  }
  if (closed.empty()) return q.allFinite();
  const Matrix J = jacobian(q, closed);
  std::vector<Eigen::Index> zero;  // columns of J whose velocity vanishes
  Eigen::Index n = 0;
  for (const int i : closed) {
    const int n_t = problem_.info().contacts[i].n_t;
    zero.push_back(n);
    for (int d = 1; resting[i] && d <= n_t; ++d) zero.push_back(n + d);
    n += 1 + n_t;
  }
  const Matrix R = J(Eigen::all, zero);
  const Matrix MR = CholeskyFactors(problem_.mass_matrix(q)).solve_columns(problem_.force_directions(R));
  v -= MR * least_correction(R, MR, R.transpose() * v);
  return q.allFinite() && v.allFinite();
}

}  // namespace ricochet::reference
