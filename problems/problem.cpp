#include "problems/problem.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "problems/dense_solve.h"
#include "problems/initial_state.h"
#include "problems/input_error.h"
#include "problems/levers.h"

namespace ricochet {

bool ProblemInfo::has_static_friction() const {
  return std::ranges::any_of(contacts, [](const ContactInfo& contact) { return contact.mu_static != 0; });
}

Matrix Problem::mass_matrix(const Vector& q) const {
  Matrix M(n_q(), n_q());
  mass_matrix(q.data(), M.data());
  return M;
}

Vector Problem::force(const Vector& q, const Vector& v) const {
  Vector f(n_q());
  force(q.data(), v.data(), info_.u.data(), f.data());
  return f;
}

Vector Problem::free_acceleration(const Vector& q, const Vector& v) const {
  return CholeskyFactors(mass_matrix(q)).solve(force(q, v));
}

Vector Problem::gap(const Vector& q) const {
  Vector f_c(n_c());
  gap(q.data(), f_c.data());
  return f_c;
}

Matrix Problem::normal_jacobian(const Vector& q) const {
  Vector packed(info_.n_normal_entries);
  normal_jacobian(q.data(), packed.data());
  Matrix J = Matrix::Zero(n_q(), n_c());
  for (int i = 0; i < n_c(); ++i) {
    const auto& contact = info_.contacts[i];
    for (std::size_t k = 0; k < contact.support.size(); ++k)
      J(contact.support[k], i) = packed[contact.normal_begin + k];
  }
  return J;
}

Matrix Problem::tangent_jacobian(const Vector& q) const {
  Vector packed(info_.n_tangent_entries);
  tangent_jacobian(q.data(), packed.data());
  Matrix J = Matrix::Zero(n_q(), info_.n_lambda_t);
  for (const auto& contact : info_.contacts) {
    const double* entry = packed.data() + contact.tangent_begin;
    for (int d = 0; d < contact.n_t; ++d) {
      for (const int k : contact.support) J(k, contact.tangent_index + d) = *entry++;
    }
  }
  return J;
}

Vector Problem::friction_coefficients(const Vector& q) const {
  Vector mu(n_c());
  friction_coefficients(q.data(), mu.data());
  return mu;
}

Vector Problem::friction_forces(const Vector& q, Vector lambda_t) const {
  if (lambda_t.size() == 0) return lambda_t;
  const Vector mu = friction_coefficients(q);
  for (int i = 0; i < n_c(); ++i) {
    const auto& contact = info_.contacts[i];
    if (contact.mu_varies) lambda_t.segment(contact.tangent_index, contact.n_t) *= mu[i];
  }
  return lambda_t;
}

Matrix Problem::force_directions(Matrix J) const {
  if (info_.clock >= 0 && J.cols() > 0) J.row(info_.clock).setZero();
  return J;
}

Vector Problem::gap_acceleration_bias(const Vector& q, const Vector& v) const {
  Vector b(n_c());
  gap_acceleration_bias(q.data(), v.data(), b.data());
  return b;
}

Vector Problem::switching_sizes(const Vector& q, const Vector& v) const {
  const auto n = q.size(), n_s = std::ssize(info_.switches) + std::ssize(info_.region);  // one of them is empty
  Matrix D(n_s, 2 * n + std::ssize(info_.parameters));
  switching_derivative(q.data(), v.data(), D.data());
  return D.leftCols(n).cwiseAbs() * (1 + q.array().abs()).matrix() +
         D.middleCols(n, n).cwiseAbs() * (1 + v.array().abs()).matrix();
}

Vector Problem::slip_acceleration_bias(const Vector& q, const Vector& v) const {
  Matrix T(info_.n_lambda_t, n_q());
  slip_velocity_derivative(q.data(), v.data(), T.data());
  return T * v;
}

double Problem::kinetic_energy(const Vector& q, const Vector& v) const {
  const int n = info_.n_mechanical();
  return 0.5 * v.head(n).dot(mass_matrix(q).topLeftCorner(n, n) * v.head(n));
}

std::optional<double> Problem::energy(const Vector& q, const Vector& v) const {
  if (!info_.structure.has_potential) return std::nullopt;
  return kinetic_energy(q, v) + potential_energy(q.data());
}

namespace {

void require_finite(const std::string& field, const Vector& values) {
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    if (!std::isfinite(values[k]))
      throw InputError(fmt::format("{}[{}]", field, k), values[k], "a finite number is required");
  }
}

void require_size(const std::string& field, const Vector& values, int expected) {
  if (values.size() != expected) {
    throw InputError(fmt::format("size of {}", field), values.size(), fmt::format("{} entries are required", expected));
  }
}

// Rounding of the formulas for q0, v0 and the constraints: a few hundred units.
constexpr double kInitialRounding = 1e-13;
// Least component of a column of L^-1 G, M = L L', of length one, orthogonal to the other columns. Below it G' M^-1 G
// is singular in double precision.
constexpr double kRank = 1e-8;
// Hint for users of measured data.
constexpr const char* kProjection = "--allow-penetration DEPTH starts from the nearest position that respects all gaps";

void validate_bilateral(const Problem& problem, const Vector& f_c, const Matrix& J_n, const Matrix& M, double depth) {
  const ProblemInfo& info = problem.info();
  for (const int i : info.bilateral) {
    const auto field = [&](const char* name) {
      return fmt::format("contacts[{}].{} ({})", i, name, info.contacts[i].name);
    };
    const Vector J = J_n.col(i);
    const double most = kInitialRounding * J.cwiseAbs().dot(info.q0.cwiseAbs());
    if (std::abs(f_c[i]) > std::max(most, depth))
      throw InputError(
          field("gap"), f_c[i],
          fmt::format("|gap(q0)| <= {:.3g} is required, it is bilateral; {}", std::max(most, depth), kProjection));
    const double rate = J.dot(info.v0), most_rate = kInitialRounding * J.cwiseAbs().dot(info.v0.cwiseAbs());
    if (std::abs(rate) > most_rate && depth == 0)
      throw InputError(field("Jn' v0"), rate,
                       fmt::format("|Jn' v0| <= {:.3g} is required, it is bilateral", most_rate));
  }
  if (info.n_bilateral() > info.n_q)
    throw InputError("number of bilateral constraints", info.n_bilateral(),
                     fmt::format("at most n_q = {} are possible", info.n_q));
  Matrix G = M.llt().matrixL().solve(problem.force_directions(J_n)(Eigen::all, info.bilateral).eval());
  G.colwise().normalize();
  const Eigen::ColPivHouseholderQR<Matrix> qr(G);
  const double smallest = qr.matrixQR().diagonal().cwiseAbs().minCoeff();
  if (!(smallest >= kRank)) {
    const int i = info.bilateral[qr.colsPermutation().indices()[info.n_bilateral() - 1]];
    throw InputError(
        fmt::format("contacts[{}].Jn ({})", i, info.contacts[i].name), smallest,
        fmt::format("bilateral constraints must be independent: a component of at least {} orthogonal to the others is "
                    "required",
                    kRank));
  }
}

}  // namespace

namespace {

/// Requirements of an impact law on the contacts.
void validate_impact_law(const ProblemInfo& info) {
  const ImpactLaw& law = info.impact_law;
  if (law.hypothesis == ImpactHypothesis::newton) return;
  const std::string name(name_of(law.hypothesis));
  if (has_levers(info))
    throw InputError("impact_law.hypothesis", name,
                     "newton is required: the bound of a friction element is a contact's force");
  const bool is_lzb = law.hypothesis == ImpactHypothesis::lzb;
  for (const int i : info.unilateral) {
    const auto& contact = info.contacts[i];
    const auto field = [&](const char* entry) { return fmt::format("contacts[{}].{} ({})", i, entry, contact.name); };
    if (is_lzb && contact.n_t > 0)
      throw InputError(field("mu"), contact.mu, "impact law lzb has no friction: 0 is required");
    if (is_lzb && contact.eps_r_of_speed)
      throw InputError(field("e"), "a formula of vn",
                       "impact law lzb requires a coefficient that does not depend on vn");
    if (is_lzb && contact.eps_r == 0)
      throw InputError(field("e"), contact.eps_r, "impact law lzb divides by e: a value in (0, 1] is required");
    if (contact.n_t > 1)
      throw InputError(field("Jt"), contact.n_t,
                       fmt::format("impact law {} is defined in the plane: at most one tangent is possible", name));
  }
  if (!is_lzb) return;
  if (!(law.eta >= 1) || !std::isfinite(law.eta))
    throw InputError("impact_law.eta", law.eta, "a finite number >= 1 is required");
  if (!law.stiffness.empty() && static_cast<int>(law.stiffness.size()) != info.n_c())
    throw InputError("impact_law.stiffness, number of entries", law.stiffness.size(),
                     fmt::format("{}, one per contact, are required", info.n_c()));
  for (std::size_t i = 0; i < law.stiffness.size(); ++i) {
    if (!(law.stiffness[i] > 0) || !std::isfinite(law.stiffness[i]))
      throw InputError(fmt::format("impact_law.stiffness[{}]", i), law.stiffness[i], "a finite number > 0 is required");
  }
}

}  // namespace

void validate(const Problem& problem) {
  validate(problem, 0);
}

void validate(const Problem& problem, double depth) {
  const ProblemInfo& info = problem.info();
  if (info.n_q < 1) throw InputError("n_q", info.n_q, "at least one coordinate is required");
  require_size("q0", info.q0, info.n_q);
  require_size("v0", info.v0, info.n_q);
  require_size("u", info.u, info.n_u);
  for (const auto& parameter : info.parameters) {
    if (!std::isfinite(parameter.value)) {
      throw InputError("params." + parameter.name, parameter.value, "a finite number is required");
    }
  }
  require_finite("q0", info.q0);
  require_finite("v0", info.v0);
  require_finite("u", info.u);
  if (!(info.end_time > 0) || !std::isfinite(info.end_time)) {
    throw InputError("T", info.end_time, "a positive number of seconds is required");
  }
  for (int i = 0; i < info.n_c(); ++i) {
    const auto& contact = info.contacts[i];
    const auto field = [&](const char* name) { return fmt::format("contacts[{}].{} ({})", i, name, contact.name); };
    if (!(contact.eps_r >= 0 && contact.eps_r <= 1))
      throw InputError(field("e"), contact.eps_r, "eps_r in [0, 1] is required");
    if (!(contact.mu >= 0) || !std::isfinite(contact.mu))
      throw InputError(field("mu"), contact.mu, "mu >= 0 is required");
    if (contact.is_bilateral && contact.eps_r != 0)
      throw InputError(field("e"), contact.eps_r, "a bilateral constraint has no restitution, 0 is required");
    if (contact.is_bilateral && contact.mu != 0)
      throw InputError(field("mu"), contact.mu, "a bilateral constraint has no friction, 0 is required");
    if (contact.mu_static != 0 && (!(contact.mu_static >= contact.mu) || !std::isfinite(contact.mu_static)))
      throw InputError(
          contact.is_friction_element ? fmt::format("friction '{}': static_ratio", contact.name) : field("mu_static"),
          contact.mu_static, fmt::format("a finite number >= mu = {} is required", contact.mu));
    if (!contact.mu_varies) continue;
    if (const double mu = problem.friction_coefficients(info.q0)[i]; !(mu > 0) || !std::isfinite(mu))
      throw InputError(field("mu"), mu, "a formula of q or t > 0 is required, at q0 and along the motion");
  }

  validate_impact_law(info);

  const Matrix M = problem.mass_matrix(info.q0);
  if (!M.allFinite()) throw InputError("M(q0)", "not finite", "finite entries are required");
  // Entries have different units, kg and kg m^2; after scaling to a unit diagonal they can be compared.
  const Vector scale = M.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
  const Matrix scaled = scale.allFinite() ? Matrix(scale.asDiagonal() * M * scale.asDiagonal()) : M;
  const double asymmetry = (scaled - scaled.transpose()).cwiseAbs().maxCoeff();
  if (asymmetry > 1e-14 * scaled.cwiseAbs().maxCoeff()) {  // a few roundings of entries that are equal on paper
    throw InputError(
        "M(q0)", "not symmetric",
        fmt::format("a symmetric matrix is required, largest difference {:.3g} relative to the diagonal", asymmetry));
  }
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt(scaled.sparseView());
  const double smallest = ldlt.info() == Eigen::Success ? ldlt.vectorD().minCoeff() : 0;
  if (!scale.allFinite() || !(smallest > 1e-14)) {  // below, M^-1 has no correct digit in double precision
    throw InputError("M(q0)", fmt::format("smallest pivot {:.3g} relative to the diagonal", smallest),
                     "a positive definite, non-singular mass matrix is required");
  }
  if (!problem.force(info.q0, info.v0).allFinite())
    throw InputError("f(q0, v0)", "not finite", "a finite force is required");

  const Vector f_c = problem.gap(info.q0);
  const Matrix J_n = problem.normal_jacobian(info.q0), directions = problem.force_directions(J_n);
  for (int i = 0; i < info.n_c(); ++i) {
    const auto field = [&](const char* name) {
      return fmt::format("contacts[{}].{} ({})", i, name, info.contacts[i].name);
    };
    if (!std::isfinite(f_c[i])) throw InputError(field("gap"), f_c[i], "a finite gap at q0 is required");
    // Rounding of q0 itself can put a touching body this far below the surface.
    const double rounding = 1e-14 * (J_n.col(i).cwiseAbs().dot(info.q0.cwiseAbs()));
    if (f_c[i] < -std::max(rounding, depth) && !info.contacts[i].is_bilateral)
      throw InputError(field("gap"), f_c[i],
                       fmt::format("gap(q0) >= {} is required, the scene starts in penetration; {}",
                                   depth > 0 ? fmt::format("{:.3g}", -depth) : "0", kProjection));
    if (directions.col(i).cwiseAbs().maxCoeff() == 0)
      throw InputError(field("Jn"), 0, "the gap does not depend on any coordinate at q0");
  }
  if (info.has_bilateral()) validate_bilateral(problem, f_c, J_n, M, depth);
}

}  // namespace ricochet
