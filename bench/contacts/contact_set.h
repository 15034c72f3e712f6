#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "methods/contact_laws/contact_file.h"

namespace ricochet {

/// A contact problem as a line of JSON, which loses nothing and, other than a file of FCLib, knows the associated law,
/// impulses that are already there, and contacts of different kinds:
///
///   {"title": "box_3d, ...", "law": "coulomb", "contacts": [{"id": 4, "n_t": 2, "mu": 0.3, "present": 0}, ...],
///    "G": [[row, column, value], ...], "b": [...], "solution": [...], "guess": [...]}
///
/// "law" is coulomb or associated; G has rows of all contacts together, each with its normal first; "present",
/// "solution", "guess" and "title" may be missing.
nlohmann::json contact_problem_json(const StoredContactProblem& stored);

/// @param where  it stands, for messages  @throws InputError for what does not fit, by its field
StoredContactProblem read_contact_problem(const nlohmann::json& document, const std::string& where);

/// Contact problems of a file, a line of JSON each where its name ends with .json or .jsonl, else of FCLib; or of all
/// such files in a directory and those below it, in the order of their names. Titles are filled in where they are empty.
/// @throws InputError for what cannot be read, and for a directory without a contact problem
std::vector<StoredContactProblem> read_contact_problems(const std::string& path);

}  // namespace ricochet
