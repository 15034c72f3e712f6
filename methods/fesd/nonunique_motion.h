#pragma once

#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Contacts whose motion Coulomb's law does not determine. With A the columns J_n of closed contacts and J_t of
/// those that stick, and C the directions of their forces, C = J_n - mu J_t d where a contact slips along d, forces x
/// keep the contacts when
///
///   A' M^-1 C x = 0,                                                                     (1)
///
/// and where nothing slips such forces move nothing: redundant contacts share their load in more than one way. Friction
/// of slipping contacts follows their normal forces, so x may move bodies,
///
///   M^-1 C x != 0,                                                                       (2)
///
/// as for a block that sticks to the side of another one: the load that it carries decides which of them presses the ground
/// more, and where the friction coefficients of both differ, how both are braked. Then many motions fulfil the laws.
///
/// @param modes  n_c; @param v  slip velocities of contacts that slip in space
/// @return the names of the contacts whose forces have part in such an x; empty when the motion is unique
std::vector<std::string> contacts_of_nonunique_motion(const Problem& problem, const Vector& q, const Vector& v,
                                                      const std::vector<ContactMode>& modes);

}  // namespace ricochet
