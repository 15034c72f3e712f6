// Anitescu-Potra time stepping: a linear complementarity problem in velocities and impulses.
//
//   active: contacts i with f_c^i(q_k) <= 0; J_n, J_t, M at q_k
//
//   Collision, when an active contact approaches, J_n^i' v_k < 0 (time stands still):
//     compression    M (v_c - v_k) = J_n Lambda_c + J_t Lambda_t,c,   0 <= Lambda_c  _|_  J_n' v_c >= 0             (1)
//     decompression  M (v_d - v_c) = J_n (eps_r Lambda_c + Lambda_x) + J_t Lambda_t,d,
//                    0 <= Lambda_x  _|_  J_n' v_d >= 0                                                              (2)
//     and v_k is replaced by v_d. Poisson's hypothesis: what was compressed comes back times eps_r.
//   Step:
//     M (v_{k+1} - v_k) = h f(q_k, v_k) + J_n Lambda_n + J_t Lambda_t,   0 <= Lambda_n  _|_  J_n' v_{k+1} >= 0 (3)
//     q_{k+1} = q_k + h v_{k+1}                                                                          (4)
//   Coulomb's law with the velocity after each of (1), (2), (3), solved as in contact_step.h. Bilateral constraints
//   have J_n' v = 0 after each of them, with impulses of either sign.
//
// implicit=linear, for stiff forces: with f_q, f_v at (q_k, v_k) the step is
//     (M - h f_v - h^2 f_q) (v_{k+1} - v_k) = h f(q_k, v_k) + h^2 f_q v_k + J_n Lambda_n + J_t Lambda_t   (3b)
//
// Order 1, on smooth motion too: forces are explicit or linearly implicit, (4) is semi-implicit. For several
// simultaneous or oblique impacts Poisson's hypothesis differs from Newton's law, which the references use.
//
// Source: Anitescu, Potra, Nonlinear Dynamics 14 (1997) 231-247, section 3 (LCP) and section 5 (collisions); (3b):
// Anitescu, Potra, IJNME 55 (2002) 753-784.
// Differs from the source: the step is not shortened to the time of a collision; a contact that closes inside a step
// becomes active at the next one. Friction in space has the exact disc, but for lemke.

#include <fmt/format.h>

#include "methods/registry.h"
#include "methods/time_stepping/common/fixed_step_run.h"
#include "methods/time_stepping/common/time_stepping_method.h"

namespace ricochet {
namespace {

class AnitescuPotra final : public TimeSteppingMethod {
 public:
  explicit AnitescuPotra(const MethodSpec& spec)
      : TimeSteppingMethod(spec), is_implicit_(spec.choice("implicit", {"none", "linear"}) == "linear") {}

  MethodInfo info() const override {
    return {.id = id_,
            .title = is_implicit_ ? "Anitescu-Potra (2002), stiff forces" : "Anitescu-Potra (1997)",
            .source = is_implicit_ ? "Anitescu, Potra, IJNME 55 (2002) 753-784"
                                   : "Anitescu, Potra, Nonlinear Dynamics 14 (1997) 231-247",
            .order_smooth = 1,
            .order_impacts = 1,
            .is_adaptive = false,
            .is_audited = true,
            .is_allocation_free = !is_implicit_};
  }

  Support supports(const ProblemInfo&) const override { return Support::yes(); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override;

 private:
  bool is_implicit_;
};

Solution AnitescuPotra::do_solve(const Problem& problem, const Settings& settings) const {
  const ProblemInfo& info = problem.info();
  const int n_q = info.n_q;
  FixedStepRun run(problem, settings, solver_, observer_);
  const double h = run.h;
  ContactStep& contacts = run.contacts;
  Counters& counters = run.solution.counters;

  Matrix M(n_q, n_q);
  BlockInverse W;  // M^-1
  Vector f(n_q), Wf(n_q), no_shift = Vector::Zero(info.n_c()), rebound(info.n_c());
  const auto factorize = [&] {
    problem.mass_matrix(run.q.data(), M.data());
    W.compute(M, info.has_bilateral());
    ++counters.mass_factorizations;
  };
  if (info.structure.constant_mass) factorize();
  const int n_implicit = is_implicit_ ? n_q : 0;
  Matrix f_q(n_implicit, n_implicit), f_v(n_implicit, n_implicit), Mhat(n_implicit, n_implicit);
  BlockInverse What;  // Mhat^-1 of (3b)
  const auto factorize_implicit = [&] {
    problem.force_jacobians(run.q.data(), run.v.data(), info.u.data(), f_q.data(), f_v.data());
    Mhat = M - h * f_v - (h * h) * f_q;
    What.compute(Mhat, info.has_bilateral());
    ++counters.jacobian_evaluations;
    ++counters.matrix_factorizations;
  };
  const bool constant_matrix = info.structure.constant_mass && info.structure.constant_force_jacobian;
  if (is_implicit_ && constant_matrix) factorize_implicit();
  const BlockInverse& step_inverse = is_implicit_ ? What : W;

  /// (1), (2): replaces v by the velocity after the collision.
  const auto collide = [&](Vector& v) {
    if (!run.solve_contacts(v, no_shift, {})) return false;
    double largest = 0;
    for (std::size_t k = 0; k < run.active.size(); ++k) {
      const int i = run.active[k];
      const double impulse = info.contacts[i].eps_r * contacts.Lambda_n()[i];
      rebound[static_cast<Eigen::Index>(k)] = impulse;
      largest = std::max(largest, impulse);
    }
    if (largest == 0) return true;
    for (std::size_t k = 0; k < run.active.size(); ++k) {
      const double impulse = rebound[static_cast<Eigen::Index>(k)];
      contacts.add_normal_impulse(k, impulse, v, run.Lambda_n);
    }
    return run.solve_contacts(v, no_shift, rebound);
  };

  return run.take_steps([&](Vector& v_plus) {
    if (!info.structure.constant_mass) factorize();
    run.find_active(run.q);
    if (run.has_contact_problem()) {
      if (!run.prepare_contacts(run.q, W)) return false;
      bool approaches = false;
      for (const int i : run.active) approaches = approaches || run.impact_velocity(i) < 0;
      if (approaches && !collide(run.v)) return false;
    }
    problem.force(run.q.data(), run.v.data(), info.u.data(), f.data());
    f *= h;
    if (is_implicit_) {
      if (!constant_matrix) factorize_implicit();
      f.noalias() += (h * h) * f_q.lazyProduct(run.v);
    }
    step_inverse.apply(f, Wf);
    v_plus = run.v + Wf;
    ++counters.force_evaluations;
    ++counters.linear_solves;
    if (run.has_contact_problem()) {
      if (is_implicit_ && !run.prepare_contacts(run.q, What)) return false;
      if (!run.solve_contacts(v_plus, no_shift, {})) return false;  // (3), (3b)
    }
    run.q += h * v_plus;  // (4)
    return true;
  });
}

const bool registered = register_method<AnitescuPotra>({
    .name = "anitescu_potra",
    .usage = std::string("anitescu_potra[,implicit=none|linear]") + kContactSolverUsage,
    .summary = "Anitescu-Potra time stepping (1997; 2002 for stiff forces), Poisson's hypothesis",
    .examples = {"anitescu_potra", "anitescu_potra,implicit=linear",
                 "anitescu_potra,solver=pgs,contact_tolerance=1e-13",
                 "anitescu_potra,solver=newton,contact_tolerance=1e-13"},
});

}  // namespace
}  // namespace ricochet
