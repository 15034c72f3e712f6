#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

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

/// The values of two formulas `a` and `b` of q, t and the parameters where they differ by more than rounding: at q0, or
/// at one of two points near it; empty if they agree. t is 0 at q0, and `rate` times a number of seconds at the others.
std::optional<std::pair<double, double>> difference_near_start(const SymbolicModel& model, const GiNaC::ex& a,
                                                               const GiNaC::ex& b, double rate);

}  // namespace ricochet
