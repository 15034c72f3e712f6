#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/problem.h"

/// @file
/// certified_motion(): the motion of a scene with proven digits. The types here do not need Arb.

namespace ricochet::reference::certified {

/// How far a result is proven, from the strongest to the weakest. The grade of a motion is the weakest of its
/// decisions.
enum class Grade {
  proven,    ///< strict signs, every alternative refuted, all zeros follow from formulas
  assumed,   ///< relies on listed equalities or statements that arithmetic with balls cannot prove
  computed,  ///< relies on a number that is taken as zero, without proof
  open       ///< undecided; there is no final state
};
/// "proven", and so on.
const char* name_of(Grade grade);

/// How numbers of a scene are read.
enum class Reading {
  decimal,  ///< as written: 0.3 is three tenths, 1/3 is a third. Other parameters, and numbers in code, are kept as
            ///< doubles; they are the shortest decimals that read back to them
  rounded   ///< each number is the double next to it, exactly: the scene that methods in doubles integrate
};

/// Options of certified_motion().
struct Options {
  int digits = 30;                     ///< proven decimal places that are wanted, of states and event times
  Reading reading = Reading::decimal;  ///< of numbers
  double max_seconds = 10;             ///< wall time [s]; an open result states that it ran out
  long bits = 0;                       ///< first precision of the midpoints; 0: from `digits`
  double order_per_bit = 0.35;         ///< N = order_per_bit * bits
  bool with_steps = false;             ///< fill CertifiedMotion::steps, for certificates, and leave room in all balls
  bool mean_value_form = false;        ///< begin with the mean value form instead of boxes
  bool with_sensitivities = false;     ///< fill CertifiedMotion::sensitivities
  bool may_compute = true;             ///< try the grade `computed` where a proof fails
};

/// A number with proven digits: |value - text| <= radius.
struct CertifiedNumber {
  std::string text;   ///< decimal
  double radius = 0;  ///< rounded up
  int decimals = 0;   ///< proven decimal places, floor(-log10(radius)); 999 if the text is exact
};

/// An event of the motion.
struct CertifiedEvent {
  std::string kind;      ///< impact, detach, slip_to_stick, stick_to_slip, slip_reversal, slip_end, zeno_end, border
  std::string contact;   ///< name of the contact that caused it; of a border its psi_k
  CertifiedNumber time;  ///< [s]
  std::vector<std::string> modes;         ///< of all contacts after it: open, closed, stick, slip+, slip-, slip
  std::vector<CertifiedNumber> Lambda_n;  ///< impulses of all contacts, of an impact [N s]
  Grade grade = Grade::proven;            ///< of the motion up to here
};

/// The derivative of the final state with respect to one variable, with proven digits.
struct CertifiedSensitivity {
  std::string variable;            ///< "q0:1", "v0:0", "param:mu", as of variables()
  std::string reason;              ///< why there is no derivative, or none that is proven; empty otherwise
  std::vector<CertifiedNumber> q;  ///< dq(T), n; empty if there is none
  std::vector<CertifiedNumber> v;  ///< dv(T), n; empty if there is none
};

/// One Taylor step, for certificates. Numbers with radii are texts of arb_dump_str: exact, hexadecimal.
struct CertifiedStep {
  std::string time;                ///< ball of t at the beginning [s]
  double length = 0;               ///< h [s], exactly
  std::string end;                 ///< ball of the end within the step, as a fraction of h
  std::vector<std::string> modes;  ///< of all contacts
  std::vector<std::string> state;  ///< balls of q and v at the beginning
  std::vector<double> remainders;  ///< of q and v, bounds rho of SeriesProgram (1), rounded up
  int n_events = 0;                ///< events before it, those at its beginning included
};

/// The motion of a scene from t = 0 to its end time.
struct CertifiedMotion {
  Grade grade = Grade::open;             ///< of the whole
  std::string reason;                    ///< why it is open; empty otherwise
  bool bends = false;                    ///< open because a formula bends or jumps
  std::vector<std::string> assumptions;  ///< of grades `assumed` and `computed`
  Reading reading = Reading::decimal;    ///< as in Options
  std::vector<CertifiedNumber> q, v;     ///< of the bodies at the end time; empty if open
  std::vector<std::string> modes;        ///< at the end
  CertifiedNumber end_time;              ///< [s]; where an open motion stopped
  std::vector<CertifiedEvent> events;    ///< in order; those before it stopped if open
  std::vector<CertifiedStep> steps;      ///< if Options::with_steps
  std::string no_certificate;            ///< why certificates cannot describe it; empty if they can
  std::vector<std::string> final_state;  ///< balls of q and v at the end, as in `steps`
  long bits = 0;                         ///< of the last attempt
  int order = 0;                         ///< degree N of its Taylor polynomials
  int n_steps = 0;                       ///< its Taylor steps
  int attempts = 0;                      ///< runs with rising precision
  bool mean_value_form = false;          ///< the last attempt used it
  double seconds = 0;                    ///< wall time of everything

  std::vector<CertifiedSensitivity> sensitivities;  ///< of all variables(), if Options::with_sensitivities
  std::string no_sensitivities;                     ///< why there are none; empty if there are

  /// Proven decimal places of the worst number of q, v and the event times.
  int decimals() const;
};

/// Whether the `problem` is small enough for a proof: to translate the n (n + n_c) entries of M and J_n takes a second.
inline bool is_small(const Problem& problem) {
  constexpr long kMostEntries = 20000;
  const long n = problem.n_q();
  return n * (n + problem.n_c()) <= kMostEntries;
}

/// Whether the program was built with Arb. Otherwise certified_motion() returns an open motion that says so.
bool can_certify();

/// Encloses the motion of the `problem` and proves it, as far as possible. Never throws for a scene that is beyond it:
/// the result is open, with the reason.
CertifiedMotion certified_motion(const Problem& problem, const Options& options = {});

/// Methods round the numbers of a scene to double. This is the effect on the final state: the largest difference of
/// (q, v) between `motion`, whose decimals are exact, and the proven motion of the rounded scene, to within 1e-18.
/// @returns nothing where the rounded scene stays open or has other events
std::optional<double> moved_by_rounding(const Problem& problem, const CertifiedMotion& motion, Options options);

}  // namespace ricochet::reference::certified
