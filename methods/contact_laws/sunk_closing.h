#pragma once

#include "methods/contact_laws/gap_search.h"

namespace ricochet {

/// The closing of a contact that may sink (group_capture.h) along a path: its gap g has fallen to -level. With
/// delta = ContactScales::capture_height() and s = max(0, -g(0)),
///
///   level = max(delta, s)                                                                      (1)
///   level = delta + s    if s >= delta and the contact falls from the beginning                (2)
///
/// A contact that has closed at -level and bounces hops from there, and closes at -level again. If each bounce lowered
/// the level, a wedge would sink by delta at each of them. Only a contact that cannot hop, since it approaches still,
/// has to sink deeper. It hops if, half the way to -level, its gap is above -s by at least delta / 100.
struct SunkClosing {
  GapSearch::Closing piece;  ///< on which the gap falls to -level
  double theta = 0;          ///< where, from 0 to 1
  double level = 0;          ///< [m]

  explicit operator bool() const { return piece.found; }
};

/// @param height  delta [m]; @param left_gap  g(0) [m]
/// @param rounding  of the gap [m]; @param slack  by which the gap may be lower, and s count as delta [m]
SunkClosing find_sunk_closing(GapSearch& gaps, int contact, double height, double left_gap, double rounding,
                              double slack = 0);

}  // namespace ricochet
