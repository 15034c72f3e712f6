#pragma once

#include <map>
#include <memory>
#include <vector>

#include "reference/certified/hybrid_motion.h"

/// @file
/// MotionByRegions: a motion whose formulas bend or jump, as one HybridMotion after the other.

namespace ricochet::reference::certified {

/// The formulas of a scene bend or jump on the borders psi_k(q, v, t) = 0 (problems/regions/switching_functions.h). In
/// a region, whose signs are sigma_k, all formulas are smooth, and HybridMotion proves the motion as long as
///
///     sigma_k psi_k > 0   for all k                                                                              (1)
///
/// A scene without such formulas is one region.
///
/// *Borders.* Let only psi_k vanish at the time t* of an event, and let F_1 and F_2 be the accelerations there of the
/// regions before and after it, with the contact forces of their modes. The rate of psi_k,
///
///     R(a) = dpsi_k/dt + dpsi_k/dq v + dpsi_k/dv a,                                                              (2)
///
/// is affine in a. Both rates must be proven to lead across:
///
///     sigma_k R(F_1) < 0,   sigma_k R(F_2) < 0   with the sign sigma_k before t*                                   (3)
///
/// The second inequality gives (1) just after t* for the motion of the region beyond. The first one excludes motions
/// that stay before the border. By (2) and (3), R(a) is not zero for any a = s F_1 + (1 - s) F_2, 0 <= s <= 1, so
/// that no motion slides on the border: it crosses, and does so in one way (Filippov, *Differential Equations with
/// Discontinuous Righthand Sides*, 1988, chapter 2, section 10). If the signs in (3) differ, the motion slides or is
/// not unique, and stays open. After t*, psi_k is exactly zero at the beginning of its series. The other psi_j, some of
/// which may have another formula now, must have a strict sign; it is their sigma_j.
///
/// *Contacts.* A formula e is the same on the border as another one if e_2 - e_1 = p psi_k, where p has no denominator;
/// so is its gradient if e_2 - e_1 = p psi_k^2. Contacts that are closed and have the same gap, J_n, tangents and
/// drives there keep f_c = v_n = 0 and v_t, as q and v are continuous; Decisions::decide_modes() decides their modes
/// with the formulas after t*. If only tangents or drives jump, the new slip velocity must have a strict sign. If the
/// gap f jumps or bends,
///
///     f > 0, or the same f = 0 and v_n > 0:  the contact opens, at an edge                                        (4)
///     the same f = 0 and v_n < 0:            it is hit, at a concave corner, without friction                     (5)
///
/// In (5), the impact must not move psi_k, which does not depend on v, and after it
///
///     sigma_k R < 0,   d f_before/dt > 0                                                                          (6)
///
/// so that the motion enters the region after t*, and the face before it satisfies the law of impacts without an
/// impulse. Without friction, this law is a linear complementarity problem with a positive definite matrix, and has no
/// other solution. The gap of an open contact must be positive in both regions.
///
/// *Impacts.* psi_k may depend on v and change its sign in an impact. If all psi have strict signs before and after it,
/// and mass matrix, gaps, tangents and drives are the same formulas on both sides, the motion continues from v+ in the
/// region of these signs, and modes are decided there.
///
/// *End.* ProblemInfo::until is such a psi_k, where formulas do not change. The run ends at its first zero after the
/// start, at which the first inequality (3) holds, or at an impact that changes its sign.
///
/// *Start.* If psi_k is exactly zero at t = 0, its first coefficient that is not exactly zero,
///
///     psi_k = c t^m + ...,                                                                                       (7)
///
/// must have the same strict sign in all regions that meet there, with m = 1, or m = 2 if psi_k does not depend on v,
/// or any m if it depends on t alone. Then c is affine in a as in (2), so that no motion slides, and the region with
/// the signs of c is the only one in which a motion begins.
class MotionByRegions {
 public:
  MotionByRegions(const Problem& problem, const Options& options, const Precision& precision, const TimeLimit& limit,
                  int cut);
  ~MotionByRegions();
  MotionByRegions(const MotionByRegions&) = delete;
  MotionByRegions& operator=(const MotionByRegions&) = delete;

  /// Lets `sensitivities` follow a motion in one region.
  void follow(Sensitivities& sensitivities) { sensitivities_ = &sensitivities; }
  /// Runs to the end time. @throws as HybridMotion::run() and scene_formulas()
  void run();
  /// The last part, which contains the whole motion until its end; null before the start.
  const HybridMotion* motion() const { return motion_.get(); }

 private:
  /// A region with its formulas.
  struct Region {
    explicit Region(const Precision& precision) : program(precision) {}
    std::unique_ptr<Problem> problem;  ///< null: that of the whole motion
    SeriesProgram program;
    SceneFormulas scene;
  };
  using Signs = std::vector<int>;
  Region& region(const Signs& signs);
  std::unique_ptr<HybridMotion> in(const Signs& signs);
  std::vector<int> find_start(Signs& signs);
  void start();
  void start_on_borders(Signs signs, const std::vector<int>& zero);
  void cross();
  bool has_ended() const;

  const Problem& problem_;
  const Options& options_;
  Precision precision_;
  const TimeLimit& limit_;
  int cut_;
  Sensitivities* sensitivities_ = nullptr;
  std::map<Signs, std::unique_ptr<Region>> regions_;
  Signs signs_;  ///< of the last part
  std::unique_ptr<HybridMotion> motion_;
};

}  // namespace ricochet::reference::certified
