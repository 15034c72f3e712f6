#pragma once

#include <optional>
#include <string>
#include <vector>

#include "reference/certified/friction_in_space.h"
#include "reference/certified/taylor_step.h"

/// @file
/// Decisions at events: which modes follow, which impulses act. Every alternative is proven or refuted by strict signs.

namespace ricochet::reference::certified {

/// The contacts at one time. A gap or slip velocity that is zero for a reason has leading coefficients that vanish
/// exactly; they are left out of its series.
struct ContactStates {
  std::vector<Mode> modes;          ///< of all contacts
  std::vector<int> vanishing_gap;   ///< leading coefficients of the gap that are zero
  std::vector<int> vanishing_slip;  ///< of the planar slip velocity
  /// The gap is at least what remains without its first coefficient, as after impacts within one time ball. No root may
  /// be looked for in this step.
  std::vector<char> gap_is_bounded_only;
  std::vector<char> sticks_at_limit;  ///< in space: |lambda_t| = mu lambda_n, exactly, if it sticks
  std::map<int, SlipOnset> starting;  ///< contacts in space whose slip begins

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
  /// with w- = 0 for those that are `closed` before. @throws Undecided, Unsupported
  ImpactOutcome decide_impact(const std::vector<Ball>& x, const Ball& t, const std::vector<int>& candidates,
                              const std::vector<char>& closed);

  // Events (event_decisions.cpp). Each changes the modes and the vanishing coefficients of `states`.

  /// Sorts the contacts at t = 0. The state must be loaded. @throws Unsupported for penetration
  StartingContacts contacts_at_start(ContactStates& states);
  /// An impact of the `candidates`, as decide_impact(), and the modes of those that stay closed. x gets v+.
  ImpactOutcome strike(std::vector<Ball>& x, const Ball& t, const std::vector<int>& candidates,
                       const std::vector<char>& closed, ContactStates& states);
  /// The gap of a contact closes: strike() with the closed contacts that it is coupled with.
  ImpactOutcome close_gap(std::vector<Ball>& x, const Ball& t, int contact, ContactStates& states);
  /// The normal force of a contact vanishes: it opens.
  void open_contact(const std::vector<Ball>& x, const Ball& t, int contact, ContactStates& states);
  /// The sticking force of `event` reaches the friction cone: the contact slips.
  void begin_slip(const std::vector<Ball>& x, const Ball& t, const EventFunction& event, ContactStates& states);
  /// The slip of a contact vanishes. @returns the kind of event: slip_to_stick, slip_reversal or slip_end
  std::string end_slip(const std::vector<Ball>& x, const Ball& t, int contact, ContactStates& states);

  /// Sticking contacts in space that are coupled with others: slip in any direction is not refuted for them.
  const std::vector<int>& sticking_in_space() const { return sticking_in_space_; }

 private:
  std::vector<Mode> mode_options(int contact, int slip_sign) const;
  Sign check_modes(const std::vector<int>& candidates, const std::vector<int>& slip_sign,
                   const std::vector<char>& sticks_at_limit, const ModeMotion& motion, int order);
  /// Modes that are proven or undecided, and contacts without friction whose force is zero by its formula.
  struct ModeAlternative {
    Sign sign = Sign::unknown;
    std::vector<Mode> modes;
    std::map<int, SlipOnset> starting;
    std::vector<int> idle;
    std::string name;
  };
  void check_alternative(const std::vector<Ball>& x, const Ball& t, const std::vector<int>& candidates,
                         const std::vector<int>& slip_sign, const std::vector<char>& sticks_at_limit,
                         ModeAlternative& alternative);
  static bool has_same_motion(const ModeAlternative& open, const ModeAlternative& proven);
  std::string names(const std::vector<int>& candidates, const Combinations& combination) const;
  SlipOnset onset_at_limit(const std::vector<Ball>& x, const Ball& t, int contact, const std::vector<Mode>& modes);
  void begin_slip_in_space(const std::vector<Ball>& x, const Ball& t, int contact, ContactStates& states);
  /// Slip that begins at a contact in space.
  struct SlipFromRest {
    bool is_complete = false;  ///< no other slip satisfies the law
    std::optional<SlipOnset> onset;
  };
  std::map<int, SlipFromRest> slips_from_rest(const std::vector<Ball>& x, const Ball& t,
                                              const std::vector<int>& candidates, const std::vector<int>& slip_sign,
                                              const ContactStates& states);

  const SceneFormulas& scene_;
  SeriesProgram& p_;
  TaylorStep& step_;
  const TimeLimit& limit_;
  std::vector<int> sticking_in_space_;
};

}  // namespace ricochet::reference::certified
