#pragma once

#include <array>
#include <vector>

#include "methods/linear_algebra/block_inverse.h"
#include "methods/method.h"
#include "methods/time_stepping/common/contact_step.h"

namespace ricochet {

/// Extrapolated steps of Moreau's midpoint rule. One step of it, of length h,
///
///   q_m = q + h/2 v                                                                          (1)
///   M(q_m) (v+ - v) = h f(q_m, v) + J_n Lambda_n + J_t Lambda_t,   J_n, J_t at q_m           (2)
///   0 <= Lambda_n  _|_  J_n' (v+ + eps_r v) >= 0,   Coulomb's law for Lambda_t and J_t' v+   (3)
///   q+ = q_m + h/2 v+                                                                        (4)
///
/// for contacts with f_c(q_m) <= 0 and those that were closed before, has order 1. While no contact changes its mode
/// (open, closed, stick, slip), (1)-(4) is a smooth map with an expansion of its error in powers of h. The results
/// T_{j,1} of j steps of length h/j are then extrapolated,
///
///   T_{j,i+1} = T_{j,i} + (T_{j,i} - T_{j-1,i}) / (j / (j - i) - 1),   j = 1 .. p            (5)
///
/// (Aitken, Neville): T_{j,j} has order j, and T_{j,j} - T_{j,j-1} is the error of T_{j,j-1}.
///
/// Modes are those of velocities, so that forces of redundant contacts may be any. A contact that bounces switches. The
/// substeps look at q_m, none of which is the end of the step: a single step of the least length from there looks whether
/// the modes are the same, too. (1)-(4) have rates at q_m. Where contacts are curved that leaves J_n' v and J_t' v at q+
/// off by what the directions turn in h/2, which (5) takes out; single steps do by
///
///   J_n' v+ + h/2 v' (grad^2 f_c) v   and   J_t' v+ + h/2 T v,   T: derivative of J_t' v with respect to q      (6)
///
/// in place of J_n' v+ and J_t' v+ in (3), so that a step of another length may follow. With (6) alone (5) would gain
/// little: (1)-(4) are a leapfrog method, the first errors of which are small.
///
/// A contact that opens has a gap that penetrates by its drift, or by what a step is long: until it has a gap of zero, it
/// is a contact again where it penetrates deeper. Bounces whose flights are of a few of the least steps are at an end: the
/// contact rests.
///
/// Source: Studer, Leine, Glocker, IJNME 76 (2008) 1747-1781.
class MoreauExtrapolation {
 public:
  static constexpr int kMaxRows = 8;

  /// A state with the modes of its contacts.
  struct State {
    Vector q, v;
    std::vector<ContactMode> modes;
    Vector depth;   ///< n_c, <= 0: gap at which an open contact acts [m]
    Vector flight;  ///< n_c, time since the last impulse [s]

    explicit State(const ProblemInfo& info)
        : q(info.q0),
          v(info.v0),
          modes(info.n_c(), ContactMode::open),
          depth(Vector::Zero(info.n_c())),
          flight(Vector::Constant(info.n_c(), info.end_time)) {}
  };

  enum class Outcome { reached, switches, inaccurate, failed };

  /// @param counters  outlives this; @param shortest  the least length of a step [s]
  MoreauExtrapolation(const Problem& problem, const Settings& settings, const ContactSolverOptions& solver,
                      ContactObserver* observer, Counters& counters, double shortest);

  /// (5) from `state`, which is replaced when reached, with rows until T_{j,j} - T_{j,j-1} is within the tolerance.
  /// @param rows       p; the last row where the tolerance is 0
  /// @param tolerance  relative, and absolute in SI units; 0: all rows, none is inaccurate
  /// @return switches when a contact changes its mode in a substep; failed with reason()
  Outcome step(double h, int rows, double tolerance, State& state);
  /// Of the last step(): error(j) of T_{j,j-1} in parts of the tolerance, for j = 2 .. rows_used().
  double error(int row) const { return errors_[row]; }
  int rows_used() const { return rows_used_; }

  /// (1)-(4) from `state`, which is replaced, whatever modes become. @return false with reason()
  bool single_step(double h, State& state);

  bool is_affine() const { return is_affine_; }  ///< No direction of a contact depends on q.
  /// An open contact closed in the last substep, with an impulse.
  bool strikes(int contact) const { return strikes_[contact] != 0; }
  bool bounces() const { return bounces_; }                        ///< A contact did, in the last substep.
  const Vector& Lambda_n() const { return contacts_.Lambda_n(); }  ///< n_c, of the last substep
  const Vector& Lambda_t() const { return contacts_.Lambda_t(); }  ///< n_lambda_t
  const std::string& reason() const { return reason_; }
  /// Largest residual of (3) in steps that were taken, with Settings::audit.
  double residual() const { return residual_; }

 private:
  enum class Rates { in_middle, at_end };  // (3), or with (6)

  bool substep(double h, Rates rates, const State& from, State& to);
  bool solve_contacts(double h, Rates rates, const State& from, State& to);
  void set_turns(double h, const Vector& v);
  void note_depths(const std::vector<ContactMode>& before, State& state);
  ContactMode mode_of(int contact, double still) const;
  double difference(const Vector& x, const Vector& y, const State& at, double tolerance) const;

  const Problem& problem_;
  const ProblemInfo& info_;
  const Settings& settings_;
  Counters& counters_;
  const double shortest_;
  ContactStep contacts_;
  const Vector touching_;
  const bool is_affine_;  // no direction of a contact depends on q
  const double rest_, tie_;
  Matrix M_, T_;
  BlockInverse W_;
  Vector q_m_, f_, Wf_, gap_, shift_, turn_, slip_, slip_turn_;
  std::vector<int> active_;
  std::vector<char> strikes_;
  State at_{info_}, next_{info_};
  bool bounces_ = false;                    // in the last substep
  std::array<Vector, kMaxRows + 1> table_;  // (q, v) of T_{j,i}, i = 1 .. j, of the last row; 2 n_q each
  Vector x_, y_;
  std::array<double, kMaxRows + 1> errors_{};
  int rows_used_ = 0;
  double residual_ = 0, tried_residual_ = 0;
  std::string reason_;
};

}  // namespace ricochet
