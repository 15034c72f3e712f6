#pragma once

#include <string>

#include "methods/method.h"

namespace ricochet {

/// A setting that a method would not look at is refused: who gives it expects something of it.
/// @param steps, tolerance  the fields or options that were given, for messages; empty: not given
/// @throws InputError for steps of an error-controlled method, or a tolerance of a fixed-step method
void require_kind_of_setting(const Method& method, const std::string& steps, const std::string& tolerance);

}  // namespace ricochet
