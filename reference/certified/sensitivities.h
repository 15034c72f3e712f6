#pragma once

#include <functional>
#include <string>
#include <vector>

#include "reference/certified/certified_motion.h"
#include "reference/certified/decisions.h"

/// @file
/// Sensitivities: derivatives of a motion with respect to its initial state and its parameters, in balls.

namespace ricochet::reference::certified {

/// Encloses S = dx/dtheta, x = (q, v), one column per theta: q0, v0 and the parameters p. It follows a HybridMotion in
/// a program of its own, in which the parameters are variables, with the formulas of the same modes.
///
/// On a smooth piece with x' = f(x, t, p) = (v, a)
///
///     S' = D_x f S + D_p f                                                                                         (1)
///
/// is one more set of Taylor series, with remainders as those of the motion. The formulas are evaluated on boxes that
/// contain the motion, so that the variation of the motion is enclosed.
///
/// An event is where its function g(x, t, p) vanishes, at tau(theta). By the implicit function theorem, with f- before
/// and f+ after it and the map x+ = R(x-, t, p), which is the identity except at impacts,
///
///     dtau = -(g_x S- + g_p) / (g_x f- + g_t)                                                                      (2)
///     dx- = S- + f- dtau                                                                                           (3)
///     dx+ = R_x dx- + R_t dtau + R_p                                                                               (4)
///     S+ = dx+ - f+ dtau                                                                                           (5)
///
/// since dx-+ are the derivatives of the states at the time tau(theta). State and time of the event are known up to
/// small balls that contain the true ones; the right-hand sides are evaluated on these balls, so that they contain the
/// true S+.
///
/// An impact has y = (v+, Lambda) as the solution of r(y, q, v-, t, p) = 0, the equations of the contacts that receive
/// an impulse:
///
///     M (v+ - v-) - sum_j c_j Lambda_j = 0,   w+ = -e w- or 0,   v_t+ = 0 where the contact sticks                 (6)
///     dy = -r_y^-1 (r_q dq + r_v dv- + r_t dtau + r_p)                                                             (7)
///
/// At the end, the time of which may depend on p,
///
///     dx = S + f dT                                                                                                (8)
///
/// Why S is the derivative of motions: for all theta near the given one there is a motion with the same events and
/// modes. The decisions require strict inequalities, which small changes do not violate: gaps, forces, distances to
/// friction limits and slip velocities are positive between events; leading coefficients that are zero after an event
/// are so by its kind, for every theta; in impacts the inequalities of the law are strict; roots are simple, g_x f- +
/// g_t != 0. A row of redundant contacts that is left out holds for every theta if its formula contains velocities only
/// that the other rows keep zero. Where one of these is not proven, refuse() states why.
///
/// At t = 0 contacts touch, rest or stick. A theta that changes this has no derivative: the contact opens, hits or
/// slips for one sign of the change only. So gap, v_n and v_t must stay zero exactly, by formulas; otherwise the column
/// has a reason in place of numbers. So has a parameter on which e = 0 or mu = 0 depends.
class Sensitivities {
 public:
  /// @param seconds  wall time of everything here [s]
  Sensitivities(const Problem& problem, Reading reading, const Precision& precision, double seconds);

  /// The columns at t = 0, at the state x. Call begin() next.
  void start(const ContactStates& states, const std::vector<Ball>& x);
  /// A smooth piece begins, after (5) if an event was reached. @param motion  in the program of the HybridMotion
  void begin(const ContactStates& states, const ModeMotion& motion, const std::vector<Ball>& x, const Ball& t);
  /// (1) from the state x at t on a step of this `length` [s].
  void move(const std::vector<Ball>& x, const Ball& t, const Ball& length);
  /// (2) and (3), with the modes before the event.
  void reach(const EventFunction& event, const std::vector<Ball>& x, const Ball& t);
  /// (7). @param x  before the impact  @param modes  of all contacts, before it  @param impact  of the `candidates`
  void strike(const std::vector<Ball>& x, const Ball& t, int contact, const std::vector<Mode>& modes,
              const std::vector<int>& candidates, const std::vector<Mode>& impact);
  /// (8)
  void finish(const std::vector<Ball>& x, const Ball& t);

  /// There is no derivative from here on, or none that is proven. The first reason counts.
  void refuse(const std::string& reason);
  /// Writes columns and reason into `motion`. @param digits  significant digits of the texts
  void write(CertifiedMotion& motion, int digits) const;
  /// Upper bound of log10 of all radii, relative to the largest entry or 1.
  double log10_radius() const;

 private:
  struct Column {
    std::string name;
    Node parameter = -1;  ///< that it varies
    std::string reason;   ///< why there is none
  };
  void attempt(const std::function<void()>& action);
  std::string reason_at_start(const ContactStates& states, int variable);
  void require_same_events(const ModeMotion& motion) const;
  void require_kept_rows(const ContactStates& states);
  std::vector<Ball> rate(const std::vector<Ball>& x);
  std::vector<Ball> gradient(Node f);
  std::vector<Ball> vary(Node f);
  void add_rate(const std::vector<Ball>& x, bool backwards);

  SeriesProgram program_;
  TimeLimit limit_;
  SceneFormulas scene_;
  TaylorStep taylor_;
  std::vector<Column> columns_;  ///< all
  std::vector<Node> live_;       ///< parameters of those without a reason, or -1
  std::vector<Node> variables_;  ///< q, v, t, p
  BallMatrix change_;            ///< derivatives of the variables_, one column per live one
  std::vector<std::vector<Node>> phi_;
  std::vector<Node> impact_;  ///< variables of v+ and impulses
  ModeMotion motion_;
  Variation variation_;
  bool is_finished_ = false;
  std::string reason_;
};

}  // namespace ricochet::reference::certified
