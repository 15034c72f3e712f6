#include "bench/fuzz/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>

#include "methods/isolated.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"
#include "problems/vector_json.h"

namespace ricochet {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

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

constexpr int kFixedSteps = 400, kMoreauJeanSteps = 5000, kMoreFixed = 2, kMoreMoreauJean = 10;
constexpr int kFiner = 4;           // N' / N
constexpr double kStepErrors = 10;  // (1), (5), (6): an error by what N and N' steps differ

std::string moreau_jean_for(const ProblemInfo& problem) {
  const bool is_spatial = std::ranges::any_of(problem.contacts, [](const auto& c) { return c.n_t == 2; });
  return is_spatial ? "moreau_jean,solver=newton" : "moreau_jean";  // facets are not the friction disc
}

double distance(const FuzzOpinion& a, const FuzzOpinion& b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.q.size(); ++k)
    largest = std::max({largest, std::abs(a.q[k] - b.q[k]), std::abs(a.v[k] - b.v[k])});
  return largest;
}

double size_of(const FuzzOpinion& a) {
  double largest = 1;
  for (std::size_t k = 0; k < a.q.size(); ++k) largest = std::max({largest, std::abs(a.q[k]), std::abs(a.v[k])});
  return largest;
}

/// The impacts of several contacts accumulate.
bool says_collapse(const FuzzOpinion& opinion) {
  return !opinion.succeeded() && opinion.message.find("the impacts of contacts") != std::string::npos &&
         opinion.message.find("accumulate") != std::string::npos;
}

bool says_not_unique(const FuzzOpinion& opinion) {
  if (opinion.succeeded()) return false;
  return opinion.message.find("indeterminate") != std::string::npos ||
         opinion.message.find("several solutions") != std::string::npos ||
         opinion.message.find("not unique") != std::string::npos;
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

class Hearing {
 public:
  Hearing(const ordered_json& scene, const JudgeOptions& options)
      : scene_(scene),
        options_(options),
        problem_(read_scene_text(scene.dump(), "scene")),
        length_(unit(scene, "unit_length")),
        velocity_(length_ / unit(scene, "unit_time")),
        size_(std::min({1.0, length_, velocity_})) {}

  FuzzScene verdict() {
    hear();
    if (!all_agree() || !is_confirmed()) hear_more();
    FuzzScene result;
    result.verdict = decide(result);
    result.difference = 0;
    for (std::size_t i = 0; i < opinions_.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (both(i, j)) result.difference = std::max(result.difference, distance(opinions_[i], opinions_[j]));
      }
    }
    result.sensitivity = sensitivity_;
    result.opinions.assign(opinions_.begin(), opinions_.end());
    return result;
  }

 private:
  /// @param tolerance  of the numbers that the judge compares
  FuzzOpinion run(const Problem& problem, const std::string& method, int steps, double tolerance) const {
    FuzzOpinion opinion = options_.asker(
        problem, method, steps, tolerance > 0 ? std::max(kLeastTolerance, size_ * tolerance) : 0, options_.time_limit);
    for (double& q : opinion.q) q /= length_;
    for (double& v : opinion.v) v /= velocity_;
    return opinion;
  }

  /// With N' steps, and the error that N and N' leave, (1), (5) and (6).
  FuzzOpinion run_twice(const std::string& method, int steps) const {
    const FuzzOpinion first = run(*problem_, method, steps, 0);
    if (!first.succeeded()) return first;  // one run alone says nothing of its error
    FuzzOpinion second = with_error(run(*problem_, method, kFiner * steps, 0));
    if (second.succeeded()) second.error += kStepErrors * distance(first, second);
    return second;
  }

  FuzzOpinion with_error(FuzzOpinion opinion) const {
    if (opinion.succeeded()) opinion.error = kAllowed * coarseness(opinion) * size_of(opinion);
    return opinion;
  }

  /// r of (1)
  double coarseness(const FuzzOpinion& opinion) const {
    return opinion.tolerance > 0 ? std::max(1.0, kLeastTolerance / (kTolerance * size_)) : 1;
  }

  void hear() {
    opinions_ = {with_error(run(*problem_, kAdaptive, 0, kTolerance)),
                 with_error(run(*problem_, kFixed, kFixedSteps, 0)), with_error(run(*problem_, kCvode, 0, kTolerance)),
                 run_twice(moreau_jean_for(problem_->info()), kMoreauJeanSteps),
                 with_error(run(*problem_, kEventDriven, 0, kTolerance))};
  }

  void hear_more() {
    auto& [a, f, c, m, e] = opinions_;
    const FuzzOpinion a_before = a, c_before = c, e_before = e;
    double spread_a = 0, spread_c = 0, spread_e = 0;
    for (auto [opinion, spread] : {std::pair(&a, &spread_a), std::pair(&e, &spread_e)}) {
      if (!opinion->succeeded()) continue;
      *spread = change(*opinion, run(*problem_, opinion->method, 0, kTighter));
      opinion->error += std::min(*spread, kImprecise * coarseness(*opinion) * size_of(*opinion));  // (3)
    }
    if (c.succeeded()) {
      double error = kConfirming * size_of(c);  // of a method that cannot be asked again nothing better is known
      for (const double tolerance : {kTight, kTighter}) {
        const FuzzOpinion tighter = with_error(run(*problem_, kCvode, 0, tolerance));
        if (!tighter.succeeded()) break;
        error = tighter.error + kChanged * distance(tighter, c);  // (4)
        c = tighter;
      }
      c.error = error;
      spread_c = distance(c_before, c);
    }
    if (f.succeeded()) ask_again(kMoreFixed * kFixedSteps, f);
    if (m.succeeded()) {
      const FuzzOpinion before = m;
      ask_again(kMoreMoreauJean * kMoreauJeanSteps, m);
      m.error = std::max(m.error, kAllowed * size_of(m) + kChanged * distance(before, m));  // (6)
    }
    measure_sensitivity({{a_before, spread_a}, {c_before, spread_c}, {e_before, spread_e}});
  }

  /// The answer with more steps; the old one, of which little is known, where that fails.
  void ask_again(int steps, FuzzOpinion& opinion) const {
    const FuzzOpinion again = run_twice(opinion.method, steps);
    if (again.succeeded())
      opinion = again;
    else
      opinion.error = kConfirming * size_of(opinion);
  }

  /// How far another answer is from this one; 0 where there is none.
  static double change(const FuzzOpinion& opinion, const FuzzOpinion& other) {
    return other.succeeded() ? distance(opinion, other) : 0;
  }

  /// K and (7). @param undisturbed  answers with the first tolerance, and what another one changed
  void measure_sensitivity(const std::vector<std::pair<FuzzOpinion, double>>& undisturbed) {
    double smallest = std::numeric_limits<double>::infinity();
    const auto plus = read_scene_text(disturbed(scene_, kDisturbance).dump(), "disturbed scene"),
               minus = read_scene_text(disturbed(scene_, -kDisturbance).dump(), "disturbed scene");
    for (auto [opinion, spread] : undisturbed) {
      if (!opinion.succeeded()) continue;
      for (const auto* problem : {plus.get(), minus.get()})
        spread = std::max(spread, change(opinion, run(*problem, opinion.method, 0, kTolerance)));
      smallest = std::min(smallest, spread);
    }
    if (!std::isfinite(smallest)) return;
    sensitivity_ = smallest;
    for (auto& opinion : opinions_) opinion.error += kAmplified * smallest;
  }

  bool both(std::size_t i, std::size_t j) const { return opinions_[i].succeeded() && opinions_[j].succeeded(); }
  bool agree(std::size_t i, std::size_t j) const {  // (2)
    return distance(opinions_[i], opinions_[j]) <= opinions_[i].error + opinions_[j].error;
  }
  bool all_agree() const {
    for (std::size_t i = 0; i < opinions_.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (both(i, j) && !agree(i, j)) return false;
      }
    }
    return true;
  }
  bool is_confirmed() const {
    for (std::size_t i = 0; i < opinions_.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (both(i, j) && agree(i, j) && opinions_[i].error + opinions_[j].error <= kConfirming * size_of(opinions_[i]))
          return true;
      }
    }
    return false;
  }

  FuzzVerdict decide(FuzzScene& result) const {
    const auto add = [&](const std::string& text) { result.detail += (result.detail.empty() ? "" : "; ") + text; };
    for (const auto& opinion : opinions_) {
      if (opinion.is_killed_or_crashed()) add(fmt::format("{} was {}", opinion.method, opinion.reason_class()));
    }
    if (!result.detail.empty()) return FuzzVerdict::hangs;
    double worst = 0;
    bool is_of_time_stepping = true;
    for (std::size_t i = 0; i < opinions_.size(); ++i) {
      for (std::size_t j = i + 1; j < opinions_.size(); ++j) {
        if (!both(i, j) || agree(i, j)) continue;
        is_of_time_stepping = is_of_time_stepping && (i == 3 || j == 3);
        const double difference = distance(opinions_[i], opinions_[j]);
        const double allowed = opinions_[i].error + opinions_[j].error;
        const std::string parties = fmt::format("{} and {}", opinions_[i].method, opinions_[j].method);
        add(fmt::format("{} differ by {:.1e}, {:.1e} allowed", parties, difference, allowed));
        if (difference / allowed <= worst) continue;
        worst = difference / allowed;
        result.parties = parties;
      }
    }
    if (!result.detail.empty()) {
      if (std::ranges::any_of(opinions_, says_not_unique)) return FuzzVerdict::open;
      if (is_of_time_stepping && both(0, 2)) return FuzzVerdict::outvoted;
      return is_of_time_stepping && says_collapse(opinions_[2]) ? FuzzVerdict::collapse : FuzzVerdict::disagree;
    }
    if (std::ranges::none_of(opinions_, &FuzzOpinion::succeeded)) return FuzzVerdict::declined;
    if (!is_confirmed()) return FuzzVerdict::undecided;
    return kAmplified * sensitivity_ > kAllowed * size() ? FuzzVerdict::sensitive : FuzzVerdict::agree;
  }

  double size() const {
    double largest = 1;
    for (const auto& opinion : opinions_) largest = std::max(largest, size_of(opinion));
    return largest;
  }

  const ordered_json& scene_;
  JudgeOptions options_;
  std::unique_ptr<Problem> problem_;
  double length_, velocity_;             ///< units of the answers, see SceneDraw::change_units()
  double size_;                          ///< the smallest of 1 and these: of what an absolute tolerance has to resolve
  std::array<FuzzOpinion, 5> opinions_;  ///< a, f, c, m, e
  double sensitivity_ = 0;
};

}  // namespace

FuzzOpinion ask(const Problem& problem, const std::string& method, int steps, double tolerance, double time_limit) {
  FuzzOpinion opinion;
  opinion.method = method;
  opinion.steps = steps;
  opinion.tolerance = tolerance;
  const auto begin = std::chrono::steady_clock::now();
  const auto work = [&]() -> std::string {
    Settings settings;
    settings.steps = steps;
    settings.tolerance = tolerance;
    settings.time_limit = time_limit;
    settings.recording = Recording::final_state;
    const auto asked = make_method(method);
    if (const Support support = asked->can_run(problem.info()); !support.ok)
      return json{{"declined", support.reason}}.dump();
    try {
      const Solution s = asked->solve(problem, settings);
      json answer = {{"status", to_string(s.status)}, {"message", s.message}};
      if (s.succeeded() && !(s.q.allFinite() && s.v.allFinite())) answer["status"] = "not finite, called a success";
      answer["q"] = s.q;
      answer["v"] = s.v;
      return answer.dump();
    } catch (const InputError& error) {
      return json{{"declined", error.what()}}.dump();
    }
  };
  const IsolatedResult result = run_isolated(work, 2 * time_limit);
  opinion.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (result.ending != IsolatedResult::Ending::returned) {
    opinion.status = result.ending == IsolatedResult::Ending::killed ? "killed" : "crashed";
    opinion.message = result.text;
    return opinion;
  }
  const json answer = json::parse(result.text);
  if (answer.contains("declined")) {
    opinion.status = "declined";
    opinion.message = answer["declined"];
    return opinion;
  }
  opinion.status = answer["status"];
  opinion.message = answer["message"];
  if (opinion.succeeded()) {
    opinion.q = answer["q"].get<std::vector<double>>();
    opinion.v = answer["v"].get<std::vector<double>>();
  }
  return opinion;
}

FuzzScene judge(const ordered_json& scene, const JudgeOptions& options) {
  return Hearing(scene, options).verdict();
}

}  // namespace ricochet
