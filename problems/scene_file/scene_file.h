#pragma once

#include <memory>
#include <string>

#include "problems/problem.h"
#include "problems/registry.h"

namespace ricochet {

/// Reads a scene from a JSON file; no compiler needed. The file holds the scene itself, or an object with the scene
/// under "problem", or a set of such objects under "cases" from which `FILE#id` picks one. A scene has the fields
///
///   params     {"m": "1", ...}           exact decimals                                            optional
///   q0, v0     ["1", ...]                initial state, expressions in the parameters
///   T          "2"                       end time [s]
///   M          [["m"]]                   n_q rows, expressions in q and the parameters
///   f          ["-m*g"]                  expressions in q, v, t and the parameters
///   Bu, u      [["1"]], ["5"]            control map (expressions in q and t) and its value (in t) optional
///   contacts   [{"name", "gap", "e", "mu", "Jt", "vt_drive", "Jn", "bilateral"}]                   optional
///                gap: expression in q and t;  e, mu: in the parameters, default 0;  Jt: list of tangent directions, in
///                q and t;  vt_drive: one expression in q and t per direction, added to J_t' v, minus the velocity of
///                the surface [m/s];  Jn: not needed, J_n is the gradient of the gap; when present it is compared with
///                it; bilateral: true for a constraint gap = 0 that may pull, without e and mu; default false
///   potential_energy                     expression in q                                           optional
///   units      {"m": "kg"}               of parameters, for reports                                optional
///   id, title, source, hard_feature      here or in the object around the scene                    optional
///
/// The name t is the time [s]. Expressions are in Python's syntax (parse_expression). Numbers may also be written as
/// JSON numbers.
/// @throws InputError that names the file, the field and the position
std::unique_ptr<Problem> read_scene_file(const std::string& path, const ParameterChanges& changes = {});

/// The same for the text of a scene. @param name  stands for the file in messages
std::unique_ptr<Problem> read_scene_text(const std::string& text, const std::string& name,
                                         const ParameterChanges& changes = {});

}  // namespace ricochet
