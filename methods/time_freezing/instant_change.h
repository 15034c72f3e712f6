#pragma once

#include "methods/time_freezing/region_step.h"
#include "methods/time_limit.h"

namespace ricochet {

/// All that happens at one time of the clock: frozen elements until no contact approaches, then the regions after them.
class InstantChange {
 public:
  struct Options {
    double a_n;     ///< gap acceleration of a push [m/s^2]
    double H;       ///< length of a step [s]
    double length;  ///< of an element where nothing switches [s]
  };

  /// All references must outlive this object.
  InstantChange(const Problem& problem, const Options& options, const AuxiliaryDynamics& auxiliary,
                ContactScales& scales, InstantSystem& system, RegionForces& forces, RegionStep& step,
                const TimeLimit& time_limit, Counters& counters);

  /// From the state before, whose regions end by `cause`, to the velocities and regions after.
  RegionStep::Failure pass(RegionState& state, RegionSwitch cause, bool is_first);
  /// First guess of the element after pass().
  RegionStep::Failure leave(RegionState& state);
  /// Holds the direction of the last part of a slip in space: at its end it would be undefined.
  RegionStep::Failure hold_slip(RegionState& state, int contact);

  const Vector& Lambda_n() const { return Lambda_n_; }  ///< n_c, impulses of the last instant [N s]
  const Vector& Lambda_t() const { return Lambda_t_; }

 private:
  bool find_touching(RegionState& state, RegionSwitch cause);
  void record_contacts(const RegionState& state, bool is_first);
  bool begins_to_bounce(const RegionState& state, int contact) const;
  bool find_approaching(RegionState& state, RegionSwitch cause);
  RegionStep::Failure pass_frozen(RegionState& state, RegionSwitch& cause);
  double frozen_length(const RegionState& state) const;
  void hold_direction(RegionState& state, int contact);

  const Problem& problem_;
  const ProblemInfo& info_;
  const Options options_;
  const AuxiliaryDynamics& auxiliary_;
  ContactScales& scales_;
  InstantSystem& system_;
  RegionForces& forces_;
  RegionStep& step_;
  const TimeLimit& time_limit_;
  Counters& counters_;
  InstantLaw law_;
  Vector gap_, Lambda_n_, Lambda_t_;
};

}  // namespace ricochet
