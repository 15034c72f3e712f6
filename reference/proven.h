#pragma once

#include <optional>
#include <string>

#include "reference/agreement.h"

/// @file
/// A reference from a proof (reference/certified): proven_reference(); truth_of().
///
/// Methods integrate the scene whose numbers are rounded to double; the proof is of the scene as it is written, where
/// 0.3 is three tenths and a block that touches the ground touches it exactly. So the uncertainty is
///
///     radius of the proof + max|x - x_rounded| + eps max|x|,    x = (q, v)(T)                                       (1)
///
/// with x_rounded from a second proof, of the rounded scene. Where that one is open, for example because a gap of zero
/// is 1e-17 after rounding, kRounding max|x| takes the place of the second term, and Reference::how reports this.
///
/// reference/data/proofs.json, which is in the program, has the proofs of published scenes; a scene is found by
/// hash_of_formulas(). So they hold without Arb, and those that take minutes are done once.

namespace ricochet::reference {

/// SHA-256 of the scene without its names: scene_text() with the parameters and the initial state of the problem.
/// @throws InputError for a problem that is not made of formulas
std::string hash_of_formulas(const Problem& problem);

/// The final state of the problem from its stored proof, or from a new one. A proof may rely on listed assumptions.
/// Events are proven, too, but are not part of the solution here.
/// @param max_seconds  wall time of both new proofs [s]
/// @returns nothing where the new proof is open or not to 17 digits, or where the program was built without Arb
std::optional<Reference> proven_reference(const Problem& problem, double max_seconds = 2);

/// The truth that methods are compared with: the proven reference if there is one, otherwise that of make_reference().
/// @throws std::runtime_error as make_reference()
Reference truth_of(const Problem& problem);

}  // namespace ricochet::reference
