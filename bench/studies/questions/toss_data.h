#pragma once

#include <string>
#include <vector>

#include "problems/geometry_kinematics.h"
#include "problems/problem.h"

/// @file
/// Measured tosses of a cube, as the ContactNets data have them: S. Pfrommer, M. Halm, M. Posa, ContactNets: Learning
/// discontinuous contact dynamics with smooth, implicit representations, CoRL 2020. The data are not part of this project.

namespace ricochet {

/// The cube of the data, and what was fitted to it there.
inline constexpr double kCubeHalfWidth = 0.0524, kCubeMass = 0.37;  // [m], [kg]
inline constexpr double kTossRate = 148;                            // [1/s]

/// A pose and its velocities, measured.
struct TossRow {
  Pose pose;                 ///< of the cube [m]
  Vector3<double> velocity;  ///< [m/s]; of the data: the difference to the row before
  Vector3<double> omega;     ///< in the cube's axes [rad/s]
};

/// A file of the set: a pickle of PyTorch, whose storage of numbers is its end. @throws InputError
std::vector<TossRow> read_toss(const std::string& path);
/// The files of a folder, N.pt, by number. @throws InputError where there are none
std::vector<std::string> toss_files(const std::string& folder);

/// A toss as a start for `box_3d`: axes of cube and world are chosen anew, which changes nothing for a cube on a plane, so
/// that the Cardan angles of the measured motion stay as far from their singularity as they can.
struct Toss {
  std::unique_ptr<Problem> problem;  ///< with the measured start
  std::vector<Pose> measured;        ///< at k / kTossRate after it, in the axes of the problem
};

/// @param rows  of which the second is the start: its velocities are those of central differences; the lowest corner of
/// the last is the floor
/// @param e, mu  of the cube on the floor
Toss toss_of(const std::vector<TossRow>& rows, double e, double mu);

}  // namespace ricochet
