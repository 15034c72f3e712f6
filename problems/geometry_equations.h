#pragma once

#include "problems/derivatives/symbolic_problem.h"

/// @file
/// Lagrange's equations of motion of a geometry, with M and the weight of geometry_kinematics.h:
///
///     f_k = w_k(q) - sum_ij (dM_ki/dq_j - 1/2 dM_ij/dq_k) v_i v_j                                            (1)
///     V = -sum over bodies of m gravity' p                                                                   (2)

namespace ricochet {

/// Rows of M(q) of the bodies. Reads geometry and q of the `model`.
std::vector<SymbolicModel::Expressions> mass_from_geometry(const SymbolicModel& model);
/// (1), n_q entries. Reads geometry, mass, q and v of the `model`.
SymbolicModel::Expressions force_from_geometry(const SymbolicModel& model);
/// (2) [J]. Reads geometry and q of the `model`.
GiNaC::ex potential_from_geometry(const SymbolicModel& model);
/// Gap and tangents of a `pair` of the geometry. Reads geometry and q of the `model`.
SymbolicModel::Contact contact_from_geometry(const SymbolicModel& model, const ShapePair& pair);

}  // namespace ricochet
