#pragma once

#include "problems/derivatives/symbolic_problem.h"

/// @file
/// The equations of motion that follow from a geometry: Lagrange's, with M and the weight of geometry_kinematics.h,
///
///     f_k = w_k(q) - sum_ij (dM_ki/dq_j - 1/2 dM_ij/dq_k) v_i v_j                                            (1)
///     V = -sum over bodies of m gravity' p                                                                   (2)

namespace ricochet {

/// Rows of M(q) of bodies in the coordinates of the `model`, whose geometry and q are read.
std::vector<SymbolicModel::Expressions> mass_from_geometry(const SymbolicModel& model);
/// (1), n_q entries; geometry, mass, q and v of the `model` are read.
SymbolicModel::Expressions force_from_geometry(const SymbolicModel& model);
/// (2) [J]; geometry and q of the `model` are read.
GiNaC::ex potential_from_geometry(const SymbolicModel& model);
/// Gap and tangents of a `pair` of the geometry of the `model`, whose q is read, too.
SymbolicModel::Contact contact_from_geometry(const SymbolicModel& model, const ShapePair& pair);

}  // namespace ricochet
