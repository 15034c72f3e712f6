#pragma once

#include <string>
#include <vector>

#include "reference/contact_dynamics.h"
#include "reference/contact_laws.h"
#include "reference/flights.h"
#include "reference/slips.h"
#include "reference/smooth_motion.h"

namespace ricochet::reference {

/// What happens to the contact modes at one instant: impacts, closings, detachments, ends and begins of slip. In this
/// order:
///
///   slip whose root was found ends (Slips)
///   contacts that touch are found, and closed ones without force open
///   Newton's law with Coulomb's, where one of them approaches; once more, as long as that sends others together. Those
///   at rest take no part that the load opens, unless they have been closed
///   the laws for accelerations decide which of the others stay closed, and stick or slip
///   events are recorded, and the first moments of slip in space passed (slip_start.h)
class ModeChanges {
 public:
  /// All of them have to outlive this. @param tolerance  of the integration
  ModeChanges(const Problem& problem, const Scales& scales, double tolerance, ContactDynamics& dynamics, Slips& slips,
              Flights& flights, SmoothMotion& motion);

  /// solution.q, solution.v hold the state before, and after on return. t moves on where a slip in space ends or begins.
  /// False where no decision is possible, with a status and a reason.
  bool decide(double& t, const Roots& found, Solution& solution);

 private:
  /// What an event decides before the contact law is asked.
  struct Instant {
    std::vector<ContactMode> before;
    Vector v_minus;
    std::vector<char> stopped;                        ///< slip ended
    std::vector<char> leaves_cone;                    ///< stuck, and its force is at the edge
    std::vector<char> rests;                          ///< no slip velocity behind the impact
    std::vector<int> touching, released, candidates;  ///< gap zero; force became zero; touching and may stay
    bool approaches = false,
         is_ambiguous = false,  ///< an impact happens; its contacts close in an order that is rounding
        ends_together = false;  ///< (4) of Flights: it is the last one of all that touch
    ContactLaws::Decision impact;
  };

  bool check_roots(double t, const Roots& found, Solution& solution) const;
  void finish_slip(double& t, const Roots& found, Instant& instant, Solution& solution);
  void find_touching(double t, const Roots& found, Instant& instant, const Solution& solution);
  std::vector<char> last_impacts(const Instant& instant, const Solution& solution);
  bool end_together(const Instant& instant, const Solution& solution);
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
  ContactDynamics& dynamics_;
  Slips& slips_;
  Flights& flights_;
  SmoothMotion& motion_;
  std::vector<ContactMode> modes_;  // of the dynamics, and while it decides those that they will be
};

}  // namespace ricochet::reference
