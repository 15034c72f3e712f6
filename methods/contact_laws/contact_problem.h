#pragma once

#include <vector>

#include "methods/contact_laws/delassus.h"
#include "methods/contact_laws/friction_polygon.h"
#include "problems/named_values.h"

namespace ricochet {

/// Law between the impulses of a contact and its velocities.
enum class FrictionLaw {
  coulomb,     ///< friction opposes slip; the normal part is independent of it
  associated,  ///< the convex relaxation: the velocity is in the dual of the friction cone, slip opens the contact
};

/// The contact problem of one time step, in contact coordinates: find impulses r with
///
///   w = G r + b                                                                         (1)
///
/// and, contact by contact (normal r_n, tangents r_t; w_t the slip velocity), Coulomb's law
///
///   0 <= r_n  _|_  w_n >= 0                                                             (2)
///   ||r_t|| <= mu (r_n + p),   ||w_t|| r_t + mu (r_n + p) w_t = 0                       (3)
///
/// or the associated law, with the cone K = {||r_t|| <= mu r_n} and its dual K*,
///
///   K  contains  r  _|_  w  in  K* = {w_n >= mu ||w_t||}.                               (4)
///
/// b are the velocities without impulses, shifted by the impact law or by gap / h; p a normal impulse that is already
/// there. Without friction (1), (2) are a linear complementarity problem; (1), (4) are the optimality conditions of a
/// convex quadratic program when G is symmetric. The velocity w + mu ||w_t|| e_n fulfils (4) exactly when w fulfils
/// (2), (3) with p = 0: de Saxce's form of Coulomb's law.
///
/// Sources: Acary, Brogliato, Numerical Methods for Nonsmooth Dynamical Systems (2008), chapter 13; Anitescu, Math.
/// Program. 105 (2006) 113-143.
struct ContactProblem {
  struct Contact {
    int id = 0;  ///< of the scene
    int n_t = 0;
    double mu = 0;
    double present = 0;  ///< p; zero with the associated law
  };

  FrictionLaw law = FrictionLaw::coulomb;
  Delassus G;
  Vector b;  ///< at least G.n_rows()
  std::vector<Contact> contacts;
};

/// (2), (3) or (4) of one contact as a projection: F = 0,
///
///   F_n = r_n - c,   c = max(0, r_n - rho_n w_n)                                        (5)
///   F_t = r_t - P(r_t - rho_t w_t),   P: projection onto the disc of radius mu (c + p)  (6)
///
/// or F = r - P_K(r - rho_n w) for (4). Derivatives are an element of the generalised Jacobian.
/// Source: Alart, Curnier, CMAME 92 (1991), eq. (5), (6).
struct ContactMap {
  double F[3]{};
  double F_r[3][3]{}, F_w[3][3]{};

  /// @param r, w  1 + n_t of them; @param tie  impulse, up to which r_n <= rho_n w_n still counts as closed: (5) is
  /// then another element of its set of derivatives
  void evaluate(FrictionLaw law, const ContactProblem::Contact& contact, double rho_n, double rho_t, const double* r,
                const double* w, double tie = 0);
};

/// Sets the impulses of open contacts in r to zero: they are rounding, at most the tolerance of a solver.
void clear_open_contacts(const ContactProblem& problem, Vector& r);

/// The units in which a report measures the residuals of a whole problem [m/s, N s].
struct ContactScale {
  double velocity = 0, impulse = 0;
};

/// The largest |b| and |G_kk r_k|, and the impulse after it.
ContactScale scale_of(const ContactProblem& problem, const Vector& r);

/// E = max_j |b_j| / sqrt(g_j), g_j the largest G_kk of a contact: the root of an energy, which all units share.
double velocity_scale(const ContactProblem& problem);

/// Largest violation of (2)-(4): of (5), (6) as velocities; or, where friction in space has a polygon in place of the
/// disc, of the complementarity pairs. Each contact is measured by
///
///   V_i = max(|b_i|, min(R_i, E sqrt(g_i)), 1e-5 E sqrt(g_i)),   R_i = |b_i| + sum_j |G_ij| |r_j|     (7)
///
/// R_i are the terms that cancel at the contact, so that the unit of a gap and contacts elsewhere change nothing. The
/// scale is limited by b: impulses that grow because the laws have no solution must not hide an error in b. Rounding of
/// the terms is no violation, up to a small part of V_i. Under Coulomb's law a friction impulse is measured by the slip
/// that it makes, with the largest G_kk of the tangents.
/// @param w  velocities that belong to r; @param known  per row, lower bound of V_i; empty: none
double violation(const ContactProblem& problem, const Vector& r, const Vector& w, const FrictionPolygon& polygon,
                 const Vector& known = {});

/// The same. @param w  (1), written; at least G.n_rows()
double violation(const ContactProblem& problem, const Vector& r, const FrictionPolygon& polygon, Vector& w);

/// The contact with the largest violation; -1 when there is none.
int worst_contact(const ContactProblem& problem, const Vector& r, const Vector& w, const FrictionPolygon& polygon);

}  // namespace ricochet
