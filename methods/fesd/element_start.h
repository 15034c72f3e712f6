#pragma once

#include <memory>
#include <vector>

#include "methods/contact_laws/contacts_after_impact.h"
#include "methods/contact_laws/group_capture.h"
#include "methods/contact_laws/impact_sequence.h"
#include "methods/contact_laws/impact_solver.h"
#include "methods/elements/fesd_step.h"
#include "methods/modes/mode_dynamics.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// A set of alternatives of a start is a number: its bit k takes the k-th, so those from the 32nd on are never taken.
/// All sets of the first kMaxCombined are tried in turn; a later alternative is taken only where the search has a reason
/// to close the bounce it stands for.
inline constexpr std::size_t kMaxAlternatives = 31, kMaxCombined = 4;

/// The left end of an element: touching contacts, predicted modes, and the alternatives to them.
struct ElementStart {
  /// A mode to try when the prediction is refuted.
  struct Alternative {
    int contact = -1;
    ContactMode mode = ContactMode::open, predicted = ContactMode::open;
    double v_n = 0;  ///< of a contact that bounced, after the impact [m/s]
    int facet = 0, predicted_facet = 0;
    ImpactSolver::ClosedContact closed{};  ///< of a contact that bounced: how it would be closed
    bool is_struck = false;                ///< it bounced by an impulse of its own
    bool is_pulled = false;                ///< it has not bounced: the load opens it
    bool bounced() const { return predicted == ContactMode::open; }  ///< or the load opens it
  };
  /// A contact on a polygon that slips normal to an edge, whatever its mode.
  struct OnEdge {
    int contact = -1, edge = -1;
  };

  std::vector<int> touching;
  std::vector<ImpactSolver::ClosedContact>
      closed;  ///< touching contacts that do not separate; the load decides whether they open
  std::vector<Alternative> alternatives;
  unsigned closed_instead = 0;  ///< set of alternatives: the bounces that modes and forces have closed instead
  std::vector<int> from_rest;   ///< contacts that start to slip with zero slip velocity
  std::vector<int> unloaded;    ///< contacts without a load that the load of the next moment opens
  std::vector<OnEdge> on_edge;
  /// n_c: whether an open contact may sink below its surface before it closes (group_capture.h). Empty where none may.
  std::vector<char> sinks;
  int failed_contact = -1;  ///< the contact of a Result other than done
  bool has_forces = false;  ///< acceleration and forces right after the start are known:
  Vector acceleration, lambda_n, lambda_t;
  Vector v_open;  ///< n_q, left end with all bounces open; of tableaus that hold accelerations

  void reserve(const ProblemInfo& info);
};

/// The left end of an element that is being started. The element has its q0, and its column of step.v_minus.
struct LeftEnd {
  FesdStep& step;
  int element;          ///< of the step
  const Element* left;  ///< the element before, or null
  Switch end;           ///< the switch that ended it
  bool within_step;     ///< it belongs to the same step
  ElementStart& start;  ///< out

  Element& stages() const { return step.elements[static_cast<std::size_t>(element)]; }
  auto v_minus() const { return step.v_minus.col(element); }
  const std::vector<ContactMode>* before() const { return left ? &left->modes : nullptr; }
  bool was_closed(int contact) const { return left && is_closed(left->modes[contact]); }
};

/// Impulses and predicted modes at the left end of an element, from the laws of one instant (impact_solver.h).
///
/// A touching contact that approaches takes an impulse, or several (impact_sequence.h). After it, contacts that do not
/// separate and contacts that rested before are closed if the load presses them together, and stick or slip by Coulomb's
/// law for accelerations. On a polygon in place of the friction disc the law selects the vertex or edge that carries the
/// force; if an edge has just been left at one of its vertices, the force stays at that vertex. Bilateral constraints
/// always stay closed. The state alone does not determine two things. Within a step, a contact that rested stays at rest
/// unless its own switch ended the element before or forces jump in its island; at the start of a step only the state is
/// given, and the load decides. And if the force of a sticking contact has just reached the cone, slip begins against that
/// force, with zero acceleration at first. Islands without a part in the start keep their forces and modes.
///
/// A group of contacts that is at rest is closed (group_capture.h), and q0, v0 are moved to where it has no gap and no
/// rate; so are q0, v0 where a contact closes that has sunk. Both in runs that have a capture height (ContactScales).
///
/// Alternatives: a contact that bounced may be closed instead (that is how a ball comes to rest, open question 2 of
/// DIFFERENCES.md), and close_instead() finds the modes of the others under the load then; a contact at the boundary of the
/// cone may stick or slip; if one contact breaks, others that the load leaves without a force may break at the same
/// instant. The load of the next moment decides about a contact without one
/// (ImpactSolver::decide_unloaded); where it does not press either, a contact that rested stays closed, and may break.
class ElementStartSolver {
 public:
  /// @param scales  sizes for rounding errors; read at every call, and velocities and loads are recorded there
  ElementStartSolver(const Problem& problem, const ButcherTableau& tableau, const FrictionPolygon& polygon,
                     ContactScales& scales, Counters& counters);

  /// no_forces, indeterminate: Painleve's paradox, the load fits no mode of ElementStart::failed_contact or more than one;
  /// accumulates: impacts at one instant lose too little of their velocity
  enum class Result : std::uint8_t { done, no_impulse, no_forces, indeterminate, accumulates };

  /// Sets v0, modes and slip_start of the element, its impulses in the step, and the start.
  Result begin(const LeftEnd& at);

  /// Starts a new run. @param captures  whether the scales have a capture height
  void restart(bool captures);
  /// The step that begin() has started last is accepted.
  void accept();
  /// A contact whose gap is too far below zero for a motion (group_capture.h), at the end q of the element that has this
  /// start; -1: none. Only those that may sink get there.
  int sunk(const ElementStart& start, const Vector& q);
  /// The events of groups at the last start that begin() has made.
  const GroupInstant& groups() const { return groups_.instant(); }
  /// Closes groups at rest at the start that is tried next, however few of their bounces were followed: elements for
  /// flights of a few roundings fail. False where that has been tried.
  bool settle();
  /// Lets a contact open and sink at the start that is tried next, until a step is accepted: the load of the instant does
  /// not decide about it, and no element, however short, has it open or closed. False where that is not possible.
  bool let_go(int contact);

  /// Modes and forces of a start that begin() has made, with contacts that bounced closed instead. The alternatives of the
  /// start stay. @param closed_instead  set of alternatives, of contacts that bounced
  Result close_instead(const LeftEnd& at, unsigned closed_instead);

  /// Mode of a closed contact that stays closed whatever the load.
  ContactMode continued_mode(const ImpactSolver::ClosedContact& closed) const;

  /// Continues the modes of the element before without a switch. A contact that bounced and was closed instead may come
  /// back where the tableau has no stage at the right end, and then needs an impulse. False when there is none.
  bool continue_modes(FesdStep& step, int element, ElementStart& start);

  /// Whether the load presses a touching contact together, at the start that begin() has just made.
  bool is_pressed(const Element& element, int contact);

  /// Contact in space whose slip would stop first at constant acceleration, and when [s]. -1 when none does.
  int first_to_stop(const Element& element, double& time);

 private:
  void record_sizes(const LeftEnd& at);
  void set_islands(const LeftEnd& at);
  int island_of(int contact) { return islands_.of(problem_.info().contacts[contact].support.front()); }
  bool force_jumps(int contact);
  void find_kept(const LeftEnd& at);
  void clear(const LeftEnd& at) const;
  void divide_touching(const LeftEnd& at);
  bool has_groups() const { return !sinks_.empty(); }
  unsigned bounces_at_rest(const LeftEnd& at) const;
  double slip_speed(int i, const Element& stages);
  bool goes_on(const LeftEnd& at);
  bool has_sunk(const Switch& end) const;
  bool come_to_rest(const LeftEnd& at);
  bool remove_gaps(const LeftEnd& at);
  bool move_to(std::span<const ContactMode> modes, Vector& q, Vector& v);
  bool is_let_go(int contact) const;
  bool is_above(int contact) const;
  bool still_approaches(const LeftEnd& at, int contact) const;
  bool stands_still(const LeftEnd& at);
  void set_sinking(const LeftEnd& at);
  Result set_modes(const LeftEnd& at, unsigned closed_instead);
  void collect_closed(const LeftEnd& at, unsigned closed_instead);
  Result find_forces(const LeftEnd& at);
  void set_mode(const LeftEnd& at, const ImpactSolver::ClosedContact& closed);
  void offer_break(const LeftEnd& at, const ImpactSolver::ClosedContact& closed, ContactMode mode, bool rested) const;
  void offer_slip_or_stick(const LeftEnd& at, const ImpactSolver::ClosedContact& closed, ContactMode mode) const;
  void keep_forces(const Element& left, ElementStart& start);
  void set_facet(const Element& element, const Switch& end, ImpactSolver::ClosedContact& closed);
  bool is_paradox(const ImpactSolver::ClosedContact& closed) const;

  const Problem& problem_;
  const ButcherTableau& tableau_;
  const FrictionPolygon polygon_;
  ContactScales& scales_;
  ImpactSolver impact_law_;
  ImpactSequence impacts_;
  Counters& counters_;
  std::unique_ptr<ModeDynamics> dynamics_;  // moves groups to rest
  GroupCapture groups_;
  int standstills_ = 0, standstills_next_ = 0;  // elements in turn that move nothing
  std::vector<int> let_go_;
  bool settles_ = false;
  Vector v_minus_, gap_;  // before and at a start
  Vector u_, u_next_;     // control of the last step that was accepted, and of this one
  Vector q_;
  Vector J_t_;                            // packed
  std::vector<char> sinks_, sinks_next_;  // n_c: open contacts that may sink; empty in runs without a capture height
  std::vector<ContactAfterImpact> after_;
  std::vector<ImpactSolver::ClosedContact> closed_;
  DisjointSets coupled_, islands_;   // of coordinates: by M and forces; by touching contacts, too
  std::vector<char> jumps_, keeps_;  // per least coordinate of an island
};

}  // namespace ricochet
