// Anitescu-Potra time stepping: a linear complementarity problem in velocities and impulses.
//
//   active: contacts i with f_c^i(q_k) <= 0; J_n, J_t, M at q_k
//
//   Collision, when an active contact approaches, J_n^i' v_k < 0 (time stands still):
//     compression    M (v_c - v_k) = J_n Lambda_c + J_t Lambda_t,c,   0 <= Lambda_c  _|_  J_n' v_c >= 0             (1)
//     decompression  M (v_d - v_c) = J_n (eps_r Lambda_c + Lambda_x) + J_t Lambda_t,d,  0 <= Lambda_x _|_ J_n' v_d >= 0
//     (2) and v_k is replaced by v_d. Poisson's hypothesis: what was compressed comes back times eps_r.
//   Step:
//     M (v_{k+1} - v_k) = h f(q_k, v_k) + J_n Lambda_n + J_t Lambda_t,   0 <= Lambda_n  _|_  J_n' v_{k+1} >= 0 (3)
//     q_{k+1} = q_k + h v_{k+1}                                                                          (4)
//   Coulomb's law with the velocity after each of (1), (2), (3), solved as in contact_step.h. Bilateral constraints
//   have J_n' v = 0 after each of them, with impulses of either sign.
//
// Order 1, on smooth motion too: forces are explicit, (4) is semi-implicit. For several simultaneous or oblique impacts
// Poisson's hypothesis differs from Newton's law, which the references use.
//
// Source: Anitescu, Potra, Nonlinear Dynamics 14 (1997) 231-247, section 3 (LCP) and section 5 (collisions).
// Differs from the source: the step is not shortened to the time of a collision; a contact that closes inside a step
// becomes active at the next one.

#include <fmt/format.h>

#include "methods/registry.h"
#include "methods/time_stepping/march.h"

namespace ricochet {
namespace {

class AnitescuPotra final : public Method {
 public:
  explicit AnitescuPotra(const MethodSpec& spec) : id_(spec.text()), solver_(contact_solver_argument(spec)) {
    spec.finish(0);
  }

  MethodInfo info() const override {
    return {.id = id_,
            .title = "Anitescu-Potra (1997)",
            .source = "Anitescu, Potra, Nonlinear Dynamics 14 (1997) 231-247",
            .order_smooth = 1,
            .order_impacts = 1,
            .is_adaptive = false};
  }

  Support supports(const ProblemInfo&) const override { return Support::yes(); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override;

 private:
  std::string id_;
  ContactSolverOptions solver_;
};

Solution AnitescuPotra::do_solve(const Problem& problem, const Settings& settings) const {
  const ProblemInfo& info = problem.info();
  const int n_q = info.n_q;
  March march(problem, settings, solver_);
  const double h = march.h;
  ContactStep& contacts = march.contacts;
  Counters& counters = march.solution.counters;

  Matrix M(n_q, n_q);
  BlockInverse W;  // M^-1
  Vector f(n_q), Wf(n_q), no_shift = Vector::Zero(info.n_c()), rebound(info.n_c());
  const auto factorize = [&] {
    problem.mass_matrix(march.q.data(), M.data());
    W.compute(M, info.has_bilateral());
    ++counters.mass_factorizations;
  };
  if (info.structure.constant_mass) factorize();

  /// (1), (2): replaces v by the velocity after the collision.
  const auto collide = [&](Vector& v) {
    if (!march.solve_contacts(v, no_shift, {})) return false;
    double largest = 0;
    for (std::size_t k = 0; k < march.active.size(); ++k) {
      const int i = march.active[k];
      const double impulse = info.contacts[i].eps_r * contacts.Lambda_n()[i];
      rebound[static_cast<Eigen::Index>(k)] = impulse;
      largest = std::max(largest, impulse);
    }
    if (largest == 0) return true;
    for (std::size_t k = 0; k < march.active.size(); ++k) {
      const double impulse = rebound[static_cast<Eigen::Index>(k)];
      contacts.add_normal_impulse(k, impulse, v, march.Lambda_n);
    }
    return march.solve_contacts(v, no_shift, rebound);
  };

  return march.run([&](Vector& v_plus) {
    if (!info.structure.constant_mass) factorize();
    march.find_active(march.q);
    if (march.has_contact_problem()) {
      if (!march.prepare_contacts(march.q, W)) return false;
      bool approaches = false;
      for (std::size_t k = 0; k < march.active.size(); ++k)
        approaches = approaches || contacts.normal_velocity(k, march.v) < 0;
      if (approaches && !collide(march.v)) return false;
    }
    problem.force(march.q.data(), march.v.data(), info.u.data(), f.data());
    f *= h;
    W.apply(f, Wf);
    v_plus = march.v + Wf;
    ++counters.force_evaluations;
    ++counters.linear_solves;
    if (march.has_contact_problem() && !march.solve_contacts(v_plus, no_shift, {})) return false;  // (3)
    march.q += h * v_plus;                                                                         // (4)
    return true;
  });
}

const bool registered = register_method({
    .name = "anitescu_potra",
    .usage = std::string("anitescu_potra") + kContactSolverUsage,
    .summary = "Anitescu-Potra (1997) time stepping, LCP in velocities and impulses",
    .examples = {"anitescu_potra"},
    .make = [](const MethodSpec& spec) -> std::unique_ptr<Method> { return std::make_unique<AnitescuPotra>(spec); },
    .not_built = {},
});

}  // namespace
}  // namespace ricochet
