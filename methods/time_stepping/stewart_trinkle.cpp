// Stewart-Trinkle time stepping: contact at position level, inelastic.
//
//   M (v_{k+1} - v_k) = h f(q_k, v_k) + J_n Lambda_n + J_t Lambda_t,   M, J_n, J_t at q_k   (1)
//   0 <= Lambda_n  _|_  f_c(q_k) / h + J_n' v_{k+1} >= 0                                  (2)
//   Coulomb's law for Lambda_t and J_t' v_{k+1}                                           (3)
//   f_c(q_k) / h + J_n' v_{k+1} = 0 where bilateral                                       (4)
//   q_{k+1} = q_k + h v_{k+1}                                                             (5)
//
// (2) is the linearised gap at the end of the step: a contact closes exactly where the step ends, without penetration
// when the gap is affine, with O(h^2) else, and what is left of it is taken out by the next step. All contacts are in
// (2) (gap_contacts.h). The step that closes a contact loses the velocity over the gap, up to h |J_n' v|: order 1.
//
// Source: Stewart, Trinkle, IJNME 39 (1996) 2673-2691, eq. (12)-(16).
// Differs from the source: 1. forces at (q_k, v_k), M at q_k; 2. friction in space has the disc, but for lemke.

#include "methods/registry.h"
#include "methods/time_stepping/common/gap_stepping_method.h"

namespace ricochet {
namespace {

class StewartTrinkle final : public GapSteppingMethod {
 public:
  explicit StewartTrinkle(const MethodSpec& spec)
      : GapSteppingMethod(spec, "Stewart-Trinkle", "Stewart, Trinkle, IJNME 39 (1996) 2673-2691",
                          FrictionLaw::coulomb) {}
};

const bool registered = register_method<StewartTrinkle>({
    .name = "stewart_trinkle",
    .usage = std::string("stewart_trinkle") + kContactSolverUsage,
    .summary = "Stewart-Trinkle time stepping, gaps at the end of the step, inelastic",
    .examples = {"stewart_trinkle", "stewart_trinkle,solver=pgs,contact_tolerance=1e-13",
                 "stewart_trinkle,solver=newton,contact_tolerance=1e-13"},
});

}  // namespace
}  // namespace ricochet
