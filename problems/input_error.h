#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <string_view>

/// @file
/// The exception for input that a user can correct.

namespace ricochet {

/// Input that a user can correct. The text names the field, the value that was given and what is allowed;
/// the command line turns it into one line on stderr and exit code 2.
class InputError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;  ///< a whole text

  /// "FIELD = VALUE: ALLOWED", with what is `allowed` or why the `value` of this `field` is not.
  template <class Value>
  InputError(std::string_view field, const Value& value, std::string_view allowed)
      : std::invalid_argument(fmt::format("{} = {}: {}", field, value, allowed)) {}
};

}  // namespace ricochet
