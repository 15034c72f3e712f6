#pragma once

#include <string>
#include <vector>

#include "methods/linear_algebra/block_inverse.h"
#include "methods/method.h"
#include "methods/time_stepping/common/contact_step.h"

namespace ricochet {

/// A state with the modes of its contacts.
struct MoreauState {
  Vector q, v;
  std::vector<ContactMode> modes;
  Vector depth;   ///< n_c, <= 0: gap at which an open contact acts [m]
  Vector flight;  ///< n_c, time since the last impulse [s]

  explicit MoreauState(const ProblemInfo& info)
      : q(info.q0),
        v(info.v0),
        modes(info.n_c(), ContactMode::open),
        depth(Vector::Zero(info.n_c())),
        flight(Vector::Constant(info.n_c(), info.end_time)) {}
};

/// A step of Moreau's midpoint rule, of length h,
///
///   q_m = q + h/2 v                                                                          (1)
///   M(q_m) (v+ - v) = h f(q_m, v) + J_n Lambda_n + J_t Lambda_t,   J_n, J_t at q_m           (2)
///   0 <= Lambda_n  _|_  J_n' (v+ + eps_r v) >= 0,   Coulomb's law for Lambda_t and J_t' v+   (3)
///   q+ = q_m + h/2 v+                                                                        (4)
///
/// for contacts with f_c(q_m) <= 0 and those that were closed before. It has order 1. (3) has the rates at q_m, or those
/// at q+ by
///
///   J_n' v+ + h/2 v' (grad^2 f_c) v   and   J_t' v+ + h/2 T v,   T: derivative of J_t' v with respect to q      (5)
///
/// in place of J_n' v+ and J_t' v+.
///
/// Modes are decided by velocities, so that forces of redundant contacts need not be unique. A contact that bounces
/// changes its mode. A contact that opens may still penetrate, by drift or by the motion within a step: until its gap
/// reaches zero, it acts again only if it penetrates deeper. If flights last only a few of the least steps, bouncing
/// ends and the contact rests.
class MoreauMidpoint {
 public:
  enum class Rates { in_middle, at_end };  ///< (3), or with (5)

  /// @param counters  outlives this; @param shortest  the least length of a step [s]
  MoreauMidpoint(const Problem& problem, const Settings& settings, const ContactSolverOptions& solver,
                 ContactObserver* observer, Counters& counters, double shortest);

  /// (1)-(4). @return false with reason()
  bool step(double h, Rates rates, const MoreauState& from, MoreauState& to);

  bool is_affine() const { return is_affine_; }  ///< No direction of a contact depends on q.
  // Results of the last step:
  /// A contact was active or bilateral; otherwise the impulses below are those of an earlier step.
  bool has_contacts() const { return !active_.empty() || info_.has_bilateral(); }
  const Vector& gap() const { return gap_; }                          ///< n_c, at q_m [m]
  bool strikes(int contact) const { return strikes_[contact] != 0; }  ///< An open contact closed with an impulse.
  bool bounces() const { return bounces_; }                           ///< A contact bounced.
  const Vector& Lambda_n() const { return contacts_.Lambda_n(); }     ///< n_c
  const Vector& Lambda_t() const { return contacts_.Lambda_t(); }     ///< n_lambda_t
  const std::string& reason() const { return reason_; }
  double residual() const { return residual_; }  ///< Of (3), with Settings::audit.

 private:
  void set_mass();
  void find_active(const MoreauState& from, MoreauState& to);
  bool solve_contacts(double h, Rates rates, const MoreauState& from, MoreauState& to);
  void set_turns(double h, const Vector& v);
  ContactMode mode_of(int contact, double still) const;

  const Problem& problem_;
  const ProblemInfo& info_;
  const Settings& settings_;
  Counters& counters_;
  const double shortest_;
  ContactStep contacts_;
  const Vector touching_;
  const bool is_affine_;
  const double rest_, tie_;
  Matrix M_, T_;
  BlockInverse W_;
  Vector q_m_, f_, Wf_, gap_, shift_, turn_, slip_, slip_turn_;
  std::vector<int> active_;
  std::vector<char> strikes_;
  bool bounces_ = false;
  double residual_ = 0;
  std::string reason_;
};

}  // namespace ricochet
