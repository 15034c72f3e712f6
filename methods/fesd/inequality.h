#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "problems/solution.h"

namespace ricochet {

/// An inequality that holds while a contact keeps its mode. SignConditions finds the first that fails in an element, and
/// ElementMap proves that none fails.
enum class Inequality : std::uint8_t {
  gap,    ///< f_c >= 0
  force,  ///< lambda_n >= 0
  cone,   ///< ||lambda_t|| <= mu lambda_n
  slip,   ///< v_t keeps its sign; in space it does not turn back
  facet,  ///< on a polygon: conditions (2) of friction_polygon.h
};

/// The inequalities of a mode, of a unilateral contact. @param on_polygon  its friction in space has a polygon
inline std::span<const Inequality> inequalities_of(ContactMode mode, bool on_polygon) {
  using enum Inequality;
  static constexpr Inequality kOpen[] = {gap}, kClosed[] = {force}, kStick[] = {force, cone}, kSlip[] = {force, slip},
                              kPolygon[] = {force, facet};
  switch (mode) {
    case ContactMode::open:
      return kOpen;
    case ContactMode::closed:
      return kClosed;
    case ContactMode::stick:
      return on_polygon ? kPolygon : kStick;
    case ContactMode::slip_positive:
    case ContactMode::slip_negative:
    case ContactMode::slip:
      return kSlip;
    case ContactMode::vertex_slip:
    case ContactMode::edge_slip:
      return kPolygon;
  }
  return {};
}

inline bool has(std::span<const Inequality> list, Inequality inequality) {
  return std::ranges::find(list, inequality) != list.end();
}

}  // namespace ricochet
