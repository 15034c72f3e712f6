#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "methods/method.h"
#include "methods/registry.h"
#include "problems/registry.h"

/// @file
/// The header for shared libraries with methods or scenes: RICOCHET_PLUGIN().

namespace ricochet {

/// Properties that must be equal in a plugin and the program, because both make and read the same objects. A plugin
/// with other values is rejected before its code runs.
struct PluginInterface {
  int version;           ///< of the classes below
  int alignment;         ///< of Eigen's memory, which follows from the instruction set: -march=native changes it
  std::size_t sizes[4];  ///< of Settings, Solution, ProblemInfo and MethodEntry [bytes]

  bool operator==(const PluginInterface&) const = default;  ///< All numbers agree.
};

/// 1: Method, Solver, Settings, Solution, Problem, MethodEntry and SceneEntry of Ricochet 1.0
inline constexpr int kPluginVersion = 12;
/// The interface of these headers, as seen by the compiler that includes them.
inline constexpr PluginInterface kPluginInterface = {
    kPluginVersion,
    EIGEN_MAX_ALIGN_BYTES,
    {sizeof(Settings), sizeof(Solution), sizeof(ProblemInfo), sizeof(MethodEntry)}};

}  // namespace ricochet

/// Defines the function that registers methods and scenes of a shared library; use it once:
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
