#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "methods/method.h"
#include "methods/registry.h"
#include "problems/registry.h"

/// @file
/// What a shared library includes that brings methods or scenes: RICOCHET_PLUGIN().

namespace ricochet {

/// What a plugin and the program must agree on. A plugin that does not is refused before any of its code runs: objects
/// that both make and read have to be laid out alike.
struct PluginInterface {
  int version;           ///< of the classes below
  int alignment;         ///< of Eigen's memory, which follows from the instruction set: -march=native changes it
  std::size_t sizes[4];  ///< of Settings, Solution, ProblemInfo and MethodEntry [bytes]

  bool operator==(const PluginInterface&) const = default;  ///< All numbers agree.
};

/// 1: Method, Solver, Settings, Solution, Problem, MethodEntry and SceneEntry of Ricochet 1.0
inline constexpr int kPluginVersion = 2;
/// That of these headers, as the compiler of whoever includes them sees it.
inline constexpr PluginInterface kPluginInterface = {
    kPluginVersion,
    EIGEN_MAX_ALIGN_BYTES,
    {sizeof(Settings), sizeof(Solution), sizeof(ProblemInfo), sizeof(MethodEntry)}};

}  // namespace ricochet

/// Methods and scenes of a shared library, once in it:
///
///     RICOCHET_PLUGIN() {
///       ricochet::register_method<MyMethod>({.name = "mine", .usage = "mine", .summary = "my method"});
///     }
///
/// `ricochet --plugin ./libmine.so run --method mine ...` finds them.
#define RICOCHET_PLUGIN()                                                                                       \
  extern "C" __attribute__((visibility("default"))) const ricochet::PluginInterface ricochet_plugin_interface = \
      ricochet::kPluginInterface;                                                                               \
  extern "C" __attribute__((visibility("default"))) void ricochet_register_plugin()
