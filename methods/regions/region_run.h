#pragma once

#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "methods/method.h"
#include "problems/regions/region_problems.h"

namespace ricochet {

/// A run of a scene whose formulas bend or jump (problems/regions/switching_functions.h), region by region. A method
/// sees one smooth region at a time, and ends its run where a step leaves it (RegionBorder). Then:
///
/// (a) The border is located by runs of the method itself from the begin of that step: the length h with
///
///         psi_k(x(t + h)) = 0                                                                                     (1)
///
///     by the secant method within a bracket. So the state there has the order of the method, and FESD-J has an element
///     that ends at the switch.
/// (b) Zeros of functions of the time alone are computed before the run, and runs end there.
/// (c) At a border sigma_k changes, and the next run begins with the state there: contacts whose gap has a corner open,
///     close or are hit as at any start. If an impact makes psi_k jump, the region changes with it.
/// (d) ProblemInfo::until is such a function, at whose border the run ends. A zero at the start is none.
/// (e) Where both sides of psi_k = 0 lead back, the motion slides on it. That is one more region (sliding.h), which the
///     motion leaves to the side that leads away. A run ends with a status that names psi_k and the reason if that
///     region has no formulas, or if a contact that acts on psi_k is closed. An impact of such a contact ends sliding. The rate of psi_k is zero where the
///     motion leaves. If the first step from there ends on the wrong side, because psi_k = O(h^2) is less than the error
///     of the method, the motion slides for that step, too, which adds an error of that size.
///
/// Derivatives S of x = (q, v) with respect to Settings::sensitivities are chained: those of each run, with respect to
/// its start and the parameters, times those of its start. Where the acceleration jumps at a border (all contacts
/// open),
///
///         S+ = S- + (x'- - x'+) d tau,   d tau = -(d psi_k/dx S- + d psi_k/dp) / (d psi_k/dt)                     (2)
///
/// Derivatives of a run that ends at ProblemInfo::until = psi_k, with all contacts open, are those of the end:
///
///         S = S- + x' d tau                                                                                       (3)
///
/// A fixed-step method keeps its grid: the step with a border is divided there.
class RegionRun {
 public:
  /// Solves a problem of one region: a new Solver of the method.
  using Prepare = std::function<std::unique_ptr<Solver>(const Problem&)>;

  RegionRun(const Problem& problem, bool is_adaptive, Prepare prepare);

  /// As Solver::solve().
  Solution solve(const Settings& settings);

 private:
  void begin();
  Solution run(double length, int steps, bool stays);
  void take(Solution&& piece);
  double next_time_switch() const;
  bool locate(const RegionExit& exit);
  bool comes_back(const RegionExit& exit);
  bool slide_on(const RegionExit& exit);
  bool go_to_event(const ActingContact& at, double length, int steps);
  bool cross(int k, bool by_impact = false);
  bool slides(int k);
  bool change(int k, int sign);
  void slide_at_start();
  void begin_sensitivities();
  void chain(Solution& piece);
  Eigen::RowVectorXd border_variation(int k, const Problem& here, const Vector& a) const;
  bool vary_border(int k, const Problem& before, const Problem& after);
  bool end_at_until();
  bool stop(Status status, const std::string& message);
  std::vector<int> signs_at(const Vector& q, const Vector& v) const;
  std::vector<int> signs_of_time() const;

  const Problem& problem_;
  const bool is_adaptive_;
  const Prepare prepare_;
  RegionProblems regions_;
  std::map<std::vector<int>, std::unique_ptr<Solver>> solvers_;  // of regions_

  // Of the present run.
  Settings settings_;
  Solution total_;                  // up to the present state
  std::vector<int> signs_;          // 0: slides
  std::vector<ContactMode> modes_;  // at the end of the last piece; empty if the method has no modes
  Matrix of_start_;                 // 2 n_q x n_theta: what the formulas of the initial state depend on parameters
  Matrix S_;                        // 2 n_q x n_theta
  Matrix of_parameters_;            // varied parameters x n_theta, zeros and ones
  std::vector<std::string> piece_variables_;  // of the runs of pieces: q0, v0, the varied parameters
  double T_ = 0, last_crossing_ = -1;
  int crossings_ = 0;  // at the same time
  int left_ = -1;      // the function on which the motion slid until left_at_ [s]
  double left_at_ = -1;
  std::string why_not_;     // a motion that slides is not followed
  bool has_ended_ = false;  // (d), or by Settings::ends
};

}  // namespace ricochet
