#pragma once

#include <span>
#include <string>

#include "methods/complementarity/lemke.h"
#include "problems/problem.h"

namespace ricochet {

/// Impulses of contacts that strike together, by the law that a scene states instead of Newton's: planar_impact.h for
/// one contact with friction in the plane, lzb_impact.h for any number without friction. For one contact without
/// friction all laws give w+ = -e w-.
/// @param contacts  those that strike, one after the other in G, each its normal and then its tangent
/// @param G  their Delassus matrix [1/kg]  @param w  w- [m/s]  @param r  their impulses, out [N s]
/// @returns ray if the law has no solution; for several contacts every law but lzb
LcpStatus stated_impact(const ProblemInfo& info, std::span<const int> contacts, const Eigen::Ref<const Matrix>& G,
                        const Eigen::Ref<const Vector>& w, Eigen::Ref<Vector> r);

/// Reason why an impact law fails, as the end of a sentence.
std::string why_no_impulse(const ProblemInfo& info);

}  // namespace ricochet
