#pragma once

#include <string>
#include <vector>

#include "problems/problem.h"

namespace ricochet::reference {

/// Impulses of contacts that meet, by the law of impacts that the scene states in place of Newton's. Written apart from
/// methods/contact_laws/impact_laws/, which has the equations and their sources: with w = J' v, G = J' M^-1 J,
///
///   routh, stronge   the path dw/dp_n = G (1, t) is followed piece by piece, t of Coulomb's law at each instant     (1)
///   poisson          each phase by trying what its contact may do: stick, slip forward, slip backward            (2)
///   lzb              springs P' = K delta^eta, delta' = -w in compression and -w / e^2 in expansion, by GSL's Prince-
///                    Dormand 8(7) with located changes of phase                                                  (3)
struct StatedImpulses {
  std::string failure;  ///< why there are none; empty where there are
  Vector r;             ///< [N s], of each contact its normal and then its tangent
};

/// @param contacts  that meet  @param G  of them [1/kg]  @param w  before the impact [m/s]
StatedImpulses stated_impulses(const ProblemInfo& info, const std::vector<int>& contacts, const Matrix& G,
                               const Vector& w);

}  // namespace ricochet::reference
