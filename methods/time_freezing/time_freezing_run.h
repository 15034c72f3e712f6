#pragma once

#include <string>
#include <vector>

#include "methods/elements/element_motion.h"
#include "methods/elements/element_solver.h"
#include "methods/method.h"
#include "methods/time_freezing/instant_law.h"
#include "methods/time_freezing/pseudo_time_solver.h"
#include "methods/time_limit.h"

namespace ricochet {

struct TimeFreezingOptions {
  int n_fe = 1;         ///< elements per step where nothing switches
  double a_n = 100;     ///< [m/s^2]
  double bounce = 0.1;  ///< pseudo time of a bounce as part of the end time
};

/// A run of the time-freezing method: elements of constant regions (pseudo_time_equations.h; where no contact is held those
/// of methods/elements, since pseudo time is time there), each of which ends at a time of the clock or, when one of the
/// switching functions
///
///   free f_c,  sliding lambda_n,  stick mu lambda_n - |lambda_t|,  slip d' J_t' v,  pushed -J_n' v,  bouncing -y   (1)
///
/// is negative at its right end, at the first zero of it: the length of the element is the unknown, found by bracketing.
/// Forces in (1) are those of Filippov's motion at the state (instant_law.h). After a switch the law of the instant
/// decides which regions are active. Between an impact and the next moment of the clock there are frozen elements alone.
class TimeFreezingRun {
 public:
  TimeFreezingRun(const Problem& problem, const ButcherTableau& tableau, const TimeFreezingOptions& options,
                  const Settings& settings);
  Solution run();

 private:
  struct Function {
    RegionSwitch zero;
    double left = 0, right = 0;  // values at both ends of the element at hand
    double rounding = 0;
  };

  bool advance(double end);
  bool pass_instant(RegionSwitch cause, bool is_first);
  bool pass_frozen(RegionSwitch& cause);
  bool find_touching(RegionSwitch cause);
  void record_contacts(bool is_first);
  bool find_approaching(RegionSwitch cause);
  bool begins_to_bounce(int contact) const;

  bool take(double& length, RegionSwitch& cause);
  bool solve(double length);
  bool evaluate();
  void set_functions();
  Function* first_negative(RegionSwitch located);
  bool cuts_dip(RegionSwitch located, double& length);
  double value(const Function& function, const Vector& v);
  bool locate(Function& function, double& length);
  void turn_slip(const Vector& v, Regions& regions) const;
  void hold_direction(int contact);
  void set_guess(double length);
  bool renew_guess(double length);
  ContactMode mode_of(int contact) const;
  bool fail(Status status, std::string message);
  void record(const std::vector<ContactMode>& before, const Vector& v_minus, RegionSwitch cause, bool is_first);

  const Problem& problem_;
  const ProblemInfo& info_;
  const ButcherTableau& tableau_;
  const TimeFreezingOptions options_;
  const Settings& settings_;
  const double T_, H_;
  Solution solution_;
  Counters& counters_;
  const TimeLimit time_limit_;
  AuxiliaryDynamics auxiliary_;
  ContactScales scales_;
  InstantSystem system_;
  InstantLaw law_;
  RegionForces forces_;

  ElementSystem elements_;
  ElementSolver flight_solver_;
  const ElementMotion flight_motion_;
  Element flight_;
  PseudoTimeSolver slide_solver_;
  PseudoTimeElement slide_;

  double t_ = 0;
  Vector q_, v_, y_;
  Regions regions_, end_regions_;
  bool is_free_ = true;   // no contact is held: free flight
  bool has_law_ = false;  // system_ is that of (q_, v_), with forces_
  std::vector<Function> functions_;
  std::vector<int> touching_;
  std::vector<ContactMode> modes_;
  Vector Lambda_n_, Lambda_t_, gap_, q1_, v1_, y1_;
  bool has_forces_ = false;
};

}  // namespace ricochet
