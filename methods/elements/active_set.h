#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "methods/contact_laws/friction_polygon.h"
#include "methods/elements/element.h"
#include "problems/problem.h"

namespace ricochet {

/// A closed contact. Its unknowns and equations at a stage: the normal ones, then, unless the mode gives the tangential
/// force, the tangential ones.
struct ActiveContact {
  int contact = -1;
  ContactMode mode = ContactMode::closed;
  int facet = 0;
  int row = 0;     ///< of its first unknown among those of all closed contacts
  int n_rows = 1;  ///< 1 or 1 + n_t, 2 on an edge
  int entry = 0;   ///< its first one in StageDerivatives
  TangentialLaw law;
};

/// Slip in space that ends at the right end of an element.
struct SlipEnd {
  int contact = -1;       ///< (8) of switch_function.h holds for it; -1: none
  bool together = false;  ///< (9) holds for all contacts of the same bodies
};

/// The closed contacts of an element, their modes, and the resulting unknowns and equations:
///
///   x_j = (w_j, lambda_j),   lambda_j: of every closed contact lambda_n, then n_rows - 1 components of lambda_t
///
/// An element depends on the coordinates that it is given, not on the scene: loops over contacts run over closed()
/// only, and newton_system.h finds the couplings.
class ActiveSet {
 public:
  ActiveSet(const ProblemInfo& info, const FrictionPolygon& polygon, int n_s);

  /// @return false if this is the active set already
  bool set(const std::vector<ContactMode>& modes, const std::vector<int>& facets);

  std::span<const ActiveContact> closed() const { return closed_; }
  bool empty() const { return closed_.empty(); }
  const ActiveContact& of(int contact) const;
  const std::vector<ContactMode>& modes() const { return modes_; }
  const std::vector<int>& facets() const { return facets_; }
  /// The same, without their modes.
  const std::vector<int>& contacts() const { return contacts_; }

  int n_rows() const { return static_cast<int>(row_power_.size()); }     ///< unknown forces per stage
  int n_unknowns() const { return n_coordinates_ + n_rows(); }           ///< per stage
  int n_entries() const { return n_entries_; }                           ///< of StageDerivatives, per stage
  int row_power(int row) const { return row_power_[std::size_t(row)]; }  ///< power of h by which it is divided
  bool has_friction() const { return has_friction_; }                    ///< of a closed contact
  bool has_curved() const { return has_curved_; }                        ///< a closed contact is curved
  bool turns() const { return turns_; }                                  ///< a contact slips in space: (7c)

  /// The slip that ends with the element that is being solved. It changes equations, but not the unknowns.
  void set_slip_end(SlipEnd end) { slip_end_ = end; }
  const SlipEnd& slip_end() const { return slip_end_; }
  /// (8) or (9) holds for the contact at this stage.
  bool rests(const ActiveContact& active, int stage) const {
    if (active.mode != ContactMode::slip || stage != n_s_ - 1) return false;
    return active.contact == slip_end_.contact ||
           (slip_end_.together && info_.contacts[active.contact].support == info_.contacts[slip_end_.contact].support);
  }
  /// Number of tangent directions, TangentialLaw::held, in which (7a) holds for the contact at this stage.
  int n_held(const ActiveContact& active, int stage) const {
    return rests(active, stage) ? info_.contacts[active.contact].n_t : active.law.n_held;
  }
  /// The divisor of (7a): h, but 1 for (8), which is among rows (7c).
  static double tangential_scale(const ActiveContact& active, double h) {
    return active.mode == ContactMode::slip ? 1 : h;
  }
  /// Whether slip in space starts from rest in this element: (7d) of stage_equations.h.
  bool starts_slip(const ActiveContact& active, const Element& element) const {
    if (active.mode != ContactMode::slip) return false;
    const double* start = element.slip_start.data() + info_.contacts[active.contact].tangent_index;
    return start[0] != 0 || start[1] != 0;
  }
  /// Direction d of slip in lambda_t = -mu lambda_n d + ..., a unit vector of (7b), (7c) at velocity v.
  /// @param J_t  tangent Jacobians of all contacts there, packed
  /// @return ||v_t||, 0 when the direction does not depend on it
  double slip_direction(const ActiveContact& active, const double* J_t, const double* v, const Element& element,
                        double* direction) const {
    const auto& contact = info_.contacts[active.contact];
    if (active.mode != ContactMode::slip) {
      std::copy_n(active.law.along.data(), 2, direction);
      return 0;
    }
    J_t += contact.tangent_begin;
    for (int d = 0; d < 2; ++d) {
      direction[d] = 0;
      for (const int row : contact.support) direction[d] += *J_t++ * v[row];
    }
    const double speed = std::hypot(direction[0], direction[1]);
    if (speed == 0 && starts_slip(active, element)) {
      std::copy_n(element.slip_start.data() + contact.tangent_index, 2, direction);
      return 0;
    }
    for (int d = 0; d < 2; ++d) direction[d] /= speed;
    return speed;
  }

 private:
  const ProblemInfo& info_;
  const FrictionPolygon polygon_;
  const int n_s_, n_coordinates_;
  std::vector<ContactMode> modes_;
  std::vector<int> facets_;
  std::vector<ActiveContact> closed_;
  std::vector<int> contacts_;
  std::vector<int> row_power_;
  SlipEnd slip_end_;
  int n_entries_ = 0;
  bool has_friction_ = false, has_curved_ = false, turns_ = false;
};

}  // namespace ricochet
