#pragma once

#include "reference/event_located.h"

namespace ricochet::reference {

/// integrate_event_located() of a scene whose formulas bend or jump: region by region. In a region
/// (problems/regions/switching_functions.h) all formulas are smooth, and SmoothMotion ends at the zero of
///
///     sigma_k psi_k(q, v) + delta_k,   delta_k = max(1e-13, tolerance / 10) of the terms of psi_k                  (1)
///
/// which is positive while psi_k is a rounded zero, and goes back to the zero of psi_k in that step. Where a border is
/// passed again and again in a short time, as by the last bounces of a body with drag, and the formula only bends there,
/// these passages happen in one region: delta_k is the largest power of ten for which the accelerations of both sides
/// differ, at |psi_k| = delta_k, by less than tolerance / 100 of their size, as long as
///
///     sigma_k psi_k < 2 delta_k                                                                                   (2)
///
/// Zeros of functions of time alone are end times of the runs before them. The zero of ProblemInfo::until ends the run,
/// but not if it is that of the start. If both sides of a border lead back to it, the motion slides on it, in a region of
/// its own (problems/regions/sliding.h), and the run ends with Status::infeasible and the formula where there is none.
/// Uses nothing of methods/.
Solution integrate_by_regions(const Problem& problem, const EventLocatedSettings& settings);

struct RegionPiece {
  Solution solution;            ///< `exit` names the function that ended it; the state is that at the border
  std::vector<char> in_flight;  ///< by contact, at its end (Flights::in_flight())
};

/// The run within one region, or of a problem without switching functions (event_located.cpp).
RegionPiece integrate_in_region(const Problem& problem, const EventLocatedSettings& settings);

}  // namespace ricochet::reference
