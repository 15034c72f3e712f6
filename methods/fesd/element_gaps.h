#pragma once

#include <span>

#include "methods/contact_laws/gap_search.h"
#include "methods/fesd/element_path.h"
#include "methods/fesd/sign_conditions.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// The gaps of open contacts between the points of an element: left end, stages, right end. FESD-J requires
///
///   f_c^i(q(s)) >= 0                                                                      (1)
///
/// only at the points, so that an impact between two of them is missed. A method that chooses its steps by a tolerance
/// must find it, however long they are. Here (1) holds for 0 <= s <= 1, with the polynomial (1) of element_path.h.
///
/// GapSearch proves (1) or finds the first closing. If a contact touches at the left end, the error of its gap before
/// the first stage is a fraction of the gap there, however small both are. Up to the first stage (1) may therefore be
/// violated by a hundredth of the gap at that stage, and by no more than (7) of gap_search.h. A contact that opens
/// without a load may have a negative gap there, as in SignConditions::check().
class ElementGaps {
 public:
  /// @param scales  sizes for rounding errors of the gaps; read at every call
  ElementGaps(const Problem& problem, const ButcherTableau& tableau, const ContactScales& scales);
  void restart() { search_.restart(); }

  /// The first closing in an element whose points fulfil the sign conditions.
  /// @param unloaded  contacts that the load of the next moment opens; @param sinks  ElementStart::sinks
  Violation check(const Element& stages, std::span<const int> unloaded = {}, std::span<const char> sinks = {});

 private:
  void set_path(const Element& stages);

  const Problem& problem_;
  const ContactScales& scales_;
  ElementPath path_;
  GapSearch search_;
  std::vector<char> is_set_;  // per coordinate: the path has it
  Vector J_n_;                // packed, at q0
};

}  // namespace ricochet
