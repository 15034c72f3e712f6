#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace ricochet {

// Checks of option values. The ranges of CLI11 accept "nan", which is neither below nor above them.

/// A finite number x for which is_allowed(x).
template <class IsAllowed>
CLI::Validator number_check(const std::string& allowed, IsAllowed is_allowed) {
  const auto check = [=](const std::string& text) -> std::string {
    double x = 0;
    const bool is_finite = CLI::detail::lexical_cast(text, x) && x - x == 0;
    return is_finite && is_allowed(x) ? "" : "Value " + text + ": a number " + allowed + " is required";
  };
  return CLI::Validator(check, "");
}

inline CLI::Validator positive_number() {
  return number_check("above 0", [](double x) { return x > 0; });
}

inline CLI::Validator non_negative_number() {
  return number_check("of at least 0", [](double x) { return x >= 0; });
}

}  // namespace ricochet
