#pragma once

#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// One Runge-Kutta step with all its values: a finite element of FESD-J. Its equations are in stage_equations.h.
struct Element {
  double h = 0;   ///< length [s]
  Vector q0, v0;  ///< left end (after an impact)
  /// n_q x n_s: positions, velocities, accelerations v' at the stages. Tableaus that hold accelerations keep only the
  /// first one of `a`, at the left end, and no forces, unless an audit requires all.
  Matrix q, v, a;
  Matrix lambda_n;              ///< n_c x n_s; zero for an open contact
  Matrix lambda_t;              ///< n_lambda_t x n_s
  Vector slip_start;            ///< n_lambda_t; in: unit slip direction where slip in space starts from rest, else 0
  Vector q1, v1;                ///< right end
  bool closes_bounce = false;   ///< in: a contact that bounced is closed; its velocity has to end here
  bool is_projected = false;    ///< end_projection.h: (10) made v1
  bool has_end_forces = false;  ///< (11) gave the forces at the right end, not the stages:
  Vector end_lambda_n, end_lambda_t;  ///< n_c, n_lambda_t; zero if the tableau does not determine the right end
  Vector end_a;                       ///< n_q, v' at the right end; of a tableau that holds accelerations
  std::vector<ContactMode> modes;     ///< n_c
  std::vector<int> facets;            ///< n_c, of vertex_slip and edge_slip, else 0; empty without friction in space

  void resize(const ProblemInfo& info, int n_s);
  /// Discards the values of another element as first guess.
  void forget_guess() {
    for (Matrix* unknowns : {&a, &lambda_n, &lambda_t}) unknowns->setZero();
  }
};

}  // namespace ricochet
