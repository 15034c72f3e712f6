#pragma once

#include <string>
#include <vector>

#include "problems/problem.h"

namespace ricochet::reference {

/// Impulses of colliding contacts by the impact law that the scene states instead of Newton's. Independent of
/// methods/contact_laws/impact_laws/, which has the equations and their sources. With w = J' v and G = J' M^-1 J:
///
///   routh, stronge   the path dw/dp_n = G (1, t) is followed piece by piece, with t of Coulomb's law            (1)
///   poisson          each phase by trying all modes of its contact: stick, slip forward, slip backward           (2)
///   lzb              springs P' = K delta^eta, delta' = -w in compression and -w / e^2 in expansion, by GSL's Prince-
///                    Dormand 8(7) with located changes of phase                                                  (3)
struct StatedImpulses {
  std::string failure;  ///< reason, if there are no impulses; else empty
  Vector r;             ///< [N s], normal, then tangential impulse of each contact
};

/// @param contacts  colliding contacts  @param G  of these [1/kg]  @param w  before the impact [m/s]
StatedImpulses stated_impulses(const ProblemInfo& info, const std::vector<int>& contacts, const Matrix& G,
                               const Vector& w);

}  // namespace ricochet::reference
