#pragma once

#include <optional>
#include <string>
#include <vector>

#include "methods/mpcc_equations/contact_equations.h"

namespace ricochet {

/// Time stepping by the implicit Euler method as rows and complementarity pairs of an MPCC. A step of length h from
/// (q_k, v_k), with (q, v) = (q_{k+1}, v_{k+1}):
///
///   q = q_k + h v,   v = v_k + h w                                                                        (1)
///   0 = M(q) w - f_v(q, v) - B_u u - J_n(q) lambda_n - J_t(q) lambda_t                                    (2)
///
/// so that h lambda_n is the impulse of the step, and an impact is a large force. Friction is that of
/// contact_equations.h between lambda and v. For the normal direction there are two laws. Law::position,
///
///   0 <= lambda_n  _|_  f_c(q) >= 0,                                                                      (3)
///
/// has no restitution. Law::velocity is Newton's with the coefficient eps_r, for contacts that are closed in the middle
/// of a step that is predicted with v_k, q_m = q_k + h/2 v_k:
///
///   f_c(q_m) = g+ - g-,   J_n(q)' (v + eps_r v_k) = s+ - s-
///   0 <= lambda_n  _|_  g+ + s+ >= 0,   0 <= g+  _|_  g- >= 0,   0 <= g-  _|_  s- >= 0                    (4)
///
/// An open contact has g- = 0: s- is free, and lambda_n = 0. A closed one has g+ = 0 = s-: 0 <= lambda_n _|_ s+ >= 0.
/// A contact closes at the next step, and is a little penetrated before it does.
///
/// Sources: (3) Stewart, Trinkle, Int. J. Numerical Methods in Engineering 39 (1996), in the implicit form in which
/// Posa, Cantu, Tedrake, Int. J. Robotics Research 33 (2014) optimise; (4) Jean, CMAME 177 (1999): Moreau-Jean with
/// theta = 1, whose simulation is methods/time_stepping/moreau_jean.cpp.
class TimeSteppingEquations final : public ContactEquations {
 public:
  enum class Law { position, velocity };

  struct Options {
    std::optional<Law> law = {};  ///< default: velocity when some contact has eps_r > 0
    Cone cone = Cone::exact;
    int facets = 8;  ///< of Cone::polyhedral in space
  };

  /// @param mpcc  receives all variables, rows and pairs; must outlive this object, like `plant`
  /// @throws InputError for Law::position with restitution
  TimeSteppingEquations(const Problem& plant, const Options& options, Mpcc& mpcc);

  struct Step {
    int h = -1;
    Point left;  ///< without gap and slip, which only the initial state has
    Stage end;
    std::vector<int> g_plus, g_minus, s_plus, s_minus;  ///< of Law::velocity
  };

  /// One step of length h, a variable. @return its right end
  Point add_step(const Point& left, const std::vector<int>& u, int h);

  const std::vector<Step>& steps() const { return steps_; }

  Vector position(const Vector& x, int step) const { return values(x, steps_[step].end.point.q); }
  Vector velocity(const Vector& x, int step) const { return values(x, steps_[step].end.point.v); }
  Vector normal_impulse(const Vector& x, int step) const {
    return x[steps_[step].h] * values(x, steps_[step].end.lambda_n);
  }
  Vector tangential_impulse(const Vector& x, int step) const {
    return x[steps_[step].h] * values(x, tangential(steps_[step].end.force));
  }

  /// The step's variables for a motion from (q_k, v_k) to (q, v) in a time h under the forces lambda.
  void set_guess(int step, double h, const Vector& q_k, const Vector& v_k, const Vector& q, const Vector& v,
                 const Vector& lambda_n, const Vector& lambda_t);

 private:
  void add_velocity_law(Step& step, const std::string& name);

  const Law law_;
  SmoothFunction implicit_euler_;  // (1): of one coordinate
  std::vector<Step> steps_;
};

}  // namespace ricochet
