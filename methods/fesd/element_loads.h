#pragma once

#include <optional>
#include <vector>

#include "methods/contact_laws/contact_scales.h"
#include "methods/contact_laws/load_search.h"
#include "methods/fesd/element_path.h"
#include "methods/fesd/sign_conditions.h"

namespace ricochet {

/// The closed contacts between the points of an element, as ElementGaps has the open ones: slip velocities and, where
/// forces depend on time, forces and cone margins along the polynomials of element_path.h. FESD-J requires their signs
/// at the points alone, so that a short pulse of a load between two of them is none. LoadSearch proves the signs, up to
/// the tolerance of the motion, or finds the first fall. Without time forces vary with q and v alone, which the error
/// control resolves. Forces of redundant contacts and those on a polygon in place of the friction disc have no bounds,
/// and are known at the stages alone.
class ElementLoads {
 public:
  /// @param scales  what rounding and the tolerance are relative to; read at every call
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
