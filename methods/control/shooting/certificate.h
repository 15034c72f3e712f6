#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "methods/control/shooting/shooting_program.h"

namespace ricochet {

/// What is known of the end of an optimisation of (1) of shooting.h, whose cost J is smooth on each sequence of modes and
/// continuous where most of them meet.
struct Certificate {
  int n_active = 0;  ///< independent guards (guards.h) that are zero here
  std::vector<Guard> active;
  int n_pieces = 0;            ///< neighbouring pieces that were examined, the own one among them
  int n_unexamined = 0;        ///< of 2^n_active
  int n_edges = 0;             ///< neighbours that J jumps up to, or that have no motion: they do not count
  double lpec = 0;             ///< (2), relative to 1 + the largest gradient; 0 or less
  bool is_stationary = false;  ///< no piece that was examined descends

  /// A direction of the controls, n_u x N, and of H.
  struct Direction {
    Matrix u;
    double H = 0;
  };
  /// A descent in first order: the minimiser of (2) in one piece.
  struct Descent {
    double value = 0;       ///< of (2), relative like lpec
    Direction d;            ///< |d| <= 1 relative to the scales of the controls
    Direction into;         ///< leads away from all borders of the piece, likewise
    double into_value = 0;  ///< its change of the cost in first order, relative like value
  };
  std::vector<Descent> descents;  ///< the steepest first
  std::optional<Direction> jump;  ///< to a neighbour that J jumps down to

  bool is_b_stationary() const { return is_stationary && n_unexamined == 0 && n_edges == 0; }
  /// "B, 2 active guards, LPEC 3e-12"
  std::string describe() const;
};

struct CertificateOptions {
  double tolerance = 1e-6;  ///< of lpec
  double active = 1e-7;     ///< a guard is zero if a change of the controls by this part of their scales reaches it
  int max_pieces = 64;      ///< all pieces of six guards
  std::function<bool()> is_interrupted = {};  ///< true ends the examination: the certificate is incomplete
};

/// Examines a motion that an iteration ended with.
///
/// With b active guards up to 2^b pieces meet in it, one per set of guards that is crossed. A motion a little way into a
/// piece shows its gradient g_i, and by its cost whether J jumps there. The linear program with complementarity
///
///   min_i min_d  g_i' d,   |d| <= 1,   d within the bounds and active constraints, into piece i             (2)
///
/// is solved piece by piece; on the own piece alone, it is zero exactly where the conditions of first order hold with
/// multipliers of the guards that are not negative. If all are zero, the point is B-stationary: no direction descends in
/// first order. A neighbour that J jumps up to is an edge, as where a grazing impact may just happen, and does not count;
/// one that J jumps down to is a descent. Neighbours across few borders are examined first.
/// Source: Nurkanović, Leyffer, A globally convergent method for computing B-stationary points of mathematical programs
/// with equilibrium constraints, arXiv:2501.13835 (2025).
///
/// @param runner, lineariser  of the motion; the lineariser is used for the neighbours and ends with one of them
/// @param program  of the motion @param nu  of (3) of shooting.h
Certificate certify(PlantRunner& runner, MotionLineariser& lineariser, ShootingProgram& program,
                    const PlantMotion& motion, double nu, const CertificateOptions& options);

}  // namespace ricochet
