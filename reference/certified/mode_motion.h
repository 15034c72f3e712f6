#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "reference/certified/ball_matrix.h"
#include "reference/certified/scene_formulas.h"

/// @file
/// ModeMotion: accelerations, forces and event functions of one combination of contact modes.

namespace ricochet::reference::certified {

/// Mode of a contact.
enum class Mode {
  open,        ///< no force
  closed,      ///< touches, without friction
  stick,       ///< does not slip
  slip_plus,   ///< planar, v_t >= 0
  slip_minus,  ///< planar, v_t <= 0
  slip         ///< in space, v_t != 0
};
/// As in reference/data: open, closed, stick, slip+, slip-, slip.
const char* name_of(Mode mode);
/// The modes of all contacts as texts.
std::vector<std::string> names_of(const std::vector<Mode>& modes);

/// Sign of the slip velocity in a mode: 1 in slip+ and in slip in space, -1 in slip-, otherwise 0.
int slip_sign_of(Mode mode);

/// Kinds of events of a smooth motion.
enum class EventKind {
  impact,    ///< an open gap closes
  detach,    ///< a normal force vanishes
  slip_end,  ///< a slip velocity vanishes
  cone,      ///< a sticking force reaches the friction cone
  border     ///< the motion reaches a border of its region
};

/// A function that is positive until its event.
struct EventFunction {
  Node node = -1;
  EventKind kind = EventKind::impact;
  int contact = -1;            ///< of all kinds but border
  int side = 1;                ///< cone: sign of lambda_t
  std::vector<int> with = {};  ///< slip_end: other contacts with the same slip velocity
  int border = -1;             ///< border: index in SceneFormulas::borders
};

/// An unknown of the equations: a contact, and a tangent direction or -1 for the normal.
using Unknown = std::pair<int, int>;
/// Unknowns that are left out together with their rows, and the constant forces that they have [N].
using LeftOut = std::map<Unknown, double>;

/// How slip in space begins from rest: v_t = s t^order d + ..., s > 0, |d| = 1.
struct SlipOnset {
  std::array<Ball, 2> d;
  int order = 1;  ///< 2 where sticking ends at the limit of friction
};

/// Slip in space that begins, in the direction d + y e, where e is d turned by a right angle (slip_start_in_space.cpp).
struct SlipStart {
  SlipOnset onset;
  Node y = -1;        ///< variable, 0 at the beginning
  Node S = -1;        ///< d . v_t
  Node E = -1;        ///< (e - y d) . dv_t/dt
  Node F = -1;        ///< dE/dy
  Node turn = -1;     ///< variable, the derivative of the polynomial of y
  Node product = -1;  ///< S turn
};

/// The smooth motion while the modes do not change. The forces follow from the equations of index 1
///
///     M a - sum_j c_j lambda_j = f                                                                              (1)
///     d/dt v_n = 0 of every contact that is closed, with the column c = J_n, or J_n -+ mu J_t while it slips      (2)
///     d/dt v_t = 0 of every contact that sticks, with the column c = J_t                                          (3)
///
/// which are eliminated symbolically. Gaps and rates that are zero at the beginning stay zero. Of redundant contacts,
/// some unknowns are left out together with their rows: their forces are constant, mostly zero.
///
/// Rows whose entries are zero by their formulas outside of some coordinates S, and which have full rank there, keep
/// v_S = 0 as long as the modes last. If then a row of a normal has two entries left, which are opposite by their
/// formulas, v_k = v_l of its coordinates. Slip velocities are taken with these equations, so that equal ones are one
/// formula.
struct ModeMotion {
  std::vector<Node> acceleration;             ///< n
  std::map<int, Node> normal_force;           ///< of contacts that are closed [N]
  std::map<int, std::vector<Node>> friction;  ///< of contacts that stick, n_t each [N]
  std::vector<EventFunction> events;          ///< all must stay positive
  std::map<int, SlipStart> starts;            ///< of contacts in space whose slip begins
  std::vector<Node> schedule;                 ///< everything above, with q, v, gaps and slip velocities
};

/// Requires that no friction element is open. While it is closed, its bound is F = lambda_n >= 0, by (2) of
/// problems/derivatives/friction_elements.h. It opens where F < 0, and the scene has no motion from there on.
/// @throws Unsupported with the name of the element
void require_bounds(const SceneFormulas& scene, const std::vector<Mode>& modes);

/// Derives the motion of the `modes`. Pivots are chosen by the current values of the program.
/// @param starting  contacts in space whose slip begins
/// @param left_out  unknowns of redundant contacts
/// @throws Undecided if the equations may be singular, as of redundant contacts
ModeMotion mode_motion(const SceneFormulas& scene, const std::vector<Mode>& modes, SeriesProgram& program,
                       const std::map<int, SlipOnset>& starting = {}, const LeftOut& left_out = {});

/// d/dt of a rate w(q, v, t) without the part with accelerations: sum_k dw/dq_k v_k + dw/dt.
Node bias_of(Node rate, const SceneFormulas& scene, SeriesProgram& program);

/// Equations (1) to (3) at the state in the program, also where they are singular.
struct ModeSystem {
  std::vector<Unknown> unknowns;  ///< after the n accelerations
  BallMatrix A;                   ///< n + unknowns
  std::vector<Ball> b;
};
/// The equations of the `modes`.
ModeSystem mode_system(const SceneFormulas& scene, const std::vector<Mode>& modes, SeriesProgram& program,
                       const LeftOut& left_out);

/// Whether the formulas of gap and slip velocities of a contact do not depend on time: df_c/dt = 0, v_t = J_t' v.
bool is_at_rest_with_its_bodies(const SceneFormulas& scene, int contact, SeriesProgram& program);
/// Coordinates with v = 0 as long as the modes last, by rows of the normals of closed contacts and of sticking. With
/// `by_formulas`, entries outside of them must be zero by their formulas; otherwise at the state.
std::vector<int> locked_by(const SceneFormulas& scene, const std::vector<Mode>& modes, bool by_formulas,
                           SeriesProgram& program);

/// Sets between which no momentum passes through M and the contacts of a list. Labels are coordinates.
struct MomentumGroups {
  std::vector<int> of_coordinate;  ///< n labels
  std::vector<int> of_contact;     ///< in the order of the list; -1 - i of a contact i that pushes nothing
};
/// Groups that are joined by M and by the forces of `contacts`.
MomentumGroups momentum_groups(const SceneFormulas& scene, const std::vector<int>& contacts,
                               const SeriesProgram& program);

/// Splits `contacts` into parts that move independently while all of them may be closed: M and the contacts pass no
/// momentum from one part to another, and no formula of a part contains a variable of another. So the series of a part
/// do not depend on the modes of the others.
std::vector<std::vector<int>> independent_parts(const SceneFormulas& scene, const std::vector<int>& contacts,
                                                const SeriesProgram& program);

/// Coordinates that exchange momentum with one of the `contacts`, ascending.
std::vector<int> pushed_coordinates(const SceneFormulas& scene, const std::vector<int>& contacts,
                                    const SeriesProgram& program);

/// `contacts` and all others that are not open.
std::vector<int> with_closed(std::vector<int> contacts, const std::vector<Mode>& modes);
/// Contacts that are closed and exchange momentum with one of `contacts`, which come first.
std::vector<int> coupled_contacts(const SceneFormulas& scene, const std::vector<Mode>& modes,
                                  const std::vector<int>& contacts, const SeriesProgram& program);

}  // namespace ricochet::reference::certified
