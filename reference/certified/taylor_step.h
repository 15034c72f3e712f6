#pragma once

#include <chrono>

#include "reference/certified/ball_matrix.h"
#include "reference/certified/first_root.h"
#include "reference/certified/mode_motion.h"

/// @file
/// Taylor series of a motion, the length of a step, and the proof of the remainder by Picard's operator.

namespace ricochet::reference::certified {

/// The time limit is exceeded.
struct OutOfTime : std::runtime_error {
  using std::runtime_error::runtime_error;  ///< With the limit.
};

/// Wall time limit of a proof.
class TimeLimit {
 public:
  explicit TimeLimit(double seconds) : begin_(Clock::now()), limit_(seconds) {}
  double seconds() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }  ///< Until now.
  void check() const;  ///< @throws OutOfTime

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begin_;
  double limit_;
};

/// Variational equation of a motion: Phi' = D(v, a)/D(q, v) Phi, in the same program. A column that varies a parameter p
/// has D(v, a)/Dp in addition.
struct Variation {
  std::vector<std::vector<Node>> phi;  ///< 2n rows of variables
  std::vector<std::vector<Node>>
      rate;                    ///< n rows, derivative of the lower half; that of the upper half is the lower half
  std::vector<Node> schedule;  ///< what the ModeMotion does not compute already
  slong bits;                  ///< of its series
  int degree;                  ///< of its polynomials
};

/// Series of q' = v, v' = a on [0, h]. With p the Taylor polynomial of degree N, Picard's operator maps the set
///
///     { p(t) + (t/h)^(N+1) r(t):  |r| <= rho }                                                                  (1)
///
/// into itself if h (|c_N| h^N / (N+1) + rho_a / (N+2)) <= rho, where c_N and rho_a are those of v or a. By Schauder's
/// theorem it contains a solution, which is the only one because all formulas are smooth there. The contraction is
/// h L / (N+2), not h L, so that h is nearly the step of a method without proof.
///
/// While slip in space begins, its direction is one more variable (slip_start_in_space.cpp).
class TaylorStep {
 public:
  TaylorStep(const SceneFormulas& scene, SeriesProgram& program, const TimeLimit& limit)
      : scene_(scene), p_(program), limit_(limit) {}

  /// Proves remainders that are 2^bits times as large as their images, for certificates.
  void leave_room(int bits) { room_ = bits; }

  /// Sets the variables' values: q and v from `x`, 2n, and the clock.
  void load(const std::vector<Ball>& x, const Ball& t);
  /// Coefficients up to `order` of everything in motion.schedule, from loaded values.
  void expand(const ModeMotion& motion, int order);
  /// The same together with the variation from Phi(0) = Q, of which the first 2n rows are used.
  void expand(const ModeMotion& motion, const Variation& variation, const std::vector<std::vector<Ball>>& Q);

  /// A step length of Jorba and Zou, by the last coefficients of velocities and event functions [s].
  double suggested_length(const ModeMotion& motion) const;
  /// Whether the remainders on [0, h] are proven; they are in the program then.
  bool validate(const ModeMotion& motion, double h);
  /// The same for the variation, after that of its motion, whose remainders stay as they are.
  bool validate(const ModeMotion& motion, const Variation& variation, double h);

  /// Whether a function of q, v and t is zero on [0, h] for all motions of the set: all coefficients and the remainder
  /// are exactly zero. The motion must be validated.
  bool vanishes(Node node, double h);
  /// f(tau h) / tau^vanishing, of a node whose first `vanishing` coefficients are exactly zero.
  void polynomial(BoundedPolynomial& f, Node node, double h, int vanishing) const;
  /// Value of a node at t = tau h.
  Ball at(Node node, double h, const Ball& tau, slong bits) const;
  /// Value of the entry (i, k) of the variation at t = tau h.
  Ball at_of_variation(const Variation& variation, std::size_t i, std::size_t k, double h, const Ball& tau,
                       slong bits) const;

 private:
  /// A variable and its derivative with respect to time.
  using Rates = std::vector<std::pair<Node, Node>>;
  void polynomial(BoundedPolynomial& f, Node node, double h, int vanishing, int N) const;
  Rates rates(const ModeMotion& motion) const;
  Rates rates(const Variation& variation) const;
  void integrate(const Rates& rates, int k, slong bits);
  /// Contacts whose slip begins.
  using Starts = std::map<int, SlipStart>;
  bool contract(const std::vector<Node>& schedule, const Rates& rates, double h, int most_iterations,
                const Starts& starts = {});
  bool find_remainders(const std::vector<Node>& schedule);

  // slip_start_in_space.cpp
  Ball coefficient_of(Node node, int k) const;
  void expand_directions(const ModeMotion& motion, int k);
  void differentiate_directions(const Starts& starts, int order);
  bool begin_contraction(const Starts& starts, double h);
  bool find_remainders(const std::vector<Node>& schedule, const Starts& starts, std::vector<Magnitude>& fixed);
  bool least_slip(Magnitude& low, const SlipStart& start, double h) const;
  bool contract_directions(const Starts& starts, const std::vector<Magnitude>& fixed, double h, bool& is_inside);

  const SceneFormulas& scene_;
  SeriesProgram& p_;
  const TimeLimit& limit_;
  int room_ = 0;
};

/// Adds the variational equation of a motion, of full precision and degree.
/// @param phi  2n rows of variables
/// @param varied  the parameter that each column varies, or -1; empty: none
Variation variation_of(const ModeMotion& motion, const SceneFormulas& scene, std::vector<std::vector<Node>> phi,
                       SeriesProgram& program, const std::vector<Node>& varied = {});

}  // namespace ricochet::reference::certified
