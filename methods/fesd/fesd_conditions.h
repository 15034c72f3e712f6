#pragma once

#include <cstddef>
#include <iterator>

namespace ricochet {

/// The FESD-J equations of a step, as an audit evaluates them; their formulas are in kFesdConditions.
enum class FesdCondition : std::size_t {
  stage_position,
  stage_velocity,
  stage_acceleration,
  end_position,
  end_velocity,
  end_stage,
  continuity,
  impulse_balance,
  impulse_sign,
  impulse_gap,
  impulse_restitution,
  closed_separation,
  grid_gap,
  stage_gap,
  stage_force,
  cross_complementarity,
  step_equilibration,
  pinned_breaking,
  impulse_cone,  // friction
  impulse_slip,
  stage_cone,
  stage_slip,
  cross_friction,
  pinned_sliding,
  bilateral_gap,  // bilateral constraints
  bilateral_velocity,
  end_tangency,                // curved contacts
  end_force,                   // where (11) of end_projection.h gives the forces there
  aggregated_complementarity,  // other forms of conditions above, with the same solutions
  tanh_equilibration,
  step_length,
  count
};

/// Name and formula of a condition, numbered as in the paper's section 3: n counts elements, i contacts, j stages, n+1
/// is the right end of n. Corrections and open questions are those of DIFFERENCES.md.
struct FesdConditionText {
  FesdCondition condition;
  const char *name, *formula;
  const char* squared = nullptr;     ///< formula with FrictionCone::squared, where it is another one
  const char* polyhedral = nullptr;  ///< with FrictionCone::polyhedral in space
};

/// v_t = J_t' v, beta = mu lambda_n - ||lambda_t||, P: end_projection.h, (10).
///
/// Friction (correction 5). In the plane cross_friction is xi+_nj' (mu lambda_n + lambda_t)_nj = 0 = xi-_nj' (mu
/// lambda_n - lambda_t)_nj with v_t = xi+ - xi-, in space ||v_t,nj'|| beta_nj = 0; j' = 0..n_s and the right end.
/// Squared cones have v_t + 2 gamma lambda_t = 0 with gamma >= 0, which has no solution where a contact without force
/// slips: Residual::impossible. Polyhedral ones have gamma = -min_f d_f' v_t instead of ||v_t||, and the distance to
/// the border of the polygon instead of beta; mu lambda_n gamma + lambda_t' v_t is, with lambda_t = sum_f l_f d_f, the
/// sum of l_f (d_f' v_t + gamma) over f and of gamma (mu lambda_n - sum_f l_f), each of which is not negative.
///
/// Where P acts, on curved contacts, the forces at the right end take the place of those of the last stage in the
/// signs, the cone and the pinned switches.
inline constexpr FesdConditionText kFesdConditions[] = {
    {FesdCondition::stage_position, "stage position", "q_nj = q_n0 + h_n sum a_jk v_nk"},
    {FesdCondition::stage_velocity, "stage velocity", "v_nj = v_n0 + h_n sum a_jk F_v(q_nk, v_nk, u, lambda_nk)"},
    {FesdCondition::stage_acceleration, "stage acceleration", "a_nj = F_v(q_nj, v_nj, u, lambda_nj)"},
    {FesdCondition::end_position, "end position", "q_n+1 = q_n0 + h_n sum b_k v_nk"},
    {FesdCondition::end_velocity, "end velocity",  // correction 1
     "v_n+1 = P (v_n0 + h_n sum b_k F_v(q_nk, v_nk, u, lambda_nk))"},
    {FesdCondition::end_stage, "end stage",  // of a tableau that has a stage there, without P
     "lambda(right end of n) = lambda_n,ns"},
    {FesdCondition::continuity, "continuity", "q_n0 = q_n"},
    {FesdCondition::impulse_balance, "impulse balance", "M (v_n0 - v_n) = sum J_n Lambda_n"},
    {FesdCondition::impulse_sign, "impulse sign", "Lambda_n >= 0"},
    {FesdCondition::impulse_gap, "impulse gap", "Lambda_n f_c(q_n) = 0"},
    {FesdCondition::impulse_restitution, "impulse restitution",  // correction 4
     "Lambda_n J_n'(v_n0 + eps_r v_n) = 0; of impacts in sequence: no energy "
     "gained"},
    {FesdCondition::closed_separation, "closed separation",  // correction 9
     "J_n'(v_n0 + eps_r v_n) >= 0 where f_c(q_n) = 0"},
    {FesdCondition::grid_gap, "grid gap", "f_c(q_n) >= 0"},
    {FesdCondition::stage_gap, "stage gap", "f_c(q_nj) >= 0"},
    {FesdCondition::stage_force, "stage force", "lambda_nj >= 0"},
    {FesdCondition::cross_complementarity,
     "cross complementarity",  // correction 8; j' = 0..n_s and the right end
     "lambda_nj f_c(q_nj') = 0"},
    {FesdCondition::step_equilibration, "step equilibration", "(h_n - h_n-1) eta_n = 0"},  // correction 6
    {FesdCondition::pinned_breaking, "pinned breaking",                                    // open question 1
     "lambda(right end of n-1) sum_j f_c(q_nj) = 0"},
    {FesdCondition::impulse_cone, "impulse cone", "|Lambda_t| <= mu Lambda_n", "(mu Lambda_n)^2 - |Lambda_t|^2 >= 0",
     "Lambda_t in mu Lambda_n conv{d_f}"},
    {FesdCondition::impulse_slip, "impulse slip",
     "mu Lambda_n v_t + |v_t| Lambda_t = 0",  // at v_n0
     "v_t + 2 Gamma Lambda_t = 0", "mu Lambda_n gamma + Lambda_t'v_t = 0"},
    {FesdCondition::stage_cone, "stage cone", "|lambda_t,nj| <= mu lambda_n,nj",
     "(mu lambda_n,nj)^2 - |lambda_t,nj|^2 >= 0", "lambda_t,nj in mu lambda_n,nj conv{d_f}"},
    {FesdCondition::stage_slip, "stage slip", "mu lambda_n,nj v_t,nj + |v_t,nj| lambda_t,nj = 0",
     "v_t,nj + 2 gamma_nj lambda_t,nj = 0", "mu lambda_n,nj gamma_nj + lambda_t,nj'v_t,nj = 0"},
    {FesdCondition::cross_friction, "cross friction", "xi+-,nj' (mu lambda_n +- lambda_t)_nj = 0",
     "gamma_nj' ((mu lambda_n,nj)^2 - |lambda_t,nj|^2) = 0", "mu lambda_n,nj gamma_nj' + lambda_t,nj'v_t,nj' = 0"},
    {FesdCondition::pinned_sliding, "pinned sliding",
     "beta(right end of n-1) sum_j |v_t,nj| = 0",  // open question 1
     "beta(right end of n-1) sum_j |v_t,nj| = 0", "l_f(right end of n-1) sum_j (d_f'v_t + gamma)_nj = 0"},
    {FesdCondition::bilateral_gap, "bilateral gap", "f_c = 0"},  // at q_n, q_nj, q_n+1
    {FesdCondition::bilateral_velocity, "bilateral velocity", "J_n'v = 0 at v_n0, v_n+1"},
    {FesdCondition::end_tangency, "end tangency", "J_n'v_n+1 = 0, J_t'v_n+1 = 0 of stick"},
    {FesdCondition::end_force, "end force", "(J_n'v)' = 0, (J_t'v)' = 0 of stick at v_n+1"},
    {FesdCondition::aggregated_complementarity,
     "aggregated complementarity",  // one equation for n_s (n_s + 1)
     "sum_j lambda_nj sum_j' f_c(q_nj') = 0"},
    {FesdCondition::tanh_equilibration, "tanh equilibration", "(h_n - h_n-1) tanh(eta_n) = 0"},
    {FesdCondition::step_length, "step length", "sum h_n = H"},
};

static_assert(
    [] {
      for (std::size_t k = 0; k < std::size(kFesdConditions); ++k) {
        if (kFesdConditions[k].condition != static_cast<FesdCondition>(k)) return false;
      }
      return std::size(kFesdConditions) == static_cast<std::size_t>(FesdCondition::count);
    }(),
    "one row for each condition, in their order");

}  // namespace ricochet
