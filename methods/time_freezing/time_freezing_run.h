#pragma once

#include <string>
#include <vector>

#include "methods/method.h"
#include "methods/time_freezing/instant_change.h"

namespace ricochet {

struct TimeFreezingOptions {
  int n_fe = 1;         ///< elements per step where nothing switches
  double a_n = 100;     ///< [m/s^2]
  double bounce = 0.1;  ///< pseudo time of a bounce as part of the end time
};

/// A run of the time-freezing method: elements of constant regions (region_element.h), each of which ends at a time of the
/// clock or, when a switching function is negative at its right end, at the first zero of it (region_step.h). After a switch
/// the law of the instant decides which regions are active. Between an impact and the next moment of the clock there are
/// frozen elements alone (instant_change.h).
class TimeFreezingRun {
 public:
  TimeFreezingRun(const Problem& problem, const ButcherTableau& tableau, const TimeFreezingOptions& options,
                  const Settings& settings);
  Solution run();

 private:
  bool advance(double end);
  void move(double t_end);
  bool pass_instant(RegionSwitch cause, bool is_first);
  ContactMode mode_of(int contact) const;
  bool fail(const RegionStep::Failure& failure);
  void record(const std::vector<ContactMode>& before, const Vector& v_minus, RegionSwitch cause, bool is_first);

  const ProblemInfo& info_;
  const TimeFreezingOptions options_;
  const Settings& settings_;
  const double T_, H_;  ///< [s]: end time, length of an element where nothing switches
  Solution solution_;
  Counters& counters_;
  const TimeLimit time_limit_;
  AuxiliaryDynamics auxiliary_;
  ContactScales scales_;
  InstantSystem system_;
  RegionForces forces_;
  RegionStep step_;
  InstantChange change_;
  RegionState state_;
  std::vector<ContactMode> modes_;
};

}  // namespace ricochet
