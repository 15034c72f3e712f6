#pragma once

#include "methods/contact_laws/switch_kind.h"
#include "methods/time_freezing/regions.h"

namespace ricochet {

/// The switch that ends an element before its time. Its function is
///
///   gap_closes      f_c of a free contact; while time is frozen J_n' v of a free contact that touches
///   force_vanishes  lambda_n of a sliding contact, -J_n' v of a pushed one, -y of a bouncing one
///   cone_reached    mu lambda_n - |lambda_t| of a sticking contact
///   slip_stops      d' J_t' v of a slipping contact
struct RegionSwitch {
  SwitchKind kind = SwitchKind::gap_closes;
  int contact = -1;              ///< -1: none
  Region region = Region::free;  ///< of the contact until then
  bool slows = false;            ///< slip in space has not stopped, but become a small part of what it was

  explicit operator bool() const { return contact >= 0; }
  bool is(SwitchKind its_kind, int its_contact) const { return contact == its_contact && kind == its_kind; }
  /// Whether the force of a contact in this region ends.
  bool ends(Region its_region) const {
    return contact >= 0 && kind == SwitchKind::force_vanishes && region == its_region;
  }
  bool ends(Region its_region, int its_contact) const { return contact == its_contact && ends(its_region); }
};

}  // namespace ricochet
