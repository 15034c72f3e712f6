// Anitescu's convex time stepping: a quadratic program with cone constraints in each step, inelastic.
//
//   v_{k+1} = arg min  1/2 v' M v - v' (M v_k + h f(q_k, v_k))   over all v with
//             f_c(q_k) / h + J_n' v >= mu ||J_t' v||   for every contact                  (1)
//             f_c(q_k) / h + J_n' v = 0   where bilateral                                 (2)
//   q_{k+1} = q_k + h v_{k+1}                                                             (3)
//
// M, J_n, J_t at q_k. The multipliers of (1) are the impulses, in Coulomb's cone, under the associated law of
// contact_problem.h: solved in this dual form, by any contact solver. The solution is unique and always exists, however
// many contacts there are; Painleve's paradox cannot happen. The price: slip opens a gap of h mu ||J_t' v||, which
// vanishes with h, and where slip meets the surface an impulse that does not: contacts hop with mu ||J_t' v|| / (1 + mu^2).
// Order 1; none where slip in space turns during the hop.
//
// Source: Anitescu, Math. Program. 105 (2006) 113-143, eq. (10)-(13); Tasora, Anitescu, CMAME 200 (2011) 439-453.
// Differs from the source: with lemke the cone is the polyhedral one of the source, with other solvers exact.

#include "methods/registry.h"
#include "methods/time_stepping/common/gap_stepping_method.h"

namespace ricochet {
namespace {

class AnitescuConvex final : public GapSteppingMethod {
 public:
  explicit AnitescuConvex(const MethodSpec& spec)
      : GapSteppingMethod(spec, "Anitescu (2006), convex", "Anitescu, Math. Program. 105 (2006) 113-143",
                          FrictionLaw::associated) {}
};

const bool registered = register_method<AnitescuConvex>({
    .name = "anitescu_convex",
    .usage = std::string("anitescu_convex") + kContactSolverUsage,
    .summary = "Anitescu (2006) time stepping, a convex program in each step, inelastic",
    .examples = {"anitescu_convex", "anitescu_convex,solver=pgs,contact_tolerance=1e-13",
                 "anitescu_convex,solver=newton,contact_tolerance=1e-13",
                 "anitescu_convex,solver=interior_point,contact_tolerance=1e-13"},
});

}  // namespace
}  // namespace ricochet
