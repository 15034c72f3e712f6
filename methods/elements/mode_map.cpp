#include "methods/elements/mode_map.h"

#include <limits>

#include "methods/elements/redundant_system.h"
#include "methods/linear_algebra/small_lu.h"
#include "problems/dense_solve.h"

namespace ricochet {
namespace {

// Complex systems of more unknowns take longer than the factors that Newton's method keeps, which knows islands.
constexpr int kMaxCoordinates = 8;
constexpr std::size_t kMaxMaps = 64;
// Rounding of terms that cancel, relative to them.
constexpr double kSumRounding = 8 * std::numeric_limits<double>::epsilon();
// Accelerations across closed contacts, relative to those without forces, that are taken out of the forces once more.
constexpr double kLeft = 1e-11;

bool is_affine(const ProblemInfo& info, const ActiveSet& active) {
  return info.structure.constant_mass && info.structure.constant_force_jacobian && !active.has_curved() &&
         !active.turns();
}

/// a + b c, zero where that is rounding.
Matrix cancelled(const Matrix& a, const Matrix& b, const Matrix& c) {
  const Matrix size = a.cwiseAbs() + b.cwiseAbs() * c.cwiseAbs();
  const Matrix sum = a + b * c;
  return (sum.array().abs() <= kSumRounding * size.array()).select(0, sum);
}

}  // namespace

ModeMap::ModeMap(const Problem& problem, const ActiveSet& active, const Vector& q, const Vector& v)
    : modes(active.modes()), facets(active.facets()), u(problem.info().u), q_r(q), v_r(v) {
  if (is_affine(problem.info(), active)) set(problem, active);
}

void ModeMap::set(const Problem& problem, const ActiveSet& active) {
  const ProblemInfo& info = problem.info();
  const int n = info.n_q, n_rows = active.n_rows();
  is_constant = !info.structure.force_uses_position && !info.structure.force_uses_velocity;
  if (!is_constant && n > kMaxCoordinates) return;

  Vector f(n);
  Matrix f_q = Matrix::Zero(n, n), f_v = f_q;
  problem.force(q_r.data(), v_r.data(), info.u.data(), f.data());
  if (!is_constant) problem.force_jacobians(q_r.data(), v_r.data(), info.u.data(), f_q.data(), f_v.data());
  const PartialPivotingFactors M(problem.mass_matrix(q_r));
  A0 = M.solve(f);
  Aq = M.solve_columns(f_q);
  Av = M.solve_columns(f_v);
  R = Matrix::Zero(n, n_rows);
  Matrix C = R;
  Vector J_n(info.n_normal_entries), J_t(info.n_tangent_entries);
  problem.normal_jacobian_of(active.contacts(), q_r.data(), J_n.data());
  if (active.has_friction()) problem.tangent_jacobian_of(active.contacts(), q_r.data(), J_t.data());
  for (const ActiveContact& closed : active.closed()) {
    const auto& contact = info.contacts[closed.contact];
    const auto entries = static_cast<int>(contact.support.size()), n_pushed = static_cast<int>(contact.pushed().size());
    for (int m = 0; m < entries; ++m) {
      const int at = contact.support[m];
      const double* tangent = J_t.data() + contact.tangent_begin + m;
      R(at, closed.row) = J_n[contact.normal_begin + m];
      for (int held = 0; held < closed.n_rows - 1; ++held) {
        for (int d = 0; d < contact.n_t; ++d)
          R(at, closed.row + 1 + held) += closed.law.held[held][d] * tangent[d * entries];
      }
      if (m >= n_pushed) continue;
      C.row(at).segment(closed.row, closed.n_rows) = R.row(at).segment(closed.row, closed.n_rows);
      for (int d = 0; d < contact.n_t; ++d)
        C(at, closed.row) -= contact.mu * closed.law.along[d] * tangent[d * entries];
    }
  }
  if (n_rows > 0) {
    const Matrix MC = M.solve_columns(C), system = R.transpose() * MC;
    SmallLu lu;
    Ls = lu.of(system);
    if (RedundantSystem::is_singular(system, Ls)) return;
    B = MC * Ls;
    // (1) for s = 0: C lambda = -C (R' M^-1 C)^-1 R' M^-1 f
    const Matrix to_forces = -Ls * R.transpose();
    const auto constrain = [&](auto& A, auto& L) {
      const Matrix free = A;
      L = to_forces * free;
      A = cancelled(free, MC, L);
      // Where a light body carries a heavy one, forces are known to rounding times the ratio of the masses; what they
      // leave of R' w tells the rest.
      const Matrix left = R.transpose() * A, size = R.cwiseAbs().transpose() * free.cwiseAbs();
      if (!(left.array().abs() > kLeft * size.array()).any()) return;
      L -= Ls * left;
      A = cancelled(free, MC, L);
    };
    constrain(A0, L0);
    constrain(Aq, Lq);
    constrain(Av, Lv);
  } else {
    Lq.resize(0, n);
    Lv.resize(0, n);
  }
  exists = A0.allFinite() && Aq.allFinite() && Av.allFinite();
}

const ModeMap* ModeMaps::of(const ActiveSet& active) {
  for (const ModeMap& map : kept_) {
    if (map.modes == active.modes() && map.facets == active.facets() && map.u == problem_.info().u)
      return map.exists ? &map : nullptr;
  }
  if (kept_.size() == kMaxMaps) kept_.pop_front();
  kept_.emplace_back(problem_, active, q_r_, v_r_);
  counters_.force_evaluations += kept_.back().exists;
  return kept_.back().exists ? &kept_.back() : nullptr;
}

}  // namespace ricochet
