#pragma once

#include <optional>

#include "reference/agreement.h"

/// @file
/// A reference from a proof (reference/certified): proven_reference(); best_reference().
///
/// Methods integrate the scene whose numbers are rounded to double; the proof is of the scene as it is written, where
/// 0.3 is three tenths and a block that touches the ground touches it exactly. So the uncertainty is
///
///     radius of the proof + max|x - x_rounded| + eps max|x|,    x = (q, v)(T)                                       (1)
///
/// with x_rounded from a second proof, of the rounded scene. Where that one is open, for example because a gap of zero
/// is 1e-17 after rounding, kRounding max|x| takes the place of the second term, and Reference::how reports this.

namespace ricochet::reference {

/// The final state of the problem, if it is proven or relies on listed assumptions only. Events are proven, too, but are
/// not part of the solution here.
/// @param max_seconds  wall time of both proofs [s]
/// @returns nothing where the proof is open or not to 17 digits, or the program was built without Arb
std::optional<Reference> proven_reference(const Problem& problem, double max_seconds = 2);

/// The proven reference if there is one, otherwise that of make_reference().
/// @throws std::runtime_error as make_reference()
Reference best_reference(const Problem& problem);

}  // namespace ricochet::reference
