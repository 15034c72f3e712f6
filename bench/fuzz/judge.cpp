#include "bench/fuzz/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>

#include "bench/measure/measure_run.h"
#include "methods/isolated.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"
#include "problems/vector_json.h"

namespace ricochet {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;
using reference::certified::Reading;

constexpr double kAllowed = 1e-6;      // d in (1), relative to s
constexpr double kConfirming = 1e-2;   // a pair confirms each other, relative to s
constexpr double kImprecise = 1e-5;    // (3), relative to s
constexpr double kAmplified = 30;      // (7)
constexpr double kDisturbance = 1e-9;  // of the forces, relative to g
constexpr double kTolerance = 1e-10, kTight = 1e-11, kTighter = 1e-12;
constexpr double kLeastTolerance = 1e-15;  // that methods take
constexpr double kChanged = 3;             // (4), (6): errors by what another tolerance or ten times the steps change

constexpr const char* kAdaptive = "fesd_adaptive:radau-iia:4";
constexpr const char* kFixed = "fesd:radau-iia:3,elements=as_needed";
constexpr const char* kCvode = "cvode:adams";
constexpr const char* kEventDriven = "event_driven";
// Only where formulas bend or jump, or with friction elements: b, then o.
constexpr std::array kOthers = {"ida", "arkode", "fesd_adaptive:gauss:4", "extrapolated_moreau"};
constexpr const char* kCapturing = "event_capturing,order=3";
constexpr std::size_t kMoreauJean = 3, kFirstOther = 5;  // m, and the first of b in the list of results

constexpr int kFixedSteps = 400, kMoreauJeanSteps = 5000, kMoreFixed = 2, kMoreMoreauJean = 10;
constexpr int kDigits = 20;        // of a proof, in the units of the answers
constexpr double kMoreProof = 10;  // of its time

constexpr int kFiner = 4;           // N' / N
constexpr double kStepErrors = 10;  // (1), (5), (6): an error by what N and N' steps differ

std::string moreau_jean_for(const ProblemInfo& problem) {
  const bool is_spatial = std::ranges::any_of(problem.contacts, [](const auto& c) { return c.n_t == 2; });
  return is_spatial ? "moreau_jean,solver=newton" : "moreau_jean";  // facets are not the friction disc
}

/// @param a, b  FuzzResult or FuzzTruth
template <class A, class B>
double distance(const A& a, const B& b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.q.size(); ++k)
    largest = std::max({largest, std::abs(a.q[k] - b.q[k]), std::abs(a.v[k] - b.v[k])});
  return largest;
}

template <class A>
double size_of(const A& a) {
  double largest = 1;
  for (std::size_t k = 0; k < a.q.size(); ++k) largest = std::max({largest, std::abs(a.q[k]), std::abs(a.v[k])});
  return largest;
}

bool is_collapse(const FailureReason& reason) {
  return reason.code == FailureCode::impacts_accumulate && reason.contacts.size() > 1;
}

bool is_indeterminate(const FuzzResult& result) {
  return result.reason.code == FailureCode::indeterminate;
}

/// A parameter of the scene, 1 where it has none of that name.
double unit(const ordered_json& scene, const char* name) {
  const auto params = scene.find("params");
  if (params == scene.end() || !params->contains(name)) return 1;
  const auto& value = (*params)[name];
  return value.is_string() ? std::stod(value.get<std::string>()) : value.get<double>();
}

/// A constant force on every coordinate with an irregular sequence of factors between -1 and 1.
ordered_json disturbed(ordered_json scene, double size) {
  auto& f = scene["f"];
  const double acceleration = unit(scene, "unit_length") / std::pow(unit(scene, "unit_time"), 2);
  for (std::size_t k = 0; k < f.size(); ++k) {
    const double factor = acceleration * (static_cast<double>((7 * k + 3) % 19) - 9) / 9;
    const std::string sum = f[k].is_string() ? f[k].get<std::string>() : f[k].dump();
    f[k] = fmt::format("{}+({:.17e})*({})", sum, 9.81 * size * factor,
                       scene["M"][k][k].is_string() ? scene["M"][k][k].get<std::string>() : scene["M"][k][k].dump());
  }
  return scene;
}

class Judge {
 public:
  Judge(const ordered_json& scene, const JudgeOptions& options)
      : scene_(scene),
        options_(options),
        problem_(read_scene_text(scene.dump(), "scene")),
        length_(unit(scene, "unit_length")),
        velocity_(length_ / unit(scene, "unit_time")),
        size_(std::min({1.0, length_, velocity_})) {}

  FuzzScene verdict() {
    if (options_.proof_limit > 0) truth_ = prove(Reading::decimal, options_.proof_limit);
    run_all();
    if (!all_agree() || !is_confirmed()) run_more();
    measure_tolerances();
    FuzzScene judged;
    judged.verdict = decide(judged);
    judged.difference = 0;
    for (std::size_t i = 0; i < results_.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (both(i, j)) judged.difference = std::max(judged.difference, distance(results_[i], results_[j]));
      }
    }
    judged.sensitivity = sensitivity_;
    judged.truth = truth_;
    judged.results = results_;
    return judged;
  }

 private:
  /// @param setting  its tolerance is that of the numbers that the judge compares
  FuzzResult run(const Problem& problem, const std::string& method, const Setting& setting) const {
    Setting scaled = setting;
    if (setting.is_tolerance()) scaled.tolerance = std::max(kLeastTolerance, size_ * setting.tolerance);
    FuzzResult result = options_.runner(problem, method, scaled, options_.time_limit);
    for (double& q : result.q) q /= length_;
    for (double& v : result.v) v /= velocity_;
    return result;
  }

  FuzzTruth prove(Reading reading, double seconds) const {
    const int more = static_cast<int>(std::ceil(-std::log10(size_)));
    FuzzTruth truth =
        options_.prover(*problem_, {.digits = kDigits + more, .reading = reading, .max_seconds = seconds});
    for (double& q : truth.q) q /= length_;
    for (double& v : truth.v) v /= velocity_;
    truth.error /= std::min(length_, velocity_);
    return truth;
  }

  void prove_more() {
    if (!(options_.proof_limit > 0)) return;
    const double seconds = kMoreProof * options_.proof_limit;
    if (!truth_.is_known()) truth_ = prove(Reading::decimal, seconds);
    if (!truth_.is_known()) return;
    const FuzzTruth rounded = prove(Reading::rounded, seconds);
    truth_.seconds += rounded.seconds;
    if (rounded.is_known()) truth_.error += distance(truth_, rounded);  // (8)
  }

  /// With N' steps, and the error that N and N' leave, (1), (5) and (6).
  FuzzResult run_twice(const std::string& method, int steps) const {
    const FuzzResult first = run(*problem_, method, {.steps = steps});
    if (!first.succeeded()) return first;  // one run alone says nothing of its error
    FuzzResult second = with_error(run(*problem_, method, {.steps = kFiner * steps}));
    if (second.succeeded()) second.error += kStepErrors * distance(first, second);
    return second;
  }

  FuzzResult with_error(FuzzResult result) const {
    if (result.succeeded()) result.error = kAllowed * coarseness(result) * size_of(result);
    return result;
  }

  /// r of (1)
  double coarseness(const FuzzResult& result) const {
    return result.setting.is_tolerance() ? std::max(1.0, kLeastTolerance / (kTolerance * size_)) : 1;
  }

  void run_all() {
    results_ = {with_error(run(*problem_, kAdaptive, {.tolerance = kTolerance})),
                with_error(run(*problem_, kFixed, {.steps = kFixedSteps})),
                with_error(run(*problem_, kCvode, {.tolerance = kTolerance})),
                run_twice(moreau_jean_for(problem_->info()), kMoreauJeanSteps),
                with_error(run(*problem_, kEventDriven, {.tolerance = kTolerance}))};
    const ProblemInfo& info = problem_->info();
    if (info.switches.empty() && info.n_friction_elements == 0) return;
    for (const char* method : kOthers)
      results_.push_back(with_error(run(*problem_, method, {.tolerance = kTolerance})));
    results_.push_back(run_twice(kCapturing, kFixedSteps));
  }

  void run_more() {
    FuzzResult &a = results_[0], &f = results_[1], &c = results_[2], &m = results_[kMoreauJean], &e = results_[4];
    const FuzzResult a_before = a, c_before = c, e_before = e;
    double spread_a = 0, spread_c = 0, spread_e = 0;
    for (auto [result, spread] : {std::pair(&a, &spread_a), std::pair(&e, &spread_e)}) {
      if (!result->succeeded()) continue;
      *spread = change(*result, run(*problem_, result->method, {.tolerance = kTighter}));
      result->error += std::min(*spread, kImprecise * coarseness(*result) * size_of(*result));  // (3)
    }
    run_tighter(c);
    spread_c = distance(c_before, c);
    if (f.succeeded()) run_again(kMoreFixed * kFixedSteps, f);
    for (std::size_t i = kFirstOther; i < results_.size(); ++i) {
      if (results_[i].setting.is_tolerance())
        run_tighter(results_[i]);
      else if (results_[i].succeeded())
        run_again(kMoreFixed * kFixedSteps, results_[i]);
    }
    if (m.succeeded()) {
      const FuzzResult before = m;
      run_again(kMoreMoreauJean * kMoreauJeanSteps, m);
      m.error = std::max(m.error, kAllowed * size_of(m) + kChanged * distance(before, m));  // (6)
    }
    measure_sensitivity({{a_before, spread_a}, {c_before, spread_c}, {e_before, spread_e}});
    prove_more();
  }

  /// The answer with smaller tolerances, and its error (4).
  void run_tighter(FuzzResult& result) const {
    if (!result.succeeded()) return;
    double error = kConfirming * size_of(result);  // of a method that cannot be asked again nothing better is known
    for (const double tolerance : {kTight, kTighter}) {
      const FuzzResult tighter = with_error(run(*problem_, result.method, {.tolerance = tolerance}));
      if (!tighter.succeeded()) break;
      error = tighter.error + kChanged * distance(tighter, result);  // (4)
      result = tighter;
    }
    result.error = error;
  }

  /// The answer with more steps; the old one, of which little is known, where that fails.
  void run_again(int steps, FuzzResult& result) const {
    const FuzzResult again = run_twice(result.method, steps);
    if (again.succeeded())
      result = again;
    else
      result.error = kConfirming * size_of(result);
  }

  /// Distance between two answers; 0 if there is no other.
  static double change(const FuzzResult& result, const FuzzResult& other) {
    return other.succeeded() ? distance(result, other) : 0;
  }

  /// FuzzResult::tolerances of a and e.
  void measure_tolerances() {
    if (!truth_.is_known()) return;
    for (FuzzResult* result : {&results_[0], &results_[4]}) {
      if (!result->succeeded()) continue;
      result->tolerances = distance(*result, truth_) / (result->setting.tolerance / size_ * size_of(truth_));
    }
  }

  /// K and (7). @param undisturbed  answers with the first tolerance, and what another one changed
  void measure_sensitivity(const std::vector<std::pair<FuzzResult, double>>& undisturbed) {
    double smallest = std::numeric_limits<double>::infinity();
    const auto plus = read_scene_text(disturbed(scene_, kDisturbance).dump(), "disturbed scene"),
               minus = read_scene_text(disturbed(scene_, -kDisturbance).dump(), "disturbed scene");
    for (auto [result, spread] : undisturbed) {
      if (!result.succeeded()) continue;
      for (const auto* problem : {plus.get(), minus.get()})
        spread = std::max(spread, change(result, run(*problem, result.method, {.tolerance = kTolerance})));
      smallest = std::min(smallest, spread);
    }
    if (!std::isfinite(smallest)) return;
    sensitivity_ = smallest;
    for (auto& result : results_) result.error += kAmplified * smallest;
  }

  /// m, extrapolated_moreau and o
  static bool is_time_stepping(std::size_t i) { return i == kMoreauJean || i + 1 >= kFirstOther + kOthers.size(); }
  bool both(std::size_t i, std::size_t j) const { return results_[i].succeeded() && results_[j].succeeded(); }
  bool agree(std::size_t i, std::size_t j) const {  // (2)
    return distance(results_[i], results_[j]) <= results_[i].error + results_[j].error;
  }
  bool is_wrong(std::size_t i) const {  // (9)
    const FuzzResult& result = results_[i];
    return truth_.is_known() && result.succeeded() && distance(result, truth_) > result.error + truth_.error;
  }
  bool all_agree() const {
    for (std::size_t i = 0; i < results_.size(); ++i) {
      if (is_wrong(i)) return false;
      for (std::size_t j = 0; j < i && !truth_.is_known(); ++j) {
        if (both(i, j) && !agree(i, j)) return false;
      }
    }
    return true;
  }
  bool is_confirmed() const {
    for (std::size_t i = 0; i < results_.size(); ++i) {
      if (!results_[i].succeeded()) continue;
      const double known = kConfirming * size_of(results_[i]) - results_[i].error;  // of the error of another answer
      if (truth_.is_known() && !is_wrong(i) && truth_.error <= known) return true;
      for (std::size_t j = 0; j < i && !truth_.is_known(); ++j) {
        if (both(i, j) && agree(i, j) && results_[j].error <= known) return true;
      }
    }
    return false;
  }

  FuzzVerdict decide(FuzzScene& judged) const {
    const auto add = [&](const std::string& text) { judged.detail += (judged.detail.empty() ? "" : "; ") + text; };
    for (const auto& result : results_) {
      if (result.is_killed_or_crashed()) add(fmt::format("{} was {}", result.method, result.reason_class()));
    }
    if (truth_.is_killed_or_crashed()) add(fmt::format("the proof was {}", truth_.grade));
    if (!judged.detail.empty()) return FuzzVerdict::hangs;
    if (truth_.is_known()) return decide_by_truth(judged);
    double worst = 0;
    bool is_of_time_stepping = true;
    for (std::size_t i = 0; i < results_.size(); ++i) {
      for (std::size_t j = i + 1; j < results_.size(); ++j) {
        if (!both(i, j) || agree(i, j)) continue;
        is_of_time_stepping = is_of_time_stepping && (is_time_stepping(i) || is_time_stepping(j));
        const double difference = distance(results_[i], results_[j]);
        const double allowed = results_[i].error + results_[j].error;
        const std::string parties = fmt::format("{} and {}", results_[i].method, results_[j].method);
        add(fmt::format("{} differ by {:.1e}, {:.1e} allowed", parties, difference, allowed));
        if (difference / allowed <= worst) continue;
        worst = difference / allowed;
        judged.parties = parties;
      }
    }
    if (!judged.detail.empty()) {
      if (std::ranges::any_of(results_, is_indeterminate)) return FuzzVerdict::open;
      if (is_of_time_stepping && both(0, 2)) return FuzzVerdict::outvoted;
      return is_of_time_stepping && is_collapse(results_[2].reason) ? FuzzVerdict::collapse : FuzzVerdict::disagree;
    }
    return decide_agreement();
  }

  FuzzVerdict decide_by_truth(FuzzScene& judged) const {
    double worst = 0;
    bool is_of_time_stepping = true;
    for (std::size_t i = 0; i < results_.size(); ++i) {
      if (!is_wrong(i)) continue;
      is_of_time_stepping = is_of_time_stepping && is_time_stepping(i);
      const double difference = distance(results_[i], truth_), allowed = results_[i].error + truth_.error;
      judged.detail += fmt::format("{}{} differs from the truth by {:.1e}, {:.1e} allowed",
                                   judged.detail.empty() ? "" : "; ", results_[i].method, difference, allowed);
      if (difference / allowed <= worst) continue;
      worst = difference / allowed;
      judged.parties = results_[i].method + " and the truth";
    }
    if (judged.detail.empty()) return decide_agreement();
    return is_of_time_stepping ? FuzzVerdict::outvoted : FuzzVerdict::wrong;
  }

  /// The verdict if no two methods differ, or if none differs from the truth.
  FuzzVerdict decide_agreement() const {
    if (std::ranges::none_of(results_, &FuzzResult::succeeded)) return FuzzVerdict::declined;
    if (!is_confirmed()) return FuzzVerdict::undecided;
    return kAmplified * sensitivity_ > kAllowed * size() ? FuzzVerdict::sensitive : FuzzVerdict::agree;
  }

  double size() const {
    double largest = 1;
    for (const auto& result : results_) largest = std::max(largest, size_of(result));
    return largest;
  }

  const ordered_json& scene_;
  JudgeOptions options_;
  std::unique_ptr<Problem> problem_;
  double length_, velocity_;         ///< units of the answers, see SceneDraw::change_units()
  double size_;                      ///< the smallest of 1 and these: of what an absolute tolerance has to resolve
  std::vector<FuzzResult> results_;  ///< a, f, c, m, e, and where they are judged b, o
  FuzzTruth truth_;
  double sensitivity_ = 0;
};

}  // namespace

FuzzResult run_method(const Problem& problem, const std::string& method, const Setting& setting, double time_limit) {
  FuzzResult result;
  result.method = method;
  result.setting = setting;
  const auto begin = std::chrono::steady_clock::now();
  const auto work = [&] {
    Run run;
    run.method = method;
    run.setting = setting;
    const Solution s =
        measure_run({.problem = problem, .recording = Recording::final_state, .time_limit = time_limit}, run);
    FuzzResult answer = result;
    answer.status = run.status;
    answer.message = run.message;
    answer.reason = run.reason;
    if (!run.succeeded()) return json(answer).dump();
    if (!(s.q.allFinite() && s.v.allFinite())) answer.status = "not finite, called a success";
    answer.q.assign(s.q.begin(), s.q.end());
    answer.v.assign(s.v.begin(), s.v.end());
    return json(answer).dump();
  };
  const IsolatedResult ended = run_isolated(work, 2 * time_limit);
  if (ended.ending == IsolatedResult::Ending::returned) {
    result = json::parse(ended.text).get<FuzzResult>();
  } else {
    result.status = ended.ending == IsolatedResult::Ending::killed ? "killed" : "crashed";
    result.message = ended.text;
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

FuzzScene judge(const ordered_json& scene, const JudgeOptions& options) {
  return Judge(scene, options).verdict();
}

}  // namespace ricochet
