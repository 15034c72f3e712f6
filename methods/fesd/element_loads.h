#pragma once

#include <optional>
#include <vector>

#include "methods/contact_laws/contact_scales.h"
#include "methods/contact_laws/load_search.h"
#include "methods/fesd/element_path.h"
#include "methods/fesd/sign_conditions.h"

namespace ricochet {

/// Checks closed contacts between the points of an element, as ElementGaps checks open ones: slip velocities and, if
/// forces depend on time, forces and cone margins along the polynomials of element_path.h. FESD-J requires their signs
/// only at the points, so that a short pulse of a load between two of them is missed. LoadSearch proves the signs, up
/// to the tolerance of the motion, or finds the first fall. Forces that do not depend on time vary only with q and v,
/// which the error control resolves. Forces of redundant contacts, and of contacts on a friction polygon, have no
/// bounds and are checked only at the stages.
class ElementLoads {
 public:
  /// @param scales  sizes for rounding errors and the tolerance; read at every call
  ElementLoads(const Problem& problem, const ButcherTableau& tableau, const ContactScales& scales);
  void set_tolerance(double tolerance) { tolerance_ = tolerance; }  ///< of the motion
  void restart() { modes_.clear(); }                                ///< a new run

  /// The first switch inside an element whose points fulfil the sign conditions.
  Violation check(const Element& stages);
  /// The shortest time for which a function has been below zero within an element since begin_step() [s]; 0: none has.
  double shortest() const { return shortest_; }
  void begin_step() { shortest_ = 0; }

 private:
  void list(const Element& stages);
  void set_path(const Element& stages);
  void set_slip(const Element& stages, LoadSearch::Function& slip);
  double slack(const LoadSearch::Function& f) const;

  const Problem& problem_;
  const ContactScales& scales_;
  ElementPath path_;
  std::optional<LoadSearch> search_;
  double tolerance_ = 0, shortest_ = 0;
  std::vector<ContactMode> modes_;  // of the functions of search_; empty: none are listed
  Vector J_t_;                      // packed, at q0
};

}  // namespace ricochet
