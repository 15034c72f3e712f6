#pragma once

#include <string>
#include <vector>

#include "methods/contact_laws/contact_problem.h"
#include "problems/problem.h"

namespace ricochet {

/// Proof that a contact problem has no solution: contacts that close against each other, whatever impulses they have,
///
///   d >= 0,   sum_i d_i G_k,n(i) = 0 for all rows k,   sum_i d_i b_n(i) < 0.                           (1)
///
/// Then sum_i d_i w_n(i) = sum_i d_i b_n(i) < 0 for all r, where all w_n >= 0 are required: under Coulomb's law and, as
/// w_n >= mu ||w_t||, under the associated law. For a symmetric G without friction the converse holds, too (Farkas).
///
/// d is the point of the cone {d >= 0, G_nn d = 0} nearest to -b_n, in coordinates in which G_nn has a diagonal of one.
/// Not for the hot path: it allocates.
/// @return the contacts with d_i > 0, ascending, as numbers of problem.contacts; empty: there is no proof
std::vector<int> conflicting_contacts(const ContactProblem& problem);

/// Names of contacts in a message: contact 'a', or contacts 'a', 'b' and 'c', at most a handful of them.
std::string quoted_contacts(const ProblemInfo& info, const std::vector<int>& contacts);

}  // namespace ricochet
