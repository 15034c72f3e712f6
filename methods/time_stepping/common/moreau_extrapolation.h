#pragma once

#include <array>

#include "methods/time_stepping/common/branch_watch.h"
#include "methods/time_stepping/common/extrapolation_table.h"
#include "methods/time_stepping/common/moreau_midpoint.h"

namespace ricochet {

/// Extrapolated steps of Moreau's midpoint rule, (1)-(4) of moreau_midpoint.h. While no contact changes its mode (open,
/// closed, stick, slip) it is a smooth map with an expansion of its error in powers of h, so that j steps of length h/j are
/// extrapolated by (1) of extrapolation_table.h.
///
/// The substeps check contacts at q_m, and no q_m is the end of the step: a single step of the least length from there
/// checks that the modes are still the same. For curved contacts the rates at q_m leave errors of J_n' v and J_t' v at
/// q+, since the directions turn within h/2. The extrapolation removes them; single steps do so by (5) of
/// moreau_midpoint.h, so that a step of another length may follow. With (5) alone the extrapolation would gain little:
/// the rule is a leapfrog method, the first errors of which are small.
///
/// Source: Studer, Leine, Glocker, IJNME 76 (2008) 1747-1781.
class MoreauExtrapolation {
 public:
  static constexpr int kMaxRows = ExtrapolationTable::kMaxRows;
  using State = MoreauState;

  enum class Outcome { reached, switches, inaccurate, failed };

  /// Arguments as of MoreauMidpoint.
  MoreauExtrapolation(const Problem& problem, const Settings& settings, const ContactSolverOptions& solver,
                      ContactObserver* observer, Counters& counters, double shortest);

  /// Makes an extrapolated step from `state`, which is replaced on success, with rows until T_{j,j} - T_{j,j-1} is
  /// within the tolerance.
  /// @param rows       the last row where the tolerance is 0
  /// @param tolerance  relative, and absolute in SI units; 0: all rows, none is inaccurate
  /// @return switches when a contact changes its mode, or a formula its branch, in a substep; failed with reason()
  Outcome step(double h, int rows, double tolerance, State& state);
  /// Errors of the last step(): error(j) of T_{j,j-1} in parts of the tolerance, for j = 2 .. rows_used().
  double error(int row) const { return errors_[row]; }
  int rows_used() const { return table_.rows(); }

  /// A single step from `state`, which is replaced, whatever modes become. @return false with reason()
  bool single_step(double h, State& state);

  /// The switching function whose sign is another one at the second state; -1 if there is none.
  int changed_branch(const State& from, const State& to);

  bool is_affine() const { return midpoint_.is_affine(); }  ///< No direction of a contact depends on q.
  /// An open contact closed in the last substep, with an impulse.
  bool strikes(int contact) const { return midpoint_.strikes(contact); }
  bool bounces() const { return midpoint_.bounces(); }             ///< A contact bounced in the last substep.
  const Vector& Lambda_n() const { return midpoint_.Lambda_n(); }  ///< n_c, of the last substep
  const Vector& Lambda_t() const { return midpoint_.Lambda_t(); }  ///< n_lambda_t
  const std::string& reason() const { return midpoint_.reason(); }
  /// Largest residual of (3) in steps that were taken, with Settings::audit.
  double residual() const { return residual_; }

 private:
  using Rates = MoreauMidpoint::Rates;

  bool substep(double h, Rates rates, const State& from);
  bool switches() const { return midpoint_.bounces() || at_.modes != next_.modes; }
  void note_depths(const std::vector<ContactMode>& before, State& state) const;
  double difference(const Vector& x, const Vector& y, const State& at, double tolerance) const;

  const ProblemInfo& info_;
  const double shortest_;
  MoreauMidpoint midpoint_;
  BranchWatch branch_;
  State at_, next_;
  ExtrapolationTable table_;  // of (q, v)
  std::array<double, kMaxRows + 1> errors_{};
  double residual_ = 0, tried_residual_ = 0;
};

}  // namespace ricochet
