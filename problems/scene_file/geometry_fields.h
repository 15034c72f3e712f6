#pragma once

#include <nlohmann/json.hpp>

#include "problems/geometry.h"
#include "problems/scene_file/field.h"

/// @file
/// Reading and writing of the geometry of a scene file.

namespace ricochet {

/// Reads the field "geometry" of a scene.
/// @param model      its parameters and q
/// @param constants  names of the parameters
/// @param in_q       with the coordinates
/// @throws InputError with the field, its value and what is allowed
GeometryOf<GiNaC::ex> read_geometry(const Field& field, const SymbolicModel& model, const ExpressionNames& constants,
                                    const ExpressionNames& in_q);
/// Reads the fields "shapes" and "corner" of a contact, the number `contact` of its scene. @throws InputError likewise
ShapePair read_pair(const Field& field, const GeometryOf<GiNaC::ex>& geometry, int contact);

/// Writes the geometry of the `model` for read_geometry().
nlohmann::ordered_json geometry_json(const SymbolicModel& model);
/// Writes the fields that read_pair() reads into the `contact` of a file.
void add_pair(nlohmann::ordered_json& contact, const ShapePair& pair, const GeometryOf<GiNaC::ex>& geometry);

}  // namespace ricochet
