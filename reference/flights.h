#pragma once

#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"
#include "reference/scales.h"

namespace ricochet::reference {

/// Short flights of open contacts. Their end follows from the gap, its rate r and its acceleration a after an event:
///
///   0 = gap + r t + a t^2 / 2                                                            (1)
///
/// A multistep method with longer steps misses them. At the start of a step that is much longer than the flight, its
/// interpolation cannot distinguish a gap that opens from one that closes. Its steps therefore stay below a fraction of
/// the shortest flight during that flight. If the flights of a contact become ever shorter, its impacts accumulate.
/// If a contact with eps_r < 1 would rise no higher than the rounding of its gap after an impact,
///
///   (eps_r r)^2 / (2 |a|) <= rounding,   r < 0 before the impact,   a < 0,               (3)
///
/// this impact is its last one, and plastic. It replaces impacts that would end 2 eps_r |r| / (|a| (1 - eps_r)) later.
/// Their normal impulses have the same sum as the force of a closed contact over that time. The error of the state
/// after them is therefore of second order in r, by (3) about 1e-7 of the velocities.
///
/// Several contacts that touch and bounce, or open and close, in turn end their accumulation together. The condition is
/// that the loads press on each of them, a < 0 without all of their forces, and that neither its rate before the impact
/// nor that after a plastic one lifts it higher than rounding,
///
///   r^2 / (2 |a|) <= rounding                                                            (4)
///
/// Then all of them close, with zero rates. If the velocities are large when the gaps vanish, (4) does not hold, and
/// the run ends.
///
/// If a contact opens with zero rate, because its force vanishes, or if its bodies fall together, its gap is at first
/// rounding and integration error of either sign. Its root function is
///
///   gap + offset                                                                         (2)
///
/// until the gap is larger than the offset. A body that returns before has not left. The contacts of a wedge
/// (resting_groups.h) have such an offset, too.
class Flights {
 public:
  /// @param zeno_interval  impacts of one contact at shorter intervals are an accumulation [s]
  /// @param in_flight  in_flight() of the run that this one continues; empty if it continues none
  Flights(const Problem& problem, const Scales& scales, double tolerance, double zeno_interval,
          const std::vector<char>& in_flight = {})
      : problem_(problem),
        scales_(scales),
        tolerance_(tolerance),
        zeno_interval_(zeno_interval),
        offset_(Vector::Zero(problem.n_c())),
        height_(Vector::Zero(problem.n_c())),
        rebound_(height_),
        low_(height_),
        flat_(kTouching * scales.gap(problem.normal_jacobian(problem.info().q0), problem.info().q0)),
        sinking_(height_),
        moves_along_(problem.info().contacts.size(), false),
        in_flight_(in_flight.empty() ? moves_along_ : in_flight),
        last_impact_(problem.info().contacts.size(), -1) {}

  /// First t > 0 of (1) for a gap that is open, or zero and opening; infinite if it never closes [s].
  static double closing_time(double gap, double rate, double a);

  /// Starts after an event at t. @param a  n_q, accelerations; read if a contact is open
  void start(double t, const Vector& q, const Vector& v, const Vector& a, const std::vector<ContactMode>& modes);

  /// To be called after a step.
  void follow(const Vector& q);

  /// Whether the open contact i touches: its gap is zero to rounding, or its bodies have moved together since the gap
  /// was.
  bool touches(int i, double gap) const { return gap <= flat_[i] || (moves_along_[i] && gap <= offset_[i]); }

  /// From now on contact i, which does not leave faster than `speed`, is open and may sink by `depth` [m], until its gap
  /// is larger than that.
  void let_sink(int i, double gap, double depth, double speed) {
    offset_[i] = depth + std::max(0.0, -gap);
    sinking_[i] = speed;
  }
  /// Whether contact i, with this rate, is left to sink.
  bool sinks(int i, double rate) const { return sinking_[i] > 0 && rate >= -sinking_[i]; }
  bool is_sinking(int i) const { return sinking_[i] > 0; }
  void end_sinking(int i) { sinking_[i] = 0; }

  /// Whether contact i bounced recently and its bodies have not moved together since. If it touches again while another
  /// contact closes, rounding decides which is first.
  bool bounced(int i, double t) const {
    return !moves_along_[i] && last_impact_[i] >= 0 && t - last_impact_[i] < kAccumulation * zeno_interval_;
  }

  /// Whether each contact has left. Its gap is no error then, also at the top of the flight, where the rate vanishes.
  std::vector<char> in_flight() const;

  /// Offset of (2); zero for contacts that have left, and for closed ones.
  const Vector& offset() const { return offset_; }

  /// Whether (3) holds. @param rate, a  of the gap before the impact
  bool is_last(int i, double rate, double a) {
    const double eps_r = problem_.info().contacts[i].restitution(rate), rebound = eps_r * rate;
    rebound_[i] = a < 0 ? rebound * rebound / (-2 * a) : 0;
    return eps_r > 0 && eps_r < 1 && a < 0 && rebound_[i] <= flat_[i];
  }

  /// (4)
  bool stays_low(int i, double rate, double a) const { return a < 0 && rate * rate <= -2 * a * flat_[i]; }

  /// Whether contact i bounced to a height below the errors of the integration.
  bool is_low(int i) const { return height_[i] > 0 && height_[i] < low_[i]; }

  /// Longest step [s]; 0: no limit.
  double longest_step(double t) const { return t < t_ + 2 * shortest_ ? shortest_ / 10 : 0; }
  double first_step() const { return shortest_ / 10; }

  /// Records the impact of contact i at t, after start(). @return whether its impacts accumulate: they follow too
  /// closely, or the contact bounced recently and the height of its next flight is rounding, also with the acceleration of (3)
  bool accumulates(int i, double t);
  /// Ends the run at t [s]: the impacts of contacts accumulate. @return false
  bool stop_accumulation(double t, Solution& solution) const;

 private:
  // Intervals, by the shortest that counts, within which impacts belong to one accumulation.
  static constexpr double kAccumulation = 1e6;

  const Problem& problem_;
  const Scales& scales_;
  const double tolerance_;
  const double zeno_interval_;
  Vector offset_;                    // n_c [m]
  Vector height_;                    // n_c, of flights that began with the last event at the surface, else 0 [m]
  Vector rebound_;                   // n_c, (3) of the last impact [m]
  Vector low_, flat_;                // n_c, heights of errors and of rounding [m]
  Vector sinking_;                   // n_c, speeds of let_sink(), else 0 [m/s]
  std::vector<char> moves_along_;    // by contact
  std::vector<char> in_flight_;      // open after the last event
  std::vector<double> last_impact_;  // [s]
  double t_ = 0, shortest_ = 0;      // [s]; 0 where no flight is short
};

}  // namespace ricochet::reference
