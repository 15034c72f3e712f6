#pragma once

#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"

/// @file
/// Functions of runs that consist of pieces: in regions, in states of friction, or in windows of time.

namespace ricochet {

/// Moves a state to the surfaces of contacts that are closed, in the norm of M: what they have drifted by, within the
/// tolerance, would be a flight at the start of a run. Likewise the velocity of contacts that stick.
/// @param modes   of all contacts; empty if they are not known: then nothing is moved
/// @param sticks  n_c, one direction each: contacts whose slip velocity becomes zero; empty for none
void hold_closed(const Problem& here, const std::vector<ContactMode>& modes, const std::vector<char>& sticks, Vector& q,
                 Vector& v);

/// The next piece of a run on a grid of `n` steps up to the time `T`, which begins at `t`: as many whole steps as there
/// are before `until`, or the rest of a step. All times in s. @returns its steps; sets `until` to its end
int piece_on_grid(double t, double T, int n, double& until);

/// Adds the counters of a `part` of a run to their `sum`.
void add_counters(const Counters& part, Counters& sum);

/// Adds the residuals of a `part` of a run: the larger one of each equation. @param t  begin of the part [s]
void add_residuals(const std::vector<Residual>& part, double t, std::vector<Residual>& all);

/// Adds a `piece` of a run to the `whole`, at whose end it begins. Contacts that the border between them has changed
/// get an event. Derivatives are left alone.
/// @param modes  of all contacts at the end of `whole`; empty at its start, or if the method has no modes
void append(const ProblemInfo& info, Solution piece, Solution& whole, std::vector<ContactMode>& modes);

}  // namespace ricochet
