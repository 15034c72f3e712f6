#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "methods/elements/switch.h"

namespace ricochet {

/// All discrete quantities of one FESD-J step: the finite elements and what happens at their left ends.
struct FesdStep {
  double H = 0;                   ///< length [s]
  int n_elements = 0;             ///< N_FE
  bool touches = false;           ///< some contact touched at the left end of an element: modes and impulses may be set
  std::vector<Element> elements;  ///< the first n_elements are in use
  std::vector<Switch> ends;       ///< per element: the switch at its right end; contact -1 for none
  /// Per element: impacts that follow each other at its left end, (1) of impact_sequence.h.
  std::vector<int> n_impacts;
  Matrix v_minus;   ///< n_q x elements: velocity before the impact at the left end of each element
  Matrix Lambda_n;  ///< n_c x elements: impulse there
  Matrix Lambda_t;  ///< n_lambda_t x elements

  /// Makes room for n elements and keeps those that are there.
  void resize(const Problem& problem, int n_s, int n) {
    const auto before = elements.size();
    elements.resize(static_cast<std::size_t>(n));
    ends.resize(static_cast<std::size_t>(n));
    n_impacts.resize(static_cast<std::size_t>(n), 0);
    for (std::size_t k = before; k < elements.size(); ++k) elements[k].resize(problem.info(), n_s);
    for (auto [matrix, rows] : {std::pair(&v_minus, problem.n_q()), std::pair(&Lambda_n, problem.n_c()),
                                std::pair(&Lambda_t, problem.info().n_lambda_t)}) {
      matrix->conservativeResize(rows, n);
      matrix->rightCols(n - static_cast<Eigen::Index>(before)).setZero();
    }
  }
  /// Impacts follow each other at the left end of an element.
  bool has_impact_sequence() const {
    return touches && std::any_of(n_impacts.begin(), n_impacts.begin() + n_elements, [](int n) { return n > 1; });
  }
  const Element& last() const { return elements[static_cast<std::size_t>(n_elements) - 1]; }
};

}  // namespace ricochet
