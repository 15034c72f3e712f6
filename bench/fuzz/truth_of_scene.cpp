#include "bench/fuzz/truth_of_scene.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "methods/isolated.h"

namespace ricochet {
namespace {

using nlohmann::json;
using reference::certified::CertifiedMotion;
using reference::certified::Grade;

FuzzTruth truth_of_motion(const CertifiedMotion& motion, const ProblemInfo& info) {
  FuzzTruth truth;
  truth.grade = name_of(motion.grade);
  truth.reason = motion.reason;
  if (!motion.assumptions.empty()) truth.reason = motion.assumptions.front();
  if (motion.grade > Grade::assumed) return truth;
  truth.decimals = motion.decimals();
  for (const auto& [numbers, x] : {std::pair(&motion.q, &truth.q), std::pair(&motion.v, &truth.v)}) {
    for (const auto& number : *numbers) {
      x->push_back(std::strtod(number.text.c_str(), nullptr));
      truth.error = std::max(truth.error, number.radius);
    }
  }
  truth.q.resize(truth.q.size() + static_cast<std::size_t>(info.n_friction_elements), 0);
  truth.v.resize(truth.q.size(), 0);
  if (info.clock >= 0) {
    truth.q.push_back(std::strtod(motion.end_time.text.c_str(), nullptr));
    truth.v.push_back(1);
  }
  return truth;
}

}  // namespace

FuzzTruth prove_scene(const Problem& problem, const reference::certified::Options& options) {
  reference::certified::Options proof_only = options;
  proof_only.may_compute = false;  // a computed motion is no truth for a judge
  const auto begin = std::chrono::steady_clock::now();
  const IsolatedResult ended =
      run_isolated([&] { return json(truth_of_motion(certified_motion(problem, proof_only), problem.info())).dump(); },
                   10 * (options.max_seconds + 1));
  FuzzTruth truth;
  if (ended.ending == IsolatedResult::Ending::returned) {
    truth = json::parse(ended.text).get<FuzzTruth>();
  } else {
    truth.grade = ended.ending == IsolatedResult::Ending::killed ? "killed" : "crashed";
    truth.reason = ended.text;
  }
  truth.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return truth;
}

}  // namespace ricochet
