#pragma once

#include <span>

#include "methods/control/shooting/shooting.h"

namespace ricochet {

/// Solves coarse to fine: on the intervals of the guesses, then `levels` times on twice as many. Each interval is split
/// in two that have its control, so that the plant does the same, and the next solve starts there. A level that ends
/// without a stationary point hands its last iterate on.
/// @param shooting  its time limit is that of all levels together
/// @param guesses  n_u x N / 2^levels each, as in Shooting::solve()
/// @param T  first guess of the end time [s]
/// @param progress  iterations are numbered through all levels
/// @return of the last level, with the iterations and seconds of all
ControlSolution solve_refined(Shooting& shooting, std::span<const Matrix> guesses, int levels, double T,
                              const Shooting::Progress& progress = {});

/// Every column twice. @param u  n_u x N. @return n_u x 2 N
Matrix split_intervals(const Matrix& u);

}  // namespace ricochet
