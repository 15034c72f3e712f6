#pragma once

#include <span>
#include <string>

#include "methods/complementarity/lemke.h"
#include "problems/problem.h"

namespace ricochet {

/// Impulses of contacts that strike together, by the law that a scene states in place of Newton's: of one contact with
/// friction in the plane that of planar_impact.h, of any number without friction that of lzb_impact.h. Without friction
/// one contact has w+ = -e w- by all of them.
/// @param contacts  those that strike, one after the other in G, each its normal and then its tangent
/// @param G  their Delassus matrix [1/kg]  @param w  w- [m/s]  @param r  their impulses, out [N s]
/// @returns ray where the law has no solution: for several contacts all but lzb
LcpStatus stated_impact(const ProblemInfo& info, std::span<const int> contacts, const Eigen::Ref<const Matrix>& G,
                        const Eigen::Ref<const Vector>& w, Eigen::Ref<Vector> r);

/// Reason why an impact law fails, as the end of a sentence.
std::string why_no_impulse(const ProblemInfo& info);

}  // namespace ricochet
