#pragma once

#include "methods/contact_laws/contact_matrix.h"
#include "methods/contact_laws/contact_problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Semismooth Newton method with line search for contact problems with the exact friction cone:
///
///   F(r) = 0,  contact by contact the projection form of its law, contact_problem.h (5), (6)      (1)
///   (F_r + F_w (G + alpha I)) s = -F,   an element of the generalised Jacobian                     (2)
///   r <- r + 2^-k s with the first k = 0, 1, ... that shortens F                                  (3)
///
/// A contact at r_n = w_n = 0 may count as open or as closed in (2). In the first step from r = 0 it is closed:
/// otherwise the contacts of bodies at rest would close one by one, an iteration each. If (3) then finds no step, it is
/// open.
///
/// alpha = 1e-10 of the diagonal, or less where that makes (2) slow, keeps (2) regular for redundant contacts, a box on
/// four corners, where r is not unique; F itself stays exact. Storage is kept between calls.
///
/// Sources: Alart, Curnier, CMAME 92 (1991); Acary, Brogliato (2008), section 13.6.
class ProjectionNewton {
 public:
  /// Iterates from r as far as (3) leads. @param tolerance  of violation(); @param left  steps, counted down
  /// @return solved
  bool iterate(const ContactProblem& problem, double tolerance, int& left, Vector& r);
  /// Adds its work since the last call.
  void count(Counters& counters);

 private:
  double evaluate(const ContactProblem& problem, const Vector& r, bool jacobian, double tie = 0);
  double linearize(const ContactProblem& problem, const Vector& r, double tie = 0);
  bool shorten(const ContactProblem& problem, const Vector& r, double& error);

  int iterations_ = 0;
  double alpha_ = 0;
  FrictionPolygon disc_;
  ContactMap map_;
  Vector w_, F_, step_, trial_;
  ContactMatrix matrix_;
};

}  // namespace ricochet
