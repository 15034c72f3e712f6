#pragma once

#include <optional>
#include <string>
#include <vector>

#include "reference/certified/friction_in_space.h"
#include "reference/certified/redundant_rows.h"
#include "reference/certified/taylor_step.h"

/// @file
/// Decisions at events: which modes follow, which impulses act. Every alternative is proven or refuted by strict signs.

namespace ricochet::reference::certified {

/// The contacts at one time. A gap or slip velocity that is zero for a reason has leading coefficients that vanish
/// exactly; they are left out of its series.
struct ContactStates {
  std::vector<Mode> modes;              ///< of all contacts
  std::vector<int> vanishing_gap;       ///< leading coefficients of the gap that are zero
  std::vector<int> vanishing_slip;      ///< of the planar slip velocity
  std::map<int, int> vanishing_border;  ///< of the function of a border
  /// The gap is at least what remains without its first coefficient, as after impacts within one time ball. No root may
  /// be looked for in this step.
  std::vector<char> gap_is_bounded_only;
  std::vector<char> sticks_at_limit;  ///< in space: |lambda_t| = mu lambda_n, exactly, if it sticks
  std::map<int, SlipOnset> starting;  ///< contacts in space whose slip begins
  LeftOut left_out;                   ///< forces of redundant contacts that are constant

  explicit ContactStates(int n_c)
      : modes(n_c, Mode::open),
        vanishing_gap(n_c),
        vanishing_slip(n_c),
        gap_is_bounded_only(n_c),
        sticks_at_limit(n_c) {}
  /// Forgets what vanishes, after a step.
  void moved();
};

/// Runs over all combinations of options, for example modes of contacts.
class Combinations {
 public:
  explicit Combinations(std::vector<std::vector<Mode>> options);           ///< @throws Unsupported for too many
  Mode operator[](std::size_t k) const { return options_[k][index_[k]]; }  ///< Option of entry k.
  bool next();                                                             ///< @returns false after the last one

 private:
  std::vector<std::vector<Mode>> options_;
  std::vector<std::size_t> index_;
};

/// Counts alternatives: exactly one must be proven and every other one refuted.
class Verdict {
 public:
  /// @param sign  positive: proven, negative: refuted  @returns whether it is proven
  bool add(Sign sign, const std::string& alternative);
  /// @throws Undecided unless one alternative is proven and all others are refuted
  void require_one(const std::string& what) const;
  bool all_are_refuted() const { return n_proven_ == 0 && n_undecided_ == 0; }  ///< The options are not complete.

 private:
  int n_proven_ = 0, n_undecided_ = 0;
  std::string undecided_;
};

/// The weakest of strict inequalities: positive if all hold, negative if one is violated.
Sign all_of(const std::vector<Sign>& signs);

/// Result of an impact.
struct ImpactOutcome {
  std::vector<Mode> modes;     ///< of the candidates: open (no impulse), closed, stick, slip+, slip-
  std::vector<Ball> velocity;  ///< v+, n
  std::vector<Ball> Lambda_n;  ///< of all contacts [N s]
  std::vector<Ball> rebound;   ///< of the candidates: w+
  std::vector<Ball> slip;      ///< of the candidates in the plane: v_t+
};

/// The contacts of a scene at t = 0 that are closed, or about to be.
struct StartingContacts {
  std::vector<int> hit;                  ///< approach: an impact at the start
  std::vector<int> touching;             ///< v_n = 0
  std::vector<int> slip_sign;            ///< of all contacts, as in Decisions::decide_modes()
  std::vector<std::string> assumptions;  ///< zeros that are not proven

  std::vector<int> candidates() const;      ///< Of the impact: those that are hit come first.
  std::vector<char> closed(int n_c) const;  ///< Of all contacts, before the impact.
};

/// Decides at one state, which is loaded into the program.
class Decisions {
 public:
  Decisions(const SceneFormulas& scene, SeriesProgram& program, TaylorStep& step, const TimeLimit& limit)
      : scene_(scene), p_(program), step_(step), limit_(limit) {}

  /// Modes of the `candidates`, which touch with v_n = 0. With the acceleration of each combination, strictly:
  ///
  ///     open: d2/dt2 gap > 0;   closed: lambda_n > 0;   stick: lambda_n > 0, |lambda_t| < mu lambda_n              (1)
  ///     slip+-: lambda_n > 0, and d/dt v_t > 0 or < 0 where v_t = 0
  ///
  /// In space, slip_directions() decides slip from rest of a contact that exchanges no momentum with others. If it
  /// sticks at the limit of friction, exactly, the derivative of mu^2 lambda_n^2 - |lambda_t|^2 decides, and the second
  /// derivative of the slip velocity that friction at the limit allows.
  /// If a left-hand side is exactly zero, its first derivative that is not zero decides. A combination whose forces
  /// are zero by their formulas has the same motion as the one with these contacts open; both are one alternative.
  /// Contacts that exchange no momentum are decided one group after the other.
  ///
  /// Combinations with redundant rows are refuted by a RedundantRow, or they have the same motion as others. Let C be
  /// the coordinates of a group. Take the rows of closed and of sticking contacts whose formulas do not depend on time
  /// and whose entries outside of S are zero by their formulas. If v_S = 0 now and these rows have full rank on S, they
  /// keep v_S = 0. If two contacts with the same slip velocity slip in opposite directions, their row of slip is one of
  /// these rows. Let T be the rest of C. It contains the coordinates of the normal of a contact whose friction acts on T.
  /// The contacts j that reach T satisfy
  ///
  ///     M_TT a_T - sum_j c_T,j lambda_j = f_T,   d/dt w_j = 0                                                     (3)
  ///
  /// If (3) is regular, S and the modes of these contacts determine the motion; the other contacts keep their gap. T
  /// rests, too, if
  ///
  ///     v_T = 0 and a_T = 0 exactly, and a_T depends on q_C and v_C only                                          (4)
  ///
  /// Combinations with the same motion are one alternative. It is proven if some forces satisfy (1): those of
  /// independent rows, with all other forces constant. These forces stay left out as long as the modes last.
  ///
  /// @param slip_sign  of v_t, of all contacts; 0 where it is exactly zero
  /// @throws Undecided, Unsupported
  void decide_modes(const std::vector<Ball>& x, const Ball& t, const std::vector<int>& candidates,
                    const std::vector<int>& slip_sign, ContactStates& states);

  /// The impact of the `candidates`, by Newton's law with Coulomb's friction for the whole impact, and Moreau's law for
  /// several contacts: w = J_n' v + df_c/dt,
  ///
  ///     0 <= w+ + eps_r w-  _|_  Lambda_n >= 0,   |Lambda_t| <= mu Lambda_n against v_t+                          (2)
  ///
  /// with w- = 0 for those that are `closed` before. A left-hand side that is exactly zero satisfies (2). Combinations
  /// with the same v+ are one outcome: those that differ in contacts whose impulses are exactly zero, and those with
  /// v+ = 0 because of the rows of closed and sticking contacts. @throws Undecided, Unsupported
  ImpactOutcome decide_impact(const std::vector<Ball>& x, const Ball& t, const std::vector<int>& candidates,
                              const std::vector<char>& closed);

  // Events (event_decisions.cpp). Each changes the modes and the vanishing coefficients of `states`.

  /// Sorts the contacts at t = 0. The state must be loaded. @throws Unsupported for penetration
  StartingContacts contacts_at_start(ContactStates& states);
  /// An impact of the `candidates`, as decide_impact(), and the modes of those that stay closed. x gets v+.
  ImpactOutcome strike(std::vector<Ball>& x, const Ball& t, const std::vector<int>& candidates,
                       const std::vector<char>& closed, ContactStates& states);
  /// The gaps of the contacts `hit` close at the same time: strike() with the closed contacts that they are coupled
  /// with.
  ImpactOutcome close_gaps(std::vector<Ball>& x, const Ball& t, const std::vector<int>& hit, ContactStates& states);
  /// The normal force of a contact vanishes: it opens.
  void open_contact(const std::vector<Ball>& x, const Ball& t, int contact, ContactStates& states);
  /// The sticking force of `event` reaches the friction cone: the contact slips.
  void begin_slip(const std::vector<Ball>& x, const Ball& t, const EventFunction& event, ContactStates& states);
  /// The slip of a contact vanishes, and that of all contacts with the same slip velocity.
  /// @returns the kind of event: slip_to_stick, slip_reversal or slip_end
  std::string end_slip(const std::vector<Ball>& x, const Ball& t, const EventFunction& event, ContactStates& states);

  // Zeros of the state that contacts imply (exact_zeros.cpp).

  /// Contacts at a state: those that touch, those with v_n = 0, and those with v_t = 0.
  struct ContactZeros {
    std::vector<int> touching, resting, sticking;
  };
  /// Narrows `x` to what contacts imply. With g(x) = 0 for the gaps that touch, and J = dg/dq, coordinates S are zero if
  ///
  ///     J = 0 outside of S, of full rank on S, for all members of x, and g = 0 exactly with q_S = 0              (5)
  ///
  /// since 0 = g(q) - g(q with q_S = 0) = J~ q_S by the mean value theorem, where J~ is a member of the balls of J.
  /// Velocities are zero where rows with J' v = 0 lock them. @param x  2n
  void narrow(std::vector<Ball>& x, const Ball& t, const ContactZeros& zeros);
  /// The zeros of the contacts that are closed.
  ContactZeros zeros_of(const ContactStates& states) const;

  /// Sticking contacts in space that are coupled with others: slip in any direction is not refuted for them.
  const std::vector<int>& sticking_in_space() const { return sticking_in_space_; }

 private:
  void require_determined_forces(int contact, const ContactStates& states) const;
  std::vector<Mode> mode_options(int contact, int slip_sign) const;
  Sign check_modes(const std::vector<int>& candidates, const std::vector<int>& slip_sign,
                   const std::vector<char>& sticks_at_limit, const ModeMotion& motion, int order, bool first_only);
  /// Modes that are proven or undecided, and contacts without friction whose force is zero by its formula.
  struct ModeAlternative {
    Sign sign = Sign::unknown;
    std::vector<Mode> modes;
    std::map<int, SlipOnset> starting;
    LeftOut left_out;
    std::vector<int> idle;
    std::vector<int> kept;        ///< S, ascending
    std::vector<Mode> reaching;   ///< the modes of candidates that reach T, others as open
    bool has_one_motion = false;  ///< S and `reaching` determine it
    std::string name;
  };
  /// Slip that begins at a contact in space.
  struct SlipFromRest {
    bool is_complete = false;  ///< no other slip satisfies the law
    std::optional<SlipOnset> onset;
  };
  /// Contacts that exchange momentum, about which one decision is made.
  struct Group {
    std::vector<int> candidates;
    std::vector<int> pushed;   ///< coordinates C
    std::vector<int> resting;  ///< those of C with v = 0 exactly
    bool is_single = false;    ///< one contact, closed ones that are no candidates included
  };
  std::vector<Group> groups_of(const std::vector<Ball>& x, const Ball& t, const std::vector<int>& candidates,
                               const ContactStates& states);
  void decide_group(const std::vector<Ball>& x, const Ball& t, const Group& group, const std::vector<int>& slip_sign,
                    ContactStates& states);
  void check_alternative(const std::vector<Ball>& x, const Ball& t, const Group& group,
                         const std::vector<int>& slip_sign, const std::vector<char>& sticks_at_limit,
                         ModeAlternative& alternative);
  // redundant_contacts.cpp
  bool depends_on_others(const ModeMotion& motion, const Group& group, bool with_time) const;
  bool is_refuted(const Group& group, const std::vector<int>& slip_sign, const ModeAlternative& alternative);
  std::vector<int> kept_at_rest(const Group& group, const std::vector<Mode>& modes);
  void set_reaching(const Group& group, const std::vector<int>& slip_sign, ModeAlternative& alternative);
  bool has_no_acceleration(const ModeMotion& motion, const Group& group, const std::vector<int>& kept);
  /// Unknowns, those of sticking first, and inequalities (1) as forms of accelerations and forces.
  std::vector<LinearForm> inequalities(const Group& group, const std::vector<int>& slip_sign,
                                       const std::vector<Mode>& modes, const ModeSystem& system,
                                       std::vector<std::size_t>& order);
  bool satisfies(const std::vector<Ball>& x, const Ball& t, const Group& group, const std::vector<int>& slip_sign,
                 const ModeAlternative& alternative, const std::vector<Mode>& with_rows);
  bool find_forces(const std::vector<Ball>& x, const Ball& t, const Group& group, const std::vector<int>& slip_sign,
                   ModeAlternative& alternative);
  static bool has_same_motion_kept(const ModeAlternative& one, const ModeAlternative& other);
  static bool has_same_motion(const ModeAlternative& open, const ModeAlternative& proven);
  std::string names(const std::vector<int>& candidates, const Combinations& combination) const;
  SlipOnset onset_at_limit(const std::vector<Ball>& x, const Ball& t, int contact, const std::vector<Mode>& modes);
  void begin_slip_in_space(const std::vector<Ball>& x, const Ball& t, int contact, ContactStates& states);
  SlipFromRest slip_from_rest(const std::vector<Ball>& x, const Ball& t, int contact, bool sticks_at_limit);

  const SceneFormulas& scene_;
  SeriesProgram& p_;
  TaylorStep& step_;
  const TimeLimit& limit_;
  std::vector<int> sticking_in_space_;
};

}  // namespace ricochet::reference::certified
