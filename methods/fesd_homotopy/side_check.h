#pragma once

#include <string>
#include <vector>

#include "methods/elements/element_motion.h"
#include "methods/elements/fesd_step.h"
#include "problems/regions/step_functions.h"

namespace ricochet {

/// Checks a solved step of a scene whose forces bend or jump. Its equations state the side of every psi_k at the stages
/// and ends of elements only ((12) of fesd_equations.h). The check is that
///
/// (a) psi_k stays on the side theta_k of its element, at 16 points of the element's motion,
///
///         (2 theta_k - 1) psi_k >= -delta sum_j |d psi_k / dx_j| (1 + |x_j|),   x = (q, v)                        (1)
///
///     and if it is a function of the time alone, it has no zero inside, by interval arithmetic;
/// (b) where the motion stays on psi_k = 0 with theta_k inside of (0, 1), both sides lead back to it,
///
///         d psi_k/dv M^-1 (F(theta_k = 1) - F(theta_k = 0)) <= 0                                                  (2)
///
///     or, if psi_k does not depend on v, the same with d psi_k/dq. Otherwise the motion is not unique. If it stays on
///     several, minus the matrix of (2), with rows k and columns l, must be a P-matrix;
/// (c) at the start of a run and after an impact, where psi_k = 0 by chance, not both sides lead away,
///
///         not (r(1) > 0 > r(0)),   r(theta_k) = d psi_k/dt with the forces of that side                           (3)
///
///     and if both rates are zero, the same for d^2 psi_k/dt^2 of a psi_k of q with constant gradient.
class SideCheck {
 public:
  /// @param steps  of `problem`; both must outlive this object
  SideCheck(const Problem& problem, const StepFunctions& steps, const ButcherTableau& tableau);

  /// Why a step is no motion of the scene; empty if it is one.
  /// @param theta  n_s x stages, of each element; `accuracy`: delta; `is_start`: the step is the first one
  std::string operator()(const FesdStep& step, const std::vector<Matrix>& theta, double accuracy, bool is_start);

 private:
  /// The sides of an element: 0, 1, or the interior value.
  Vector sides_of(const Matrix& theta) const;
  std::string leaves(const Element& element, const Vector& sides, double accuracy);
  Matrix derivative(const Vector& q, const Vector& v, const Vector& sides) const;
  /// The acceleration M^-1 F on one side of psi_k, without contact forces.
  Vector acceleration(const Vector& q, const Vector& v, Vector sides, int k, int side) const;
  std::string is_not_unique(const Element& element, const Vector& sides) const;
  std::string branches(const Element& element, const Vector& sides, double accuracy) const;

  const Problem& problem_;
  const StepFunctions& steps_;
  const ElementMotion motion_;
};

}  // namespace ricochet
