#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "methods/peers/engines/engine_scene.h"
#include "methods/peers/engines/engine_settings.h"

/// @file
/// EngineWorld, the interface of the adapters of engines.

namespace ricochet {

/// A scene in an engine, with a constant time step. Engines have global variables: one world of a process at a time.
class EngineWorld {
 public:
  virtual ~EngineWorld() = default;

  /// A step of the length that the world was made for.
  virtual void step() = 0;
  /// Reads the present states of the bodies.
  virtual void read(std::span<BodyState> states) const = 0;
  /// Warnings, omissions and resets of the engine so far; empty: none. A run with some is a failed one.
  virtual std::string complaint() const { return ""; }
  /// The gap that the engine finds for each of EngineScene::pairs() at its present state [m]; NaN where it finds the
  /// shapes too far apart to say. For tests.
  virtual std::vector<double> gaps() = 0;
};

/// Makes a world of `scene` at `states`, with steps of `h` seconds.
using MakeEngineWorld = std::function<std::unique_ptr<EngineWorld>(
    const EngineScene& scene, const EngineSettings& settings, std::span<const BodyState> states, double h)>;

/// No gap, see EngineWorld::gaps().
inline constexpr double kNoGap = std::numeric_limits<double>::quiet_NaN();

}  // namespace ricochet
