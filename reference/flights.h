#pragma once

#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"
#include "reference/scales.h"

namespace ricochet::reference {

/// Flights of open contacts that end soon, by the gap, its rate r and its acceleration a behind an event:
///
///   0 = gap + r t + a t^2 / 2                                                            (1)
///
/// A multistep method whose steps are longer passes over them, and at the begin of a step that is much longer than the
/// flight its interpolation is not exact enough to tell a gap that opens from one that closes. So its steps stay below
/// a part of the shortest flight while that lasts. Where the flights of a contact become ever shorter, its impacts
/// accumulate. An impact behind which a contact with eps_r < 1 would rise no higher than rounding of its gap,
///
///   (eps_r r)^2 / (2 |a|) <= rounding,   r < 0 before the impact,   a < 0,               (3)
///
/// is its last one, and plastic. The impacts that it stands for would end 2 eps_r |r| / (|a| (1 - eps_r)) later, with
/// the same sum of normal impulses as the force of a closed contact has in that time; so what the state misses behind
/// them is of second order in r, which (3) makes 1e-7 of the velocities.
///
/// Several contacts that touch and bounce, or leave and come back, in turn end their accumulation together, where each
/// of them would be pressed on by the loads, a < 0 without all of their forces, and neither its rate before the impact
/// nor that after a plastic one lifts it higher than rounding,
///
///   r^2 / (2 |a|) <= rounding                                                            (4)
///
/// Then all of them close, with the rates of none. Where the velocities are large when the gaps vanish, (4) does not
/// hold, and the run ends.
///
/// A contact that opens without a rate, because its force vanishes, or whose bodies fall together, has a gap that is
/// rounding and integration error at first, of either sign. Its root function is
///
///   gap + offset                                                                         (2)
///
/// until the gap is larger than the offset; a body that comes back before has not left.
class Flights {
 public:
  /// @param zeno_interval  [s]: impacts of one contact closer than this are an accumulation
  Flights(const Problem& problem, const Scales& scales, double tolerance, double zeno_interval)
      : problem_(problem),
        scales_(scales),
        tolerance_(tolerance),
        zeno_interval_(zeno_interval),
        offset_(Vector::Zero(problem.n_c())),
        height_(Vector::Zero(problem.n_c())),
        low_(height_),
        flat_(kTouching * scales.gap(problem.normal_jacobian(problem.info().q0), problem.info().q0)),
        moves_along_(problem.info().contacts.size(), false),
        last_impact_(problem.info().contacts.size(), -1) {}

  /// First t > 0 of (1) with a gap that is open, or zero and opening; infinite where it never closes [s].
  static double closing_time(double gap, double rate, double a);

  /// Behind an event at t. @param a  n_q, accelerations; read where a contact is open
  void start(double t, const Vector& q, const Vector& v, const Vector& a, const std::vector<ContactMode>& modes);

  /// Behind a step.
  void follow(const Vector& q);

  /// Whether open contact i touches: its gap is rounding, or its bodies have moved along with each other since they
  /// did.
  bool touches(int i, double gap) const { return gap <= flat_[i] || (moves_along_[i] && gap <= offset_[i]); }

  /// Whether contact i bounced lately and has not moved along since: when it touches again while another contact
  /// closes, rounding decides which of them is first.
  bool bounced(int i, double t) const {
    return !moves_along_[i] && last_impact_[i] >= 0 && t - last_impact_[i] < kAccumulation * zeno_interval_;
  }

  /// (2); zero for every contact that has left, and for closed ones
  const Vector& offset() const { return offset_; }

  /// (3). @param rate, a  of the gap before the impact
  bool is_last(int i, double rate, double a) const {
    const double eps_r = problem_.info().contacts[i].eps_r, rebound = eps_r * rate;
    return eps_r > 0 && eps_r < 1 && a < 0 && rebound * rebound <= -2 * a * flat_[i];
  }

  /// (4)
  bool stays_low(int i, double rate, double a) const { return a < 0 && rate * rate <= -2 * a * flat_[i]; }

  /// Whether contact i bounced, and lower than errors of the integration.
  bool is_low(int i) const { return height_[i] > 0 && height_[i] < low_[i]; }

  /// [s]; 0 is no limit
  double longest_step(double t) const { return t < t_ + 2 * shortest_ ? shortest_ / 10 : 0; }
  double first_step() const { return shortest_ / 10; }

  /// Notes the impact of contact i at t, behind start(). @return whether its impacts accumulate: they come too soon, or
  /// it bounced lately and the height of its next flight is rounding
  bool accumulates(int i, double t);
  /// Names of the contacts whose impacts do, for a message.
  std::string accumulating(double t) const;

 private:
  // Intervals, by the shortest that counts, within which impacts belong to one accumulation.
  static constexpr double kAccumulation = 1e6;

  const Problem& problem_;
  const Scales& scales_;
  const double tolerance_;
  const double zeno_interval_;
  Vector offset_;                    // n_c [m]
  Vector height_;                    // n_c, of flights that began with the last event at the surface, else 0 [m]
  Vector low_, flat_;                // n_c, heights of errors and of rounding [m]
  std::vector<char> moves_along_;    // by contact
  std::vector<double> last_impact_;  // [s]
  double t_ = 0, shortest_ = 0;      // [s]; 0 where no flight is short
};

}  // namespace ricochet::reference
