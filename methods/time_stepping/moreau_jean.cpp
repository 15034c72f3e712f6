// Moreau-Jean time stepping with the theta method, linearly implicit.
//
//   q_m = q_k + h/2 v_k                                                                       (1)
//   Mhat = M(q_m) - h theta f_v - h^2 theta^2 f_q,   f_q, f_v: derivatives of f at (q_k, v_k)        (2)
//   v_free = v_k + Mhat^-1 (h f(q_k, v_k) + h^2 theta f_q v_k)                                    (3)
//   v_{k+1} = v_free + Mhat^-1 sum_i (J_n^i Lambda_n^i + J_t^i Lambda_t^i),   i with f_c^i(q_m) <= 0    (4)
//   0 <= Lambda_n^i  _|_  J_n^i' (v_{k+1} + eps_r^i v_k) >= 0,   Coulomb's law for Lambda_t^i and J_t^i' v_{k+1}   (5)
//   G' (theta v_{k+1} + (1 - theta) v_k) = 0,   G: J_n of the bilateral constraints, whose impulses are in (4) too (5b)
//   q_{k+1} = q_k + h (theta v_{k+1} + (1 - theta) v_k)                                         (6)
//
// (2), (3) are one Newton step on M (v_{k+1} - v_k) = h (theta f_{k+1} + (1 - theta) f_k); J_n, J_t at q_m. (4), (5)
// are solved as in contact_lcp.h. (5b) holds for the velocity that moves q in (6): with theta = 1/2 the constraints do
// no work, and keep their gaps to O(h^2). Order 1 through impacts, since (5) acts where a step happens to end; on
// smooth motion order 2 for theta = 1/2, else 1.
//
// Source: Jean, CMAME 177 (1999); Acary, Brogliato, Numerical Methods for Nonsmooth Dynamical Systems (2008),
// section 10.1, eq. (10.7)-(10.12).
// Differs from the source: 1. M and the contact kinematics are taken at the midpoint (1), which keeps order 2 for
// configuration-dependent M; 2. the friction disc is a polygon in space.

#include <fmt/format.h>

#include "methods/complementarity/friction_cone.h"
#include "methods/registry.h"
#include "methods/small_inverse.h"
#include "methods/time_stepping/march.h"

namespace ricochet {
namespace {

class MoreauJean final : public Method {
 public:
  explicit MoreauJean(const MethodSpec& spec)
      : id_(spec.text()), theta_(spec.number("theta", 0.5, 0.5, 1)), n_facets_(facets_argument(spec)) {
    spec.finish(0);
  }

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("Moreau-Jean, theta = {}", theta_),
            .source = "Jean, CMAME 177 (1999); Acary, Brogliato (2008), section 10.1",
            .order_smooth = theta_ == 0.5 ? 2.0 : 1.0,
            .order_impacts = 1,
            .is_adaptive = false};
  }

  Support supports(const ProblemInfo&) const override { return Support::yes(); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override;

 private:
  std::string id_;
  double theta_;
  int n_facets_;
};

Solution MoreauJean::do_solve(const Problem& problem, const Settings& settings) const {
  const ProblemInfo& info = problem.info();
  const auto& structure = info.structure;
  const int n_q = info.n_q;
  March march(problem, settings, n_facets_);
  const double h = march.h;
  const Vector &q = march.q, &v = march.v;
  Counters& counters = march.solution.counters;

  Matrix M(n_q, n_q), f_q(n_q, n_q), f_v(n_q, n_q), Mhat(n_q, n_q), W(n_q, n_q);  // W = Mhat^-1
  Vector q_m(n_q), f(n_q), shift = Vector::Zero(info.n_c());
  SmallInverse inverse;
  const auto factorize = [&] {  // (2)
    problem.mass_matrix(q_m.data(), M.data());
    problem.force_jacobians(q.data(), v.data(), info.u.data(), f_q.data(), f_v.data());
    Mhat = M - (h * theta_) * f_v - (h * h * theta_ * theta_) * f_q;
    W = inverse.of(Mhat);
    ++counters.jacobian_evaluations;
    ++counters.matrix_factorizations;
  };
  const bool constant_matrix = structure.constant_mass && structure.constant_force_jacobian;
  q_m = q;
  if (constant_matrix) factorize();

  return march.run([&](Vector& v_plus) {
    q_m = q + (0.5 * h) * v;  // (1)
    if (!constant_matrix) factorize();
    problem.force(q.data(), v.data(), info.u.data(), f.data());
    f *= h;
    if (structure.force_uses_position) f.noalias() += (h * h * theta_) * f_q.lazyProduct(v);
    v_plus = v;
    v_plus.noalias() += W.lazyProduct(f);  // (3)
    ++counters.force_evaluations;
    ++counters.linear_solves;

    march.find_active(q_m);
    if (march.has_contact_problem()) {  // (4), (5)
      march.contacts.set_active(q_m, march.active);
      if (!march.contacts.set_inverse_mass(W)) return false;
      for (std::size_t k = 0; k < march.active.size(); ++k) {
        const int i = march.active[k];
        shift[i] = info.contacts[i].eps_r * march.contacts.normal_velocity(k, v);
      }
      march.contacts.bilateral_velocities(v, shift);
      for (const int i : info.bilateral) shift[i] *= (1 - theta_) / theta_;  // (5b)
      if (!march.solve_contacts(v_plus, shift, {})) return false;
    }
    march.q += (h * theta_) * v_plus + (h * (1 - theta_)) * v;  // (6)
    return true;
  });
}

const bool registered = register_method({
    .name = "moreau_jean",
    .usage = "moreau_jean[,theta=0.5][,facets=8]",
    .summary = "Moreau-Jean time stepping, theta method, linearly implicit",
    .examples = {"moreau_jean", "moreau_jean,theta=1"},
    .make = [](const MethodSpec& spec) -> std::unique_ptr<Method> { return std::make_unique<MoreauJean>(spec); },
    .not_built = {},
});

}  // namespace
}  // namespace ricochet
