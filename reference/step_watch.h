#pragma once

#include <optional>
#include <vector>

#include "problems/force_bounds.h"
#include "problems/interval.h"
#include "problems/problem.h"
#include "reference/contact_dynamics.h"
#include "reference/flights.h"
#include "reference/slips.h"
#include "reference/smooth_motion.h"

namespace ricochet::reference {

/// Finds root functions that fall below zero and rise again within one step, which a root finder that compares the ends
/// of steps misses. An accepted step has polynomials q(t) and v(t) of the integrator's degree d. About the middle
/// m of a piece of length 2 r,
///
///   x(m + s) = sum_j x_j s^j,   |s| <= r                                                 (1)
///   x_0 +- sum_{j>0} |x_j| r^j  contains x,   x_1 +- sum_{j>1} j |x_j| r^(j-1)  x'       (2)
///
/// so that every root function of smooth_motion.h has bounds over the piece:
///
///   gap, slip velocity   of an affine contact, (2) of the polynomial J' x                (3)
///   gap                  gap(q_0) +- r |J_n(q)' q'| with J_n over the box of q           (4)
///   slip velocity        J_t(q)' v over the boxes of q and v                             (5)
///   forces, cone margin  ForceBounds                                                     (6)
///
/// Pieces are halved in the order of time. A piece is clear for a function if its bounds are above -slack, or if its
/// rate, known for (3) and (4), has one sign and its values at the ends are above -slack. If the rate is negative and
/// the value at the end is below -slack, the root is located there. The slack is the uncertainty of the integration:
/// the tolerance for gaps and 100 tolerances for slip, relative to their sizes; for forces, 100 tolerances of their
/// values at the ends of the step. The guarantee is for the polynomials, whose error the tolerance controls.
///
/// If pieces are shorter than 2^-20 of the step, or after kMostPieces of them, the values at the ends of the pieces
/// decide: functions that are below -slack at neither end count as clear.
///
/// Forces are searched if the scene depends on time, if the integrator takes long steps, or if their values at the ends
/// of the step are not large compared with their change. Otherwise they vary only with q and v, which the error control
/// resolves. A problem without bounds (has_bounds) has only (3). Its other functions are compared at 32 points, and its
/// steps end before a gap can close at its rate (longest_step()). Redundant forces have no bounds and are sampled, too.
class StepWatch {
 public:
  /// The other arguments must outlive this object. @param tolerance  of the integration
  StepWatch(const Problem& problem, const Scales& scales, double tolerance, ContactDynamics& dynamics,
            const Slips& slips, const Flights& flights, SmoothMotion& motion);

  /// To be called after a mode change.
  void restart() { has_start_ = false; }
  /// The time of the first root within the last step, which began at `from` and ended at `to`. @param found  set to it
  std::optional<double> first_root(double from, double to, Roots& found);
  /// Longest next step from (t, q, v) [s]; 0: no limit. A force that depends on time is examined in advance, with
  /// constant q and v. Steps end before a time span in which five values are not smooth or do not explain its bounds,
  /// such as a short pulse; within it they are no longer than its pieces.
  /// @param planned  length of the step that the integrator would take [s]
  double longest_step(double t, double planned, const Vector& q, const Vector& v);

 private:
  enum class Kind { gap, force, cone, slip };
  /// A root function. Its values are those of SmoothMotion::roots().
  struct Function {
    Kind kind;
    int contact, index;  ///< index: among the root functions of SmoothMotion
    double slack;
    double offset = 0;  ///< of a slip, see Slips
  };
  /// Part of a step, by times relative to its end [s], with the values of all root functions at both ends.
  struct Piece {
    double from, to;
    int depth;
    Vector left, right;
  };
  using Functions = std::vector<const Function*>;

  void set_polynomials();
  void list_functions();
  bool has_constant_forces() const;
  void values_at(double s, Vector& values);
  void set_piece(const Piece& piece);
  void set_boxes();
  /// The first root in the piece; `first` is its function.
  std::optional<double> search(const Piece& piece, const Functions& functions, int& budget, const Function*& first);
  std::optional<double> first_of(const Functions& located, const Piece& piece, const Function*& first);
  double locate(const Function& function, const Piece& piece);
  void bounds_of(const Function& function, Interval& value, Interval& rate);
  void add_polynomial(const ContactInfo& contact, const double* J, double factor, bool of_velocity, double* x) const;
  void look_ahead(double until, const Vector& q, const Vector& v);

  const Problem& problem_;
  const Scales& scales_;
  const double tolerance_;
  ContactDynamics& dynamics_;
  const Slips& slips_;
  const Flights& flights_;
  SmoothMotion& motion_;
  ForceBounds force_bounds_;

  // Data of the step.
  double end_ = 0, length_ = 0;  // [s]
  int degree_ = 0;
  Matrix coefficients_;  // (degree + 1) x 2 n_q, about its end
  Vector packed_n_, packed_t_;
  std::vector<Function> functions_;
  Vector start_, stop_;  // values at its ends
  bool has_start_ = false;
  std::vector<int> curved_open_, curved_closed_;
  // Data of the current piece.
  Matrix shifted_;  // (degree + 1) x 2 n_q, about its middle
  double radius_ = 0;
  bool has_boxes_ = false, has_forces_ = false, forces_known_ = false, has_slips_ = false;
  Vector gaps_, middle_, y_, zero_, power_;
  std::vector<Interval> box_, rate_box_, gap_box_, normal_, tangent_;
  // Data of the time span that is examined in advance.
  struct Span {
    double from, to;
  };
  std::vector<Span> spans_;
  Vector negligible_;  // negligible force [N], by coordinate
  double ahead_ = 0;   // [s]
  std::size_t passed_ = 0;
};

}  // namespace ricochet::reference
