#pragma once

#include <vector>

#include "methods/contact_laws/contact_scales.h"
#include "methods/time_freezing/region_element.h"
#include "methods/time_freezing/region_switch.h"

namespace ricochet {

/// A velocity after an element carries this much rounding of its equations, relative to the largest so far.
inline constexpr double kElementRounding = 1e-11;

/// The functions whose zeros end an element (RegionSwitch),
///
///   free f_c,  sliding lambda_n,  stick mu lambda_n - |lambda_t|,  slip d' J_t' v,  pushed -J_n' v,  bouncing -y   (1)
///
/// at both ends of an element. Their forces are those of Filippov's motion at the state (region_forces.h).
class SwitchingFunctions {
 public:
  struct Function {
    RegionSwitch zero;
    double left = 0, right = 0;  ///< values at both ends of the element
    double rounding = 0;
  };

  /// All references must outlive this object. @param system, forces  of the state at hand
  SwitchingFunctions(const Problem& problem, const ButcherTableau& tableau, const AuxiliaryDynamics& auxiliary,
                     const ContactScales& scales, InstantSystem& system, RegionForces& forces);

  /// The functions of the regions at the left end, with their values there. The system is that of the left end.
  /// @param has_forces  the forces are, too
  void begin(const RegionState& from, bool has_forces);
  /// Their values at the right end of the element. The system and the forces are those of the right end after that.
  /// @return false where there are none
  bool evaluate(const RegionState& from, const RegionElement& element);

  /// Of the functions that are negative at the right end, the one that reaches zero first by linear interpolation; null
  /// if none is negative. @param located  the function whose zero defines the right end; it is left out
  Function* first_negative(RegionSwitch located);
  /// Whether a gap that is open at both ends of a flight is closed at a stage. If so, `length` is cut to end there.
  bool cuts_dip(const RegionElement& element, RegionSwitch located, double& length);

 private:
  void add_held(int contact, const RegionState& from);
  double force_rounding(int contact, const Regions& regions) const;
  double value(const Function& function, const RegionState& from, const Vector& v, const Vector& y) const;

  const Problem& problem_;
  const ProblemInfo& info_;
  const ButcherTableau& tableau_;
  const AuxiliaryDynamics& auxiliary_;
  const ContactScales& scales_;
  InstantSystem& system_;
  RegionForces& forces_;
  std::vector<Function> functions_;
  Regions end_regions_;
  Vector gap_;
  bool needs_forces_ = false;
};

/// Turns slip directions in `regions` to that of `v`, or its opposite if closer to that of `from`.
void turn_slip(const InstantSystem& system, const ContactScales& scales, const RegionState& from, const Vector& v,
               Regions& regions);

}  // namespace ricochet
