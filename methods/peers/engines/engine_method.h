#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "methods/method.h"
#include "methods/method_spec.h"
#include "methods/peers/engines/engine_world.h"
#include "methods/registry.h"

/// @file
/// An engine as a method: one world for each run, in a process of its own.

namespace ricochet {

/// Entry of an engine in the list of methods, and how its worlds are made.
struct EngineEntry {
  const char* name;            ///< of the method, "bullet"
  const char* library;         ///< its name in the literature
  const char* source;          ///< where its scheme is described
  const char* known_settings;  ///< the text of settings/ENGINE.json
  double order_smooth = 1;     ///< of its default integrator
  MakeEngineWorld make;
  bool has_joint_friction = false;  ///< EngineScene::joint_friction()
  /// Scenes that it declines beside those that EngineScene does; empty: none.
  Support (*supports)(const ProblemInfo& info) = nullptr;
};

/// Runs `settings`.steps steps of a world. Solution::own_seconds is the median of some runs where one takes less than
/// 20 ms; it includes the steps and the scene's forces, but not starting the process and making the world.
Solution run_engine(const EngineEntry& engine, const EngineSettings& engine_settings, const Problem& problem,
                    const Settings& settings);

/// The gaps that an engine finds for EngineScene::pairs() at the initial state of a problem, see EngineWorld::gaps().
std::vector<double> engine_gaps(const EngineEntry& engine, const EngineSettings& engine_settings,
                                const Problem& problem);

/// ENGINE[:defaults|tuned|@FILE.json].
class EngineMethod : public Method {
 public:
  EngineMethod(const EngineEntry& engine, const MethodSpec& spec)
      : engine_(engine),
        id_(spec.text()),
        choice_(spec.arguments().empty() ? "defaults" : spec.arguments().front()),
        settings_(engine.known_settings, choice_) {}

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("{}, {}", engine_.library, choice_ == "defaults" ? "default settings" : choice_),
            .source = engine_.source,
            .order_smooth = engine_.order_smooth,
            .order_impacts = 0};  // no engine claims an order through impacts
  }
  Support supports(const ProblemInfo& problem) const override {
    const Support common = EngineScene::supports(problem, engine_.has_joint_friction);
    return common.ok && engine_.supports ? engine_.supports(problem) : common;
  }
  /// engine_gaps() with its settings.
  std::vector<double> gaps(const Problem& problem) const { return engine_gaps(engine_, settings_, problem); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return run_engine(engine_, settings_, problem, settings);
  }

 private:
  EngineEntry engine_;
  std::string id_, choice_;
  EngineSettings settings_;
};

/// Puts an engine into the list of methods; what its plugin calls. @param file  of the caller
inline void register_engine(const EngineEntry& engine, const char* file = __builtin_FILE()) {
  const std::string name = engine.name;
  add_method({.name = name,
              .usage = name + "[:defaults|tuned|@FILE.json]",
              .max_arguments = 1,
              .summary = fmt::format("{} with default settings, our tuned ones, or yours", engine.library),
              .examples = {name, name + ":tuned"},
              .make = [engine](const MethodSpec& spec) -> std::unique_ptr<Method> {
                return std::make_unique<EngineMethod>(engine, spec);
              },
              .file = file});
}

}  // namespace ricochet
