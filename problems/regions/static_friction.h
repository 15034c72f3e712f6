#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// A run of a scene whose contacts have a larger coefficient of friction while they stick, Problem (10): piece by piece,
/// each of which has one coefficient per contact, as a problem that any method solves.
///
/// A contact that sticks has mu_static, any other one has mu. A piece ends at the first event after which a mode is not
/// the one of its coefficient:
///
/// (a) A contact that sticks breaks loose at |lambda_t| = mu_static lambda_n. The next piece has mu, so that it slips
///     against -mu lambda_n.
/// (b) A contact whose slip velocity becomes zero sticks if forces |lambda_t| <= mu_static lambda_n suffice: the next
///     piece begins with mu_static. If it does not begin with sticking, it is replaced by one with mu, in which the
///     contact slips.
/// (c) Impulses obey ||Lambda_t|| <= mu Lambda_n, also at contacts that stuck before: an impact that gives one of these an
///     impulse happens in a piece in which every contact has mu. After it, (b) decides where the slip velocity is zero.
/// (d) At the start, (b) decides at closed contacts whose slip velocity is zero.
///
/// So a contact at rest sticks where forces between mu lambda_n and mu_static lambda_n hold it, though slip would be
/// another motion. If several contacts with v_t = 0 do not stick, each takes mu in turn, until the modes of all are those
/// of their coefficients. A run ends with Status::infeasible and the name of a contact if there is no end of that, as
/// where friction changes again and again at one instant.
///
/// The forces of a contact that sticks must be unique: where contacts share them, as the two feet of a box do, no bound
/// tells which of them breaks loose, and the run ends with Status::infeasible and the name of the contact.
///
/// A contact that closes without an impulse, and sticks, is no event; its coefficient changes after that step.
///
/// Source: Leine, Nijmeijer, *Dynamics and Bifurcations of Non-Smooth Mechanical Systems* (2004), section 3.2, for the
/// switch model of stick and slip; for impulses, Coulomb's law with the coefficient of slip, as in Drake.
class StaticFrictionRun {
 public:
  /// Which contacts have mu_static, n_c.
  using Sticks = std::vector<char>;
  /// Runs the problem `here`, that of `sticks`, in a number of steps if they are of fixed length, until its end time. It
  /// may go on after `ends` holds.
  using RunPiece = std::function<Solution(const Problem& here, const Sticks& sticks, int steps, const EndsRun& ends)>;

  /// The `problem` must outlive this object.
  StaticFrictionRun(const Problem& problem, RunPiece run_piece);
  ~StaticFrictionRun();
  StaticFrictionRun(const StaticFrictionRun&) = delete;
  StaticFrictionRun& operator=(const StaticFrictionRun&) = delete;

  /// The run from the initial state of the problem. @param steps  of fixed length; 0: of any length
  Solution solve(int steps);

 private:
  /// Where a piece contradicts its coefficients.
  struct Change {
    enum class Kind : std::uint8_t {
      at_start,       ///< the mode of a contact at the begin of the piece
      at_event,       ///< the modes after an event
      before_impact,  ///< an impact, which belongs to the next piece
      no_impact,      ///< that impact is too slow to be one at a start: (d) decides
    };
    Kind kind;
    int contact;
    std::size_t event = 0;  ///< number in Solution::events, of at_event and before_impact
  };

  std::optional<Change> first_change(const Solution& piece, std::size_t from = 0) const;
  std::optional<Change> change_at_start(const Solution& piece) const;
  std::optional<Change> change_at(const Solution& piece, std::size_t k) const;
  bool fits(int i, ContactMode mode) const {
    return (sticks_[static_cast<std::size_t>(i)] != 0) == (mode == ContactMode::stick);
  }
  bool stands_still(int i, const Vector& q, const Vector& v) const;
  bool is_closed_at(int i, const Vector& q, const Vector& v) const;
  int undetermined_contact() const;
  bool comes_to_rest(int i, const Event& event) const;
  void take_coefficients_at_rest(const Vector& q, const Vector& v);
  void take_coefficients(const Event& event);
  void end_piece_at(const Change& change, Solution& piece);
  void take_coefficients_at_end();
  bool is_endless(int contact);
  bool fail(int contact, const char* why);
  Problem& at(const Sticks& sticks);

  const Problem& problem_;
  const RunPiece run_piece_;
  std::map<Sticks, std::unique_ptr<Problem>> made_;

  // Of the present run.
  Solution total_;
  Sticks sticks_;
  std::vector<ContactMode> modes_;      // at the end of total_
  std::vector<ContactMode> end_modes_;  // at the end of a piece that ended without an event
  bool expects_impact_ = false;         // with which the next piece begins
  int changes_ = 0;                     // at the same time
  double last_change_ = -1;             // [s]
};

}  // namespace ricochet
