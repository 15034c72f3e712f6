#pragma once

#include <string>
#include <vector>

#include "methods/control/shooting/linearised_interval.h"

namespace ricochet {

/// A number that is not negative while a motion keeps its sequence of modes, switches and impacts: where it vanishes, the
/// cost as a function of the controls changes to another smooth piece.
struct Guard {
  enum class Kind : std::uint8_t {
    gap,           ///< f_c at a stage of an open contact
    normal_force,  ///< lambda_n at a stage of a closed contact
    cone,          ///< mu lambda_n - ||lambda_t|| at a stage where it sticks
    slip,          ///< the slip speed, in the direction of slip, at a stage where it slips
    approach,      ///< -J_n' v- where an impact is
    length         ///< h of an element
  };
  Kind kind = Kind::gap;
  int interval = 0, element = 0, stage = 0;  ///< stage 0 where it has none
  int contact = -1;                          ///< -1: none
  double value = 0;                          ///< >= 0, but for rounding
  Eigen::RowVectorXd slope;                  ///< by theta of linearised_interval.h
};

/// The guards of interval k of a solved motion. Those that vanish identically, as the function that defines a switch
/// does at its end, are left out; so are those that no variable changes.
/// @param guards  out: they are added
void add_guards(const Problem& plant, const PointVariation& point, const PlantMotion& motion, int k,
                const LinearisedInterval& interval, std::vector<Guard>& guards);

/// "the gap of 'bumper' in interval 3"
std::string describe(const Guard& guard, const ProblemInfo& plant);

}  // namespace ricochet
