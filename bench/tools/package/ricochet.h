#pragma once

#include "methods/method.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/problem.h"
#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "problems/solution.h"

/// @file
/// Everything that a program needs to run scenes: make_problem() and read_scene_file(), make_method() and methods(),
/// Method::solve(), Solution. `examples/cpp` is such a program.

/// @namespace ricochet
/// Scenes of rigid bodies with impacts and friction (Problem), numerical methods for them (Method), and what a run leaves
/// (Solution). Bad input is an InputError; numerical failure is a Status with a message.
