#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "problems/problem.h"
#include "reports/fuzz_results.h"

namespace ricochet {

/// The opinion of one method. @param tolerance  0 for methods with fixed steps; @param time_limit  of the run [s]
FuzzOpinion ask(const Problem& problem, const std::string& method, int steps, double tolerance, double time_limit);

struct JudgeOptions {
  double time_limit = 10;       ///< of a run [s]
  decltype(&ask) asker = &ask;  ///< for tests of the rule
};

/// The judge of random scenes: four methods that share little of their numerics are asked for the final state x = (q,
/// v), each in a process of its own that is killed after twice the time limit.
///
///   a  fesd_adaptive:radau-iia:4               tolerance 1e-10
///   f  fesd:radau-iia:3,elements=as_needed     a few hundred steps
///   c  cvode:adams                             tolerance 1e-10
///   m  moreau_jean                             thousands of steps
///
/// First each is allowed an error d, max-norm; s is the largest number in x, at least 1:
///
///   d_a = d_c = d_f = 1e-6 s,     d_m = 1e-6 s + 10 |x_N - x_N'|                                              (1)
///
/// with N and N' = 4 N steps of Moreau-Jean, whose error falls like 1/N, but not evenly, and behind impacts that
/// accumulate more slowly, like N^-0.35 in what was seen. Two methods agree when
///
///   |x_i - x_j| <= d_i + d_j                                                                                  (2)
///
/// If all that succeed do and some pair confirms each other within 1e-2 s, the verdict is "agree". Otherwise the
/// methods with fixed steps get ten and two times as many steps, f an estimate of its own,
///
///   d_f = 1e-6 s + 3 |x_N - x_N'|,   N' = 1.6 N,                                                             (3)
///
/// and what the motion makes of small changes is measured: a and c run again with a tolerance of 1e-12 and with forces
/// disturbed by +-1e-9 of g, and K is the largest change of x. Of the two K the smaller one counts, since a method that
/// is wrong may be so in one run and not in the next, and must not be its own excuse:
///
///   d_i := d_i + 30 K                                                                                         (4)
///
/// (2) again decides: "agree" where 30 K < 1e-6 s, "sensitive" where only K explains the difference; else "open" where
/// a method has declined because the motion is not unique, and else "disagree". No pair that confirms: "undecided"; no
/// method that succeeds: "declined". A method that was killed or crashed: "hangs", whatever the others say.
///
/// @param scene  of a scene file. family, seed, number and file of the result are the caller's.
/// @throws InputError for a scene that is not allowed
FuzzScene judge(const nlohmann::ordered_json& scene, const JudgeOptions& options);

}  // namespace ricochet
