#pragma once

#include <optional>
#include <vector>

#include "reference/certified/ball_matrix.h"

/// @file
/// Redundant contacts: what their rows lock, and systems in which one impulse or force is not determined.

namespace ricochet::reference::certified {

/// Coordinates that are zero in every solution of rows v = 0, for all members of the balls. The rows are reduced to
/// echelon form; a reduced row with one entry that is not exactly zero locks the coordinate of its pivot.
std::vector<int> locked_coordinates(BallMatrix rows, const Precision& precision);

/// Whether row k has entries outside of `columns` that may not be zero.
bool leaves(const std::vector<Ball>& row, const std::vector<int>& columns);

/// An inequality along . y + constant >= 0.
struct LinearForm {
  std::vector<Ball> along;
  Ball constant;
};
/// -along . y - constant >= 0.
LinearForm opposite(LinearForm form);

/// The equations A y = b of velocities or accelerations and impulses or forces, where one row may follow from the
/// others. It is left out, and its unknown z becomes a parameter: the solutions of all other rows are
///
///     y = y0 + y1 z                                                                                              (1)
///
/// so that each inequality is an a + b z >= 0. Those with b > 0 bound z from below, z >= -a/b, those with b < 0 from
/// above. The row that was left out is two more inequalities.
class RedundantRow {
 public:
  /// Leaves out row `j` and unknown `j`. @returns nothing if the others may be singular, too
  static std::optional<RedundantRow> without(const BallMatrix& A, const std::vector<Ball>& b, std::size_t j,
                                             const Precision& precision);

  /// Whether no z satisfies all inequalities: bounds of z contradict each other, or an inequality is violated by every z
  /// between them (Farkas' lemma with two or three multipliers).
  bool is_refuted(const std::vector<LinearForm>& forms) const;
  /// A solution that satisfies all inequalities, strictly or with exactly zero; the row that was left out is not
  /// among them. @returns nothing if none is found
  std::optional<std::vector<Ball>> feasible(const std::vector<LinearForm>& forms) const;
  /// The z of feasible().
  Ball middle(const std::vector<LinearForm>& forms) const;
  /// Contains the solutions y of all z that satisfy the inequalities; not finite if z is not bounded.
  std::vector<Ball> hull(const std::vector<LinearForm>& forms) const;

 private:
  struct Line {
    Ball a, b;  ///< a + b z
  };
  /// Bounds of z, if there are some.
  struct Range {
    std::optional<Ball> least, most;
  };
  RedundantRow(const Precision& precision) : a_(precision) {}
  Line line_of(const LinearForm& form) const;
  Range range(const std::vector<LinearForm>& forms) const;

  Precision a_;
  std::vector<Ball> y0_, y1_;
  LinearForm left_out_;  ///< its row minus its right-hand side
};

}  // namespace ricochet::reference::certified
