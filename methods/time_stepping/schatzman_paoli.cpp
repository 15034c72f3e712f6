// Schatzman-Paoli time stepping: a two-step scheme for positions, written with v_{k+1} = (q_{k+1} - q_k) / h.
//
//   M(q_k) (q_{k+1} - 2 q_k + q_{k-1}) = h^2 f(q_k, v_k) + h (J_n Lambda_n + J_t Lambda_t)   (1)
//   0 <= Lambda_n  _|_  f_c((q_{k+1} + eps_r q_{k-1}) / (1 + eps_r)) >= 0                   (2)
//   Coulomb's law for Lambda_t and J_t' v_{k+1}                                           (3)
//   f_c(q_{k+1}) = 0 where bilateral                                                      (4)
//
// and v_0 = v(0) starts it. With gaps linearised at q_k, where J_n and J_t are taken too, (2) becomes
//
//   0 <= Lambda_n  _|_  J_n' (v_{k+1} - eps_r v_k) + (1 + eps_r) f_c(q_k) / h >= 0          (5)
//
// for all contacts (gap_contacts.h), and (4) the same with eps_r = 0. An impact takes two steps: q_{k+1} - q_s = -eps_r
// (q_{k-1} - q_s) reflects the position before at the surface q_s. v_k is a difference over the last step, and the
// penetration O(h): order 1.
//
// Source: Paoli, Schatzman, SIAM J. Numer. Anal. 40 (2002) 702-733 and 734-768, eq. (1.10); Acary, Brogliato (2008),
// section 10.2.
// Differs from the source: 1. gaps are linearised at q_k, exact for affine gaps; 2. friction (3) and bilateral
// constraints (4), which the source does not have; 3. an own eps_r for each contact.

#include "methods/registry.h"
#include "methods/time_stepping/common/gap_stepping_method.h"

namespace ricochet {
namespace {

class SchatzmanPaoli final : public GapSteppingMethod {
 public:
  explicit SchatzmanPaoli(const MethodSpec& spec)
      : GapSteppingMethod(spec, "Schatzman-Paoli", "Paoli, Schatzman, SIAM J. Numer. Anal. 40 (2002) 702-768",
                          FrictionLaw::coulomb) {}

  Support supports(const ProblemInfo&) const override { return Support::yes(); }

 protected:
  void set_shift(const FixedStepRun& run, Vector& shift) const override {  // (5)
    const ProblemInfo& info = run.problem.info();
    for (int i = 0; i < info.n_c(); ++i) {
      const double eps_r = info.contacts[i].eps_r;
      shift[i] *= (1 + eps_r) / run.h;
      if (eps_r > 0) shift[i] -= eps_r * run.impact_velocity(i);
    }
  }
};

const bool registered = register_method<SchatzmanPaoli>({
    .name = "schatzman_paoli",
    .usage = std::string("schatzman_paoli") + kContactSolverUsage,
    .summary = "Schatzman-Paoli time stepping, two-step scheme for positions",
    .examples = {"schatzman_paoli", "schatzman_paoli,solver=newton,contact_tolerance=1e-13"},
});

}  // namespace
}  // namespace ricochet
