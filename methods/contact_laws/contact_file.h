#pragma once

#include <string>

#include "methods/contact_laws/contact_problem.h"

namespace ricochet {

/// A contact problem of a file, with its solution and guess.
struct StoredContactProblem {
  ContactProblem problem{};
  std::string title{}, description{}, math_info{};
  Vector solution{}, guess{};  ///< impulses r, G.n_rows(); empty: none
};

/// Contact problems as files of the Friction Contact Library (FCLib: Acary, Bremond, Koziara, Perignon, INRIA RT-0444),
/// in HDF5: the local problem u = W r + q, normal first, with Coulomb's law, in groups /fclib_local, /solution,
/// /guesses. The global problem M v = H r + G l + f, u = H'v + w of /fclib_global is read, too: v and l are eliminated.
///
/// The contacts of a file are all in the plane (spacedim 2) or all in space (3): see uniform_contacts.h. When a file is
/// read, contacts with mu = 0 lose their tangents.

/// @throws InputError without the library
void require_contact_files();

/// @throws InputError without the library; for a file that is missing, has no problem, or whose sizes, indices or
/// values do not fit, by the name of the data set; for equality constraints V, R of a local problem, which are not read
StoredContactProblem read_contact_file(const std::string& path);

/// Writes a new file, under another name until it is complete; solution and guess with their velocities.
/// @throws InputError without the library; for a file that exists or cannot be written; for what FCLib cannot
/// represent: the associated law with friction, impulses that are already there
void write_contact_file(const StoredContactProblem& stored, const std::string& path);

}  // namespace ricochet
