#pragma once

#include <functional>
#include <span>
#include <vector>

#include "methods/contact_laws/impact_sequence.h"
#include "problems/solution.h"

namespace ricochet {

/// The events of groups of contacts at an instant.
struct GroupInstant {
  CapturedGroup capture{};      ///< without its time; no contacts: none
  std::vector<int> wedge{};     ///< contacts of a wedge that is left open
  std::vector<int> refused{};   ///< contacts of groups that are not at rest,
  std::vector<double> rates{};  ///< and their normal velocities after the impacts [m/s]
};

/// Closes a group of contacts that is at rest by (1)-(4) of group_rest.h, at the left end of a step or element, after
/// the impacts of that instant.
///
/// A group without friction is closed as soon as (1) holds. With friction, the bounces of a contact are followed until 16
/// of them in turn were slow in the sense of (1): their impulses turn its slip. Rules for single contacts, which are exact
/// up to rounding, may end an accumulation before. Contacts that the impacts have left, and those that have sunk, need no
/// more bounces.
///
/// A group that is not at rest is refused, and its contacts may sink: such an open contact closes where
/// find_sunk_closing() says. GroupRest::is_too_low() ends the run.
class GroupCapture {
 public:
  /// Moves (q, v) to where the closed contacts have neither gaps nor rates, and sticking ones no slip. False when that
  /// fails. @param modes  n_c
  using Move = std::function<bool(std::span<const ContactMode> modes, Vector& q, Vector& v)>;

  /// All references must outlive this object. @param law  prepared by its owner for impacts.candidates()
  GroupCapture(const Problem& problem, const ContactScales& scales, ImpactSolver& law, ImpactSequence& impacts,
               Move move);
  /// Starts a new run: no contact has bounced.
  void restart();

  /// The cause of the instant.
  struct Closing {
    int contact = -1;  ///< whose gap has closed; -1: none
    bool has_sunk = false;
    bool at_once = false;  ///< however few bounces were followed
  };
  /// After ImpactSequence::apply_impacts(), which some contact was struck by or that has closed.
  /// @param before  modes before this instant, or null; @param v_minus  before the impacts
  /// @param touching  in and out: the contacts of the group are added
  /// @param q, v  in and out; after the impacts
  /// @return whether the group is at rest now; else nothing is moved
  bool apply(const Closing& cause, const std::vector<ContactMode>* before, const Vector& v_minus,
             std::vector<int>& touching, Vector& q, Vector& v);
  /// Call after an apply() that closed nothing. Moves q to where touching contacts that have sunk by more than half a height
  /// have no gap, if their gaps explain that (group_rest.h (3)). Otherwise they would sink by one height more at each
  /// bounce. The velocity stays. @return whether q has moved
  bool raise_sunk(const std::vector<int>& touching, Vector& q, Vector& v);
  /// Counts the bounce of the last apply(), whose step is accepted.
  void accept();

  /// Takes out of the contacts that their forces would close those of a wedge. False where there is none.
  bool leave_wedge(std::vector<ImpactSolver::ClosedContact>& closed, const Vector& lambda_n);

  /// Contacts that may sink since the last begin().
  const std::vector<int>& refused() const { return refused_; }
  /// The events since the last begin(); the runs record them (group_record.h).
  const GroupInstant& instant() const { return instant_; }
  /// After the other contacts are closed: adds those that the impacts have left to refused(). @param v  there
  void add_left(const Vector& v);
  /// Before an instant.
  void begin();

 private:
  bool is_slow(int contact, const Eigen::Ref<const Vector>& v) const;
  bool flies(int contact, const std::vector<int>& touching, const Vector& v) const;
  bool find_group(const std::vector<int>& touching, const Vector& q, const Vector& v);
  bool is_followed_enough(const Closing& cause, const Vector& v_minus);
  bool close(const std::vector<ContactMode>* before, std::vector<int>& touching, Vector& q, Vector& v);
  void leave_unsteady(const Closing& cause, const Vector& v_minus);
  bool drop_high_bounces(const Vector& q, const Vector& v);
  bool move_to_rest(const std::vector<ContactMode>* before, Vector& q, Vector& v);
  bool add_approaching(const Vector& v);
  void refuse_wedge(const std::vector<int>& wedge);
  CapturedGroup removed() const;

  const ProblemInfo& info_;
  const ContactScales& scales_;
  ImpactSolver& law_;
  ImpactSequence& impacts_;
  Move move_;
  std::vector<int> group_, refused_;
  GroupInstant instant_;
  double low_speed_ = 0;  // of group_
  std::vector<ContactMode> held_;
  std::vector<int> low_bounces_;    // n_c
  int counted_ = -1, bounces_ = 0;  // of the last apply()
  std::vector<ImpactSolver::ClosedContact> closed_;
  Vector lambda_n_, lambda_t_;
  Vector q_before_, v_before_;  // the group
};

}  // namespace ricochet
