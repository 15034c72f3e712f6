#pragma once

#include <set>
#include <string>
#include <vector>

#include "problems/problem.h"
#include "tests/tools/big_float.h"

namespace ricochet::arbiter {

/// Frictionless motion with constant forces, linear springs and plane gaps, solved event by event with 100 digits:
///
///   M q'' = c + K q + sum_i J_i lambda_i,   0 <= lambda_i _|_ g_i = J_i' q + b_i >= 0                          (1)
///   0 <= Lambda_i _|_ J_i'(v+ + e_i v-) >= 0 at the contacts that touch                                     (2)
///
/// M constant and diagonal. Columns of balls on a line are such systems, and so are rows of blocks without friction.
///
/// Between events the contacts A that are closed stay so: with G = J_A' M^-1 J_A,
///
///   lambda_A = -G^-1 J_A' M^-1 (c + K q),                                                                      (3)
///
/// q'' is affine in q, and the Taylor series of q in t follows by recursion. Each gap has its own series, whose
/// constant term is the gap itself, never a difference of positions: a gap keeps its 100 digits however small it
/// becomes. After an impact, and after a contact that breaks, the terms that vanish are set to zero. A zero of a
/// series p with p(0) > 0 is approached from the left: with B >= |p''| on the step,
///
///   p(s + d) >= p(s) + p'(s) d - B d^2 / 2,                                                                    (4)
///
/// and the step d to the zero of the right-hand side never passes a zero of p; near a simple one it converges as
/// Newton's method does.
///
/// Infinitely many impacts in finite time (inelastic collapse, a bouncing ball) are followed until the velocity after
/// an impact is below 10^-40; then the impact is plastic, e_i = 0. What is left out changes velocities by about 10^-40.
class EventArbiter {
 public:
  /// @throws std::invalid_argument for a problem that is not of the form (1)
  explicit EventArbiter(const Problem& problem);

  struct Result {
    std::vector<double> q, v;  ///< at the end time
    long impacts = 0;
    std::vector<double> collapses;  ///< when sequences of impacts ended in a plastic one [s]
  };
  /// @throws std::runtime_error where the motion depends on what happens at a double zero
  Result solve();

 private:
  using Series = std::vector<BigFloat>;  ///< coefficients of 1, t, t^2, ...
  struct Complementary {
    BigVector x;  ///< n_c, the impulses or forces
    std::vector<bool> active;
    BigVector w;  ///< n_c, G x + w0
  };
  enum class Kind { none, impact, opening };
  struct EventFound {
    BigFloat after;
    Kind kind = Kind::none;
    int contact = -1;
  };

  int n_c() const { return static_cast<int>(J_.size()); }
  BigFloat normal_velocity(int i) const;
  Complementary solve_complementarity(const std::vector<int>& contacts, const BigVector& w0, bool prefer_active) const;
  void impact(const std::vector<bool>& touching);
  void choose_active();
  void expand();
  EventFound next_event(const BigFloat& h) const;
  void advance(const EventFound& event);

  int n_ = 0;
  BigVector M_, c_, b_, e_, q_, v_;
  std::vector<BigVector> K_, J_;  ///< rows; J_[i] is the normal of contact i
  std::vector<BigVector> G_;      ///< of all contacts
  BigFloat end_, t_, step_;
  std::size_t terms_ = 0;

  BigVector gap_;
  std::vector<bool> active_;    ///< A
  std::vector<bool> resting_;   ///< touching without normal velocity: active, or about to open
  std::vector<int> vanishing_;  ///< leading terms of a gap's series that are zero
  std::vector<Series> position_, gap_series_, force_series_;
  Result result_;
};

}  // namespace ricochet::arbiter
