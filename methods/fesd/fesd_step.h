#pragma once

#include <vector>

#include "methods/runge_kutta/stage_solver.h"

namespace ricochet {

/// All discrete quantities of one FESD-J step: the finite elements and what happens at their left ends.
struct FesdStep {
  double H = 0;                  ///< length [s]
  int n_elements = 0;            ///< N_FE
  bool touches = false;          ///< some contact touched at the left end of an element: modes and impulses may be set
  std::vector<Stages> elements;  ///< the first n_elements are in use
  Matrix v_minus;                ///< n_q x elements: velocity before the impact at the left end of each element
  Matrix Lambda_n;               ///< n_c x elements: impulse there
  Matrix Lambda_t;               ///< n_lambda_t x elements

  void resize(const Problem& problem, int n_s, int max_elements) {
    elements.resize(static_cast<std::size_t>(max_elements));
    for (auto& stages : elements) stages.resize(problem.info(), n_s);
    v_minus.setZero(problem.n_q(), max_elements);
    Lambda_n.setZero(problem.n_c(), max_elements);
    Lambda_t.setZero(problem.info().n_lambda_t, max_elements);
  }
  const Stages& last() const { return elements[static_cast<std::size_t>(n_elements) - 1]; }
};

}  // namespace ricochet
