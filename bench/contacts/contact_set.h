#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "methods/contact_laws/contact_file.h"

namespace ricochet {

/// A contact problem as a line of JSON, without loss. Unlike a file of FCLib, it can contain the associated law,
/// impulses that are already present, and contacts of different kinds:
///
///   {"title": "box_3d, ...", "law": "coulomb", "contacts": [{"id": 4, "n_t": 2, "mu": 0.3, "present": 0}, ...],
///    "G": [[row, column, value], ...], "b": [...], "solution": [...], "guess": [...]}
///
/// "law" is coulomb or associated; G has rows of all contacts together, each with its normal first; "present",
/// "solution", "guess" and "title" may be missing.
nlohmann::json contact_problem_json(const StoredContactProblem& stored);

/// @param where  place of the text, for messages  @throws InputError with the name of a wrong field
StoredContactProblem read_contact_problem(const nlohmann::json& document, const std::string& where);

/// Reads contact problems from a file, with one line of JSON each if its name ends with .json or .jsonl, else of FCLib;
/// or from all such files in a directory and its subdirectories, in the order of their names. Empty titles are filled
/// in.
/// @throws InputError for an unreadable file, and for a directory without a contact problem
std::vector<StoredContactProblem> read_contact_problems(const std::string& path);

}  // namespace ricochet
