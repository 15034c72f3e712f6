#pragma once

#include <string>
#include <utility>
#include <vector>

#include "reference/certified/certified_motion.h"

/// @file
/// Certificates: a proven motion with everything that somebody else needs to check the proof. CERTIFICATES.md explains
/// the format and lists what a checker has to do.

namespace ricochet::reference::certified {

/// An event of a certificate. It happens at the end of a step, or at t = 0.
struct CertificateEvent {
  int step = -1;                          ///< index of the step that it ends; -1: t = 0
  std::string kind, contact;              ///< as in CertifiedEvent
  std::vector<std::string> modes;         ///< of all contacts after it
  CertifiedNumber time;                   ///< [s], derived from the ball of t at the beginning of the next step
  std::vector<CertifiedNumber> Lambda_n;  ///< impulses of all contacts, of an impact [N s]
};

/// A motion as a chain of sets. Let X_k be the box `steps[k].state` at the time t_k in the ball `steps[k].time`, and
/// phi the flow of the equations of motion with the modes of step k. A certificate states
///
///     (q0, v0) in X_0                                             after an impact at t = 0, if there is one     (1)
///     x(t) = sum_{j<=N} c_j (t - t_k)^j + r,  |r| <= rho_k,       on [t_k, t_k + h_k], for every x(t_k) in X_k  (2)
///     phi(X_k, tau_k h_k) in X_{k+1},  t_k + tau_k h_k in t_{k+1}                                               (3)
///     I_k(phi(X_k, tau_k h_k)) in X_{k+1}                         instead of (3), with the map I_k of an event  (4)
///     g(t) > 0 on the whole step, for every event function g of its modes                                       (5)
///     g(t) > 0 before, dg/dt < 0 at, tau_k h_k for that of an event, which has its root there                   (6)
///     phi(X_n, T - t_n) in `final_state`                                                                        (7)
///
/// where impacts and modes in (4) satisfy the laws of problem.h, and every other combination violates a strict
/// inequality. Theorem: if (1) to (7) hold, the scene has exactly one motion up to T, except for what `assumptions`
/// list; it has these events and modes, and its state at T is in `final_state`. Proof: by induction over the steps, the
/// state at t_k is in X_k.
///
/// The sets of a certificate are wider than the results of the step before: a checker computes its own results and
/// requires that they are contained. None of its roundings needs to be those of the program that wrote the certificate.
struct Certificate {
  std::string scene;                     ///< text of a scene file, scene_text()
  std::string scene_hash;                ///< sha256() of it
  Reading reading = Reading::decimal;    ///< of its numbers
  int digits = 30;                       ///< that were wanted
  long bits = 0;                         ///< precision of the midpoints
  int order = 0;                         ///< N
  Grade grade = Grade::open;             ///< proven or assumed
  std::vector<std::string> assumptions;  ///< of the latter
  std::vector<CertifiedStep> steps;
  std::vector<CertificateEvent> events;
  std::vector<std::string> final_state;                       ///< balls of q and v at T, before decimal numbers
  std::vector<std::string> final_modes;                       ///< of all contacts
  std::vector<CertifiedNumber> q, v;                          ///< derived from final_state
  std::vector<std::pair<std::string, std::string>> versions;  ///< of programs and libraries, name and number
  std::string stated_hash, hash;  ///< of everything else: as a file states it, and as it is; set by read_certificate()
};

/// The certificate of a `motion` of the `problem`, which certified_motion() found with `options`; they include
/// with_steps.
/// @throws InputError if there is none: an open motion, the mean value form, impacts that are simultaneous or
/// accumulate, or no formulas
Certificate certificate_of(const Problem& problem, const CertifiedMotion& motion, const Options& options);

/// The certificate as JSON, with the hash of its content.
std::string certificate_text(const Certificate& certificate);
/// Reads certificate_text(). Nothing is checked but the format. @throws InputError that names what cannot be read
Certificate read_certificate(const std::string& text);

/// Result of check_certificate().
struct CertificateReport {
  bool is_valid = false;  ///< (1) to (7) hold, and all decimal numbers follow
  std::string reason;     ///< what does not; empty if valid
  int step = -1;          ///< index of the step where this was found; -1: before the first one
  double seconds = 0;     ///< wall time
};

/// Verifies a certificate. Equations and rules of remainders are those of the program that writes certificates; the
/// lengths of steps, enclosures, remainders, times of events and modes are those of the certificate.
/// @param with_hash  refuse a certificate whose content is not that of its hash
CertificateReport check_certificate(const Certificate& certificate, bool with_hash = true, double max_seconds = 600);

}  // namespace ricochet::reference::certified
