#pragma once

#include <string>

#include "problems/problem.h"

namespace ricochet {

/// Controls as a CSV file: a line of names, t, u[0], u[1], ..., then a row for each of N equal intervals, t at its start.
/// @param u  n_u x N; @param H  length of an interval [s]
std::string controls_csv(const Matrix& u, double H);

/// Reads such a file. A column named t is skipped, lines that begin with # and empty ones are, too.
/// @return n_u x N. @throws InputError that names the line
Matrix read_controls(const std::string& path, int n_u);

}  // namespace ricochet
