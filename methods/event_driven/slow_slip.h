#pragma once

#include <vector>

#include "methods/contact_laws/contacts_after_impact.h"
#include "methods/contact_laws/group_rest.h"
#include "methods/contact_laws/impact_solver.h"
#include "methods/modes/event_functions.h"
#include "problems/problem.h"

namespace ricochet {

/// Slip that counts as rest where the contacts of a group stick and slip in turn. Bodies that settle slip to and fro, ever
/// slower and in ever shorter times. With the height delta and the low speed of group_rest.h (1), at least
///
///   v_low = sqrt(2 |a| delta),   t_low = v_low / |a| >= H sqrt(2 tolerance),   H = T / 10                  (1)
///
/// because delta is the tolerance times a size of the gap that includes H^2 |a|. Slip is followed until 16 of its events
/// came in a row, each within t_low (the bound in (1)) after the one before. Then a contact with
///
///   |v_t| <= v_low                                                                                        (2)
///
/// counts as one that does not slip: it sticks if the contact law for all touching contacts lets it, and v is moved to
/// where its slip is zero. Otherwise it slides on. With friction the motion after a group comes to rest is unique where
/// all of it ends sticking or slides without reversal (group_rest.h), and (2) leaves the error of v at v_low. Slip
/// velocities of a group may depend on each other; the change of v is accepted if
///
///   dv' M dv <= 16 n^2 sum |v_t|^2 / G_tt                                                                 (3)
///
/// as in group_rest.h (3).
class SlowSlip {
 public:
  /// All references must outlive this object. @param law  prepared by its owner
  SlowSlip(const Problem& problem, GroupRest& rest, ImpactSolver& law);

  /// Before a run. @param tolerance  of (1)
  void restart(double tolerance);
  /// Counts an event. @param since  time since the last one [s]
  void count(const DetectedEvent& cause, double since);
  bool is_followed_enough() const { return row_ > kFollowed; }
  /// Whether so many events came in a row that the motion makes no progress.
  bool makes_no_progress() const { return row_ > kLongestRow; }
  /// Length of the row of events.
  long row() const { return row_; }

  /// Lets contacts that satisfy (2) not slide. @param low_speed  v_low [m/s]
  void hold(std::vector<ImpactSolver::ClosedContact>& closed, const Vector& v, double low_speed);
  /// After the contact law: lets those slide again that do not stick. False where all do.
  bool release(std::vector<ImpactSolver::ClosedContact>& closed);
  /// Lets all of them slide again. False where none was held.
  bool release_all(std::vector<ImpactSolver::ClosedContact>& closed);
  bool has_held() const { return !held_.empty(); }
  /// (3) for the velocities before and after the slip is removed.
  bool is_explained(const Vector& q, const Vector& v, const Vector& v_plus);

 private:
  static constexpr long kFollowed = 16, kLongestRow = 5000;
  struct Held {
    ImpactSolver::ClosedContact contact;  ///< as it slides
    double size;                          ///< |v_t|^2 / G_tt
  };
  bool release_if(std::vector<ImpactSolver::ClosedContact>& closed, const auto& is_released);

  const Problem& problem_;
  GroupRest& rest_;
  ImpactSolver& law_;
  double quick_ = 0;  // t_low [s]
  long row_ = 0;
  std::vector<Held> held_;
};

}  // namespace ricochet
