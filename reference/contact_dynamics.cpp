#include "reference/contact_dynamics.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/dense_solve.h"
#include "reference/active_set.h"
#include "reference/force_division.h"

namespace ricochet::reference {
namespace {

std::string too_many(std::size_t contacts, std::size_t most) {
  return fmt::format("{} contacts act at once, and the reference, which tries every combination, at most {}", contacts,
                     most);
}

/// x with R' M^-1 R x = b, as nearly as redundant columns of R allow.
Vector least_correction(const Matrix& R, const Matrix& MR, const Vector& b) {
  const Vector s = R.cwiseProduct(MR).colwise().sum().cwiseSqrt().cwiseInverse();
  const Matrix A = s.asDiagonal() * (R.transpose() * MR) * s.asDiagonal();
  return s.asDiagonal() * least_squares(A, s.cwiseProduct(b));
}

}  // namespace

ContactDynamics::ContactDynamics(const Problem& problem, const Scales& scales)
    : problem_(problem),
      scales_(scales),
      constant_mass_(problem.info().structure.constant_mass),
      diagonal_mass_(problem.info().structure.diagonal_mass && constant_mass_),
      modes_(problem.info().contacts.size(), ContactMode::open),
      held_(problem.info().contacts.size()),
      determined_(problem.info().contacts.size(), true) {
  const int n_q = problem.n_q();
  for (const int i : problem.info().bilateral) modes_[i] = ContactMode::closed;
  set_modes(std::vector(modes_));
  M_ = problem.mass_matrix(problem.info().q0);
  llt_.compute(M_);
  ++mass_factorizations;
  inverse_diagonal_ = M_.diagonal().cwiseInverse();
  f_.resize(n_q);
  packed_.resize(problem.info().n_normal_entries);
  bias_.resize(problem.n_c());
}

void ContactDynamics::set_modes(const std::vector<ContactMode>& modes) {
  modes_ = modes;
  closed_.clear();
  rubs_ = false;
  for (int i = 0; i < problem_.n_c(); ++i) {
    held_[i].resize(0);
    if (!is_closed(modes[i])) continue;
    closed_.push_back(i);
    rubs_ = rubs_ || modes[i] != ContactMode::closed;
  }
}

bool ContactDynamics::acceleration(const double* q, const double* v, double* a, double* lambda_n, double* lambda_t) {
  const int n_q = problem_.n_q();
  problem_.force(q, v, problem_.info().u.data(), f_.data());
  ++force_evaluations;
  if (!constant_mass_) {
    problem_.mass_matrix(q, M_.data());
    llt_.compute(M_);
    ++mass_factorizations;
    if (llt_.info() != Eigen::Success) return false;
  }
  Eigen::Map<Vector> acceleration(a, n_q);
  if (diagonal_mass_)
    acceleration = inverse_diagonal_.cwiseProduct(f_);
  else
    acceleration = llt_.solve(f_);
  if (closed_.empty()) return true;
  return rubs_ ? add_frictional_forces(q, v, acceleration, lambda_n, lambda_t)
               : add_contact_forces(q, v, acceleration, lambda_n);
}

bool ContactDynamics::add_contact_forces(const double* q, const double* v, Eigen::Ref<Vector> a, double* lambda_n) {
  const auto n = static_cast<Eigen::Index>(closed_.size());
  problem_.normal_jacobian(q, packed_.data());
  problem_.gap_acceleration_bias(q, v, bias_.data());
  Matrix J = Matrix::Zero(problem_.n_q(), n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto& contact = problem_.info().contacts[closed_[k]];
    const double* entry = packed_.data() + contact.normal_begin;
    for (const int row : contact.support) J(row, k) = *entry++;
  }
  const Matrix MJ = llt_.solve(problem_.force_directions(J));
  const auto lambda = solve_for_forces(J, MJ, MJ, bias_(closed_), a);
  if (!lambda) return false;
  for (Eigen::Index k = 0; k < n; ++k) lambda_n[closed_[k]] = (*lambda)[k];
  return true;
}

/// (5), and its accelerations added to a. @param MR, MC  M^-1 R, M^-1 C
std::optional<Vector> ContactDynamics::solve_for_forces(const Matrix& R, const Matrix& MR, const Matrix& MC,
                                                        const Vector& bias, Eigen::Ref<Vector> a) {
  const ForceEquations equations(R.transpose() * MC, R.cwiseProduct(MR).colwise().sum());
  const Vector size = R.cwiseAbs().transpose() * a.cwiseAbs() + bias.cwiseAbs();
  auto lambda = equations.solve(-(R.transpose() * a) - bias, size);
  if (!lambda) return std::nullopt;
  if (is_redundant_ || equations.null_space().cols() > 0) {
    if (!equations.determines_motion(M_.diagonal().cwiseSqrt().asDiagonal() * MC)) return std::nullopt;
    note_redundancy(equations);
    if (is_redundant_) lambda = steadiest_division(*lambda, equations.null_space(), force_cones());
  }
  a += MC * *lambda;
  return lambda;
}

/// The cones of closed contacts, in the order of their unknowns.
std::vector<ForceCone> ContactDynamics::force_cones() const {
  std::vector<ForceCone> cones;
  Eigen::Index row = 0;
  for (const int i : closed_) {
    const auto& contact = problem_.info().contacts[i];
    const int n_t = modes_[i] == ContactMode::stick ? contact.n_t : 0;
    if (!contact.is_bilateral) cones.push_back({row, n_t, contact.mu});
    row += 1 + n_t;
  }
  return cones;
}

void ContactDynamics::note_redundancy(const ForceEquations& equations) {
  is_redundant_ = equations.null_space().cols() > 0;
  Eigen::Index row = 0;
  for (const int i : closed_) {
    const int n_rows = 1 + (modes_[i] == ContactMode::stick ? problem_.info().contacts[i].n_t : 0);
    determined_[i] = true;
    for (int d = 0; d < n_rows; ++d) determined_[i] = determined_[i] && equations.determines(row++);
  }
}

bool ContactDynamics::add_frictional_forces(const double* q, const double* v, Eigen::Ref<Vector> a, double* lambda_n,
                                            double* lambda_t) {
  const int n_q = problem_.n_q();
  const Vector q_vector = Eigen::Map<const Vector>(q, n_q), v_vector = Eigen::Map<const Vector>(v, n_q);
  const Matrix J_n = problem_.normal_jacobian(q_vector), J_t = problem_.tangent_jacobian(q_vector);
  const Vector normal_bias = problem_.gap_acceleration_bias(q_vector, v_vector);
  const Vector slip_bias = problem_.slip_acceleration_bias(q_vector, v_vector);

  const Eigen::Index most = static_cast<Eigen::Index>(closed_.size()) + problem_.info().n_lambda_t;
  Matrix R(n_q, most), C(n_q, most);
  Vector bias(most);
  std::vector<Vector> direction(closed_.size());
  Eigen::Index n = 0;
  for (std::size_t k = 0; k < closed_.size(); ++k) {
    const int i = closed_[k];
    const auto& contact = problem_.info().contacts[i];
    const auto tangents = J_t.middleCols(contact.tangent_index, contact.n_t);
    R.col(n) = C.col(n) = J_n.col(i);
    bias[n] = normal_bias[i];
    if (is_slipping(modes_[i])) {  // (4)
      if (modes_[i] != ContactMode::slip)
        direction[k] = Vector::Constant(1, slip_sign(modes_[i]));
      else if (held_[i].size() > 0)
        direction[k] = held_[i];
      else
        direction[k] = (tangents.transpose() * v_vector).normalized();
      C.col(n) -= contact.mu * tangents * direction[k];
    }
    ++n;
    if (modes_[i] != ContactMode::stick) continue;
    R.middleCols(n, contact.n_t) = C.middleCols(n, contact.n_t) = tangents;
    bias.segment(n, contact.n_t) = slip_bias.segment(contact.tangent_index, contact.n_t);
    n += contact.n_t;
  }
  const Matrix MR = llt_.solve(problem_.force_directions(R.leftCols(n))),
               MC = llt_.solve(problem_.force_directions(C.leftCols(n)));
  const auto lambda = solve_for_forces(R.leftCols(n), MR, MC, bias.head(n), a);
  if (!lambda) return false;

  n = 0;
  for (std::size_t k = 0; k < closed_.size(); ++k) {
    const int i = closed_[k];
    const auto& contact = problem_.info().contacts[i];
    Eigen::Map<Vector> tangential(lambda_t + contact.tangent_index, contact.n_t);
    lambda_n[i] = (*lambda)[n++];
    if (is_slipping(modes_[i])) tangential = -contact.mu * lambda_n[i] * direction[k];  // (4)
    if (modes_[i] != ContactMode::stick) continue;
    tangential = lambda->segment(n, contact.n_t);
    n += contact.n_t;
  }
  return true;
}

/// n_q x (1 + n_t of each): normal, then tangents, contact after contact.
Matrix ContactDynamics::jacobian(const Vector& q, const std::vector<int>& contacts) const {
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

Matrix ContactDynamics::under_constraints(const Vector& q, const Matrix& right_hand_side) const {
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

Matrix ContactDynamics::response(const Vector& q, const Matrix& p) const {
  Matrix right_hand_side = Matrix::Zero(p.rows() + problem_.info().n_bilateral(), p.cols());
  right_hand_side.topRows(p.rows()) = problem_.force_directions(p);
  return under_constraints(q, right_hand_side).topRows(p.rows());
}

ContactDynamics::Decision ContactDynamics::coulomb_law(ContactQuestion question, const std::vector<int>& contacts,
                                                       const std::vector<Vector>& directions) const {
  for (const int i : contacts) {
    const auto& contact = problem_.info().contacts[i];
    question.contacts.push_back({contact.n_t, contact.mu, directions.empty() ? Vector() : directions[i]});
    question.names.push_back(contact.name);
  }
  const ContactAnswer answer = answer_coulomb_law(question);
  Decision decision{answer.failure, answer.modes, {}, {}, {}};
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

ContactDynamics::Decision ContactDynamics::impact(const Vector& q, const Vector& v_minus,
                                                  const std::vector<int>& touching,
                                                  const std::vector<char>& last) const {
  const Matrix J = jacobian(q, touching);
  const Matrix MJ = response(q, J);
  Vector b = J.transpose() * v_minus;
  Eigen::Index n = 0;
  for (const int i : touching) {
    const auto& contact = problem_.info().contacts[i];
    if (last.empty() || !last[i]) b[n] *= 1 + contact.eps_r;  // (6)
    n += 1 + contact.n_t;
  }
  Decision decision;
  if (problem_.info().has_friction()) {
    const Vector b_size = 2 * scales_.speed(J, v_minus);
    decision = coulomb_law({"impact law", {}, {}, J, MJ, v_minus, b, b_size, false}, touching, {});
  } else if (touching.size() > kMaxPairs) {
    decision.failure = too_many(touching.size(), kMaxPairs);
  } else if (const auto z = solve_lcp_by_enumeration(J.transpose() * MJ, b)) {
    decision.motion = v_minus + MJ * *z;
    decision.normal = Vector::Zero(problem_.n_c());
    decision.normal(touching) = *z;
  } else {
    decision.failure = "the impact law has no solution";
  }
  if (decision.failure.empty() && problem_.info().has_bilateral()) add_bilateral_impulses(q, v_minus, decision);
  return decision;
}

/// (7) with p from the impulses of the decision
void ContactDynamics::add_bilateral_impulses(const Vector& q, const Vector& v_minus, Decision& decision) const {
  const auto& info = problem_.info();
  Vector right_hand_side = Vector::Zero(info.n_q + info.n_bilateral());
  Vector impulse = problem_.normal_jacobian(q) * decision.normal;
  if (info.has_friction()) impulse += problem_.tangent_jacobian(q) * decision.tangential;
  right_hand_side.head(info.n_q) = problem_.mass_matrix(q) * v_minus + problem_.force_directions(impulse);
  const Vector solution = under_constraints(q, right_hand_side);
  decision.motion = solution.head(info.n_q);
  decision.normal(info.bilateral) = solution.tail(info.n_bilateral());
}

ContactDynamics::Decision ContactDynamics::decide(const Vector& q, const Vector& v, const std::vector<int>& candidates,
                                                  const std::vector<Vector>& directions) const {
  const auto& info = problem_.info();
  const Matrix J = jacobian(q, candidates);
  const Matrix MJ = response(q, J);
  const Vector normal_bias = problem_.gap_acceleration_bias(q, v);
  const Vector slip_bias = problem_.slip_acceleration_bias(q, v);
  Vector right_hand_side(info.n_q + info.n_bilateral());
  right_hand_side << problem_.force(q, v), -normal_bias(info.bilateral);
  const Vector free = under_constraints(q, right_hand_side).topRows(info.n_q);  // (7)
  Vector bias(J.cols());
  Eigen::Index n = 0;
  for (const int i : candidates) {
    const auto& contact = problem_.info().contacts[i];
    bias[n] = normal_bias[i];                                                                  // (2)
    bias.segment(n + 1, contact.n_t) = slip_bias.segment(contact.tangent_index, contact.n_t);  // (3)
    n += 1 + contact.n_t;
  }
  const Vector b = J.transpose() * free + bias;
  if (info.has_friction()) {
    const Vector b_size = J.cwiseAbs().transpose() * free.cwiseAbs() + bias.cwiseAbs();
    return coulomb_law({"contact law", {}, {}, J, MJ, free, b, b_size, true}, candidates, directions);
  }
  Decision decision;
  if (candidates.size() > kMaxPairs) {
    decision.failure = too_many(candidates.size(), kMaxPairs);
    return decision;
  }
  const auto z = solve_lcp_by_enumeration(J.transpose() * MJ, b);
  if (!z) {
    decision.failure = "the contact force problem has no solution";
    return decision;
  }
  for (const double force : *z) decision.modes.push_back(force > 0 ? ContactMode::closed : ContactMode::open);
  return decision;
}

bool ContactDynamics::project(Vector& q, Vector& v, const std::vector<int>& touching, const std::vector<int>& closed,
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
