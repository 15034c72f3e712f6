#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/fuzz/fuzz_scene.h"
#include "bench/fuzz/truth_of_scene.h"
#include "problems/problem.h"

namespace ricochet {

/// A run of one method in a process of its own. @param time_limit  of the run [s]
FuzzResult run_method(const Problem& problem, const std::string& method, const Setting& setting, double time_limit);

struct JudgeOptions {
  double time_limit = 10;                        ///< of a run [s]
  double proof_limit = 0.2;                      ///< of a proof [s]; 0: none
  decltype(&run_method) runner = &run_method;    ///< for tests of the rule
  decltype(&prove_scene) prover = &prove_scene;  ///< for tests of the rule
};

/// The judge of random scenes: methods that share little of their numerics compute the final state x = (q, v), each in
/// a process of its own that is killed after twice the time limit.
///
///   a  fesd_adaptive:radau-iia:4               tolerance 1e-10
///   f  fesd:radau-iia:3,elements=as_needed     a few hundred steps
///   c  cvode:adams                             tolerance 1e-10
///   m  moreau_jean                             thousands of steps
///   e  event_driven                            tolerance 1e-10
///
/// Other methods have code of their own for formulas that bend or jump, and for friction elements. On scenes with these
/// they are judged, too:
///
///   b  ida, arkode, fesd_adaptive:gauss:4, extrapolated_moreau   tolerance 1e-10
///   o  event_capturing,order=3                                   a few hundred steps
///
/// First `ricochet truth` is asked for a proof of the motion, x_t with a bound d_t of its error. Where there is one of
/// grade proven or assumed, it alone decides: every method is compared with it, as in (9), and not with other methods.
///
/// x is in metres and seconds: results of a scene with parameters unit_length and unit_time are divided by these units.
/// The tolerance of a method is absolute for numbers below 1. So it is multiplied by the smallest of 1 and the units of
/// length and velocity, down to 1e-15, which is the least that methods accept.
///
/// First each is allowed an error d, max-norm; s is the largest number in x, at least 1:
///
///   d_a = d_b = d_c = d_e = 1e-6 s r,   d_f = 1e-6 s,   d_m, d_o = 1e-6 s + 10 |x_N - x_N'|                    (1)
///
/// with N and N' = 4 N steps. The error of Moreau-Jean falls like 1/N, but not evenly. After impacts that accumulate
/// it falls more slowly, in observed cases like N^-0.35. r is the larger of 1 and 1e-15 over the tolerance
/// without that limit. Two methods agree when
///
///   |x_i - x_j| <= d_i + d_j                                                                                  (2)
///
/// If all that succeed do and some pair confirms each other within 1e-2 s, the verdict is "agree". Otherwise all are
/// heard once more. A proof and a method are a pair, too.
///
/// a  and e keep their answers. A tolerance is of a step, and errors add up over hundreds of impacts; more than 1e-5 s
///    is not imprecise but wrong:
///
///   d_i = 1e-6 s r + min(|x_1e-10 - x_1e-12|, 1e-5 s r),  i = a, e                                              (3)
///
/// b  and c use the tolerance 1e-12, or 1e-11 if that fails. With 1e-10 it ends 1e-3 off where impacts accumulate, because
///    the flights become lower than its errors. With x' the result at a tolerance 10 times as large,
///
///   d_c = 1e-6 s r + 3 |x - x'|                                                                                (4)
///
/// f  and m get two and ten times as many steps. Whether they close a bounce that falls into a step depends on the
///    position of the step, so that results may jump:
///
///   d_f, d_o = 1e-6 s + 10 |x_N - x_N'|,   N' = 4 N                                                           (5)
///   d_m = 1e-6 s + max(10 |x_N - x_N'|, 3 |x_N'/10 - x_N'|)                                                   (6)
///
/// If more runs of b, c, f, o or m fail, the method keeps its last result with d = 1e-2 s.
///
/// The sensitivity of the motion to small changes is measured, too: a, c and e run with forces disturbed by +-1e-9 of
/// g, and K is the largest change of x, by a disturbance or by the tolerance 1e-12 in place of 1e-10. The smallest of
/// the three K counts, since a faulty method may err in one run and not in the next, which must not excuse it:
///
///   d_i := d_i + 30 K                                                                                         (7)
///
/// t  is asked with ten times as much time, if it is open. It is of the scene as it is written; methods integrate the
///    scene whose numbers are rounded to double. Where the motion x_r of that scene is proven, too,
///
///   d_t := d_t + |x_t - x_r|                                                                                    (8)
///
/// With a proof, every method i that succeeds is wrong where
///
///   |x_i - x_t| > d_i + d_t                                                                                     (9)
///
/// whatever the others say: "wrong", or "outvoted" where time stepping (m, o, extrapolated_moreau) alone is wrong, for
/// the reason below. Without a proof, (2)
/// again decides: "agree" where 30 K < 1e-6 s, "sensitive" where only K explains the difference. Else "open" where
/// a method has declined because the motion is not unique. Where time stepping alone stands against the others, a time step has
/// made one impact of several, or several of one that strikes bodies at rest against each other, however short it is
/// (element_start.h, (7)): "outvoted" where a and c, which share no formulas, agree; "collapse" where c has declined
/// because the impacts of several contacts accumulate. Else "disagree". No pair that confirms: "undecided"; no method
/// that succeeds: "declined". A method that was killed or crashed: "hangs", whatever the others say.
///
/// @param scene  of a scene file. family, seed, number and file of the result are the caller's.
/// @throws InputError for a scene that is not allowed
FuzzScene judge(const nlohmann::ordered_json& scene, const JudgeOptions& options);

}  // namespace ricochet
