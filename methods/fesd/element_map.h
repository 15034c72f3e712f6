#pragma once

#include <list>
#include <vector>

#include "methods/contact_laws/contact_scales.h"
#include "methods/elements/element_system.h"

namespace ricochet {

/// An element in closed form (affine_stages.h) of one length as a single affine map of the state x = (q_0, v_0) at its
/// left end, with all conditions that an element without a switch fulfils:
///
///   x_1 = x + D (x - x_r) + d                                                                                (1)
///   S (x - x_r) + s > bounds                                                                                 (2)
///
/// with x_r = (q_r, 0), q_r of mode_map.h.
/// The rows of (2) are the inequalities of sign_conditions.h at the stages and the right end, and the conditions by which
/// the laws of the instant at the right end keep the modes: no open contact touches, closed contacts have no normal
/// velocity and, if they stick, no slip, forces are not zero and those of sticking contacts inside the cone. If (2) holds,
/// the next element has the same modes, and no other value of this one is needed. If it does not, by rounding or by far,
/// the element is solved in full.
///
/// (1) adds an increment: the rounding of D does not act on x as a whole. One product of 2 n_q + 1 columns.
class ElementMap {
 public:
  /// For elements with the active set of the system, which must be affine. Uses the workspace of the system.
  ElementMap(ElementSystem& system, double h);

  /// False if (2) does not contain all conditions: friction in space, curved or bilateral contacts.
  bool is_complete() const { return is_complete_; }
  double h() const { return h_; }
  const std::vector<ContactMode>& modes() const { return modes_; }

  /// The bounds of (2), from the rounding in the run so far.
  void set_bounds(const ContactScales& scales);
  /// Whether the conditions at a right end hold at x, too.
  bool starts_from(const Vector& x) const;
  /// (1), where (2) holds; else x stays as it is. @return whether it does
  bool advance(Vector& x);

 private:
  /// A row of (2), at a stage or by the state at the right end: an Inequality of the mode; or, at the right end, that a
  /// closed contact has no normal velocity and, where it sticks, no slip.
  struct Condition {
    enum class Of : std::uint8_t { gap, force, cone, slip, normal_rest, tangential_rest };
    Of of;
    int contact;
    int point;  ///< stage; n_s: right end
    double sign = 1;
  };

  void list_conditions(const ElementSystem& system);
  double value(const Condition& condition, const ElementSystem& system, const ModeMap& map, const Element& e,
               double gap) const;
  Eigen::Index padded(Eigen::Index rows) const { return (rows + 3) / 4 * 4; }

  const double h_;
  const int n_q_, n_s_;
  std::vector<ContactMode> modes_;
  bool is_complete_ = true;
  std::vector<Condition> conditions_;
  Matrix J_n_, J_t_;                      // dense
  Vector reference_;                      // 2 n_q: x_r
  Matrix map_;                            // of (1) and (2): padded rows x (2 n_q + 1), constant column last
  Vector bounds_;                         // padded rows, zero for those of (1)
  Vector result_;                         // padded rows
  Vector change_;                         // 2 n_q: x - x_r
  Matrix at_start_;                       // rows of (2) at a right end, by the state there: x (2 n_q + 1)
  std::vector<Eigen::Index> start_rows_;  // those rows, among the conditions
};

}  // namespace ricochet
