#pragma once

#include <string>
#include <vector>

#include "reference/contact_dynamics.h"
#include "reference/contact_laws.h"
#include "reference/flights.h"
#include "reference/resting_groups.h"
#include "reference/slips.h"
#include "reference/smooth_motion.h"

namespace ricochet::reference {

/// Changes of the contact modes at one instant: impacts, closings, detachments, ends and starts of slip. In this
/// order:
///
///   slip ends if its root was found (Slips)
///   touching contacts are found, and closed ones without force open
///   groups at rest close together (resting_groups.h)
///   if one of them approaches, Newton's law with Coulomb's is solved, and repeated while others approach. A contact at
///   rest that the load opens takes no part, unless it was closed. If many impacts leave rates of groups at rest, these
///   close, too
///   the laws for accelerations decide which of the others stay closed, and stick or slip
///   events are recorded, and the first moments of slip in space are integrated (slip_start.h)
class ModeChanges {
 public:
  /// All arguments must outlive this object. @param tolerance  of the integration
  ModeChanges(const Problem& problem, const Scales& scales, double tolerance, ContactDynamics& dynamics, Slips& slips,
              Flights& flights, SmoothMotion& motion);

  /// solution.q, solution.v are the state before, and after on return. t increases if a slip in space ends or starts.
  /// False if no decision is possible, with a status and a reason.
  bool decide(double& t, const Roots& found, Solution& solution);

  /// Whether some contacts were at rest together, or a wedge was found.
  bool has_groups() const { return has_groups_; }

 private:
  /// Decisions of an event before the contact law is solved.
  struct Instant {
    std::vector<ContactMode> before;
    Vector v_minus;
    std::vector<char> stopped;                        ///< slip ended
    std::vector<char> leaves_cone;                    ///< sticks, with its force at the edge of the cone
    std::vector<char> rests;                          ///< no slip velocity after the impact
    std::vector<int> touching, released, candidates;  ///< gap zero; force became zero; touching and may stay
    bool approaches = false,
         is_ambiguous = false,  ///< an impact happens, and rounding decides the order of its contacts
        ends_together = false;  ///< (4) of Flights: it is the last impact of all touching contacts
    ContactLaws::Decision impact;
  };

  bool check_roots(double t, const Roots& found, Solution& solution) const;
  void finish_slip(double& t, const Roots& found, Instant& instant, Solution& solution);
  void find_touching(double t, const Roots& found, Instant& instant, const Solution& solution);
  std::vector<char> last_impacts(const Instant& instant, const Solution& solution);
  bool end_together(const Instant& instant, const Solution& solution);
  bool settle(Instant& instant, Solution& solution);
  void leave_to_sink(const std::vector<int>& contacts, const Solution& solution, double factor = 1);
  bool sink_slow(Instant& instant, const Solution& solution);
  bool rest_after_impacts(const Instant& instant, const Solution& solution) const;
  void keep_sunk(const Solution& solution);
  bool approaches(const Instant& instant, const Solution& solution) const;
  bool remove_drift(double t, Instant& instant, Solution& solution) const;
  bool follow_impacts(double t, Instant& instant, Solution& solution);
  bool leave_out_opening(double t, const Instant& instant, const Vector& rate, const Vector& rate_size,
                         std::vector<int>& meeting, Solution& solution) const;
  bool collide(double t, Instant& instant, Solution& solution);
  bool decide_candidates(double t, Instant& instant, Solution& solution);
  void find_stopped_along(Instant& instant, const Solution& solution) const;
  std::vector<Vector> known_directions(const Instant& instant, const Solution& solution) const;
  bool begin_slip(double& t, Solution& solution);
  bool record_events(double t, const Instant& instant, Solution& solution);
  const std::string& name(int i) const { return problem_.info().contacts[i].name; }

  const Problem& problem_;
  const Scales& scales_;
  const double tolerance_;
  const int n_q_, n_c_;
  const ContactLaws laws_;
  const RestingGroups groups_;
  ContactDynamics& dynamics_;
  Slips& slips_;
  Flights& flights_;
  SmoothMotion& motion_;
  bool has_groups_ = false;
  std::vector<ContactMode> modes_;  // of the dynamics; during a decision the new ones
};

}  // namespace ricochet::reference
