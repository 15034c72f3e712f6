#pragma once

#include "problems/interval.h"
#include "problems/problem.h"

namespace ricochet {

/// The first time in the `span` [s] at which the switching function psi_k, of the time alone, changes its sign; the end
/// of the span if there is none. Parts of the span are divided until bounds of psi_k exclude a zero, so that none is
/// missed. @param q, v  any state, with the clock
double first_time_switch(const Problem& problem, int k, const Interval& span, Vector q, const Vector& v);

}  // namespace ricochet
