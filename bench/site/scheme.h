#pragma once

#include <optional>
#include <string>

namespace ricochet {

/// The scheme of a method as its source file states it: a comment whose numbered lines are equations.
struct Scheme {
  std::string file;  ///< "methods/time_stepping/moreau_jean.cpp"
  std::string text;
};

/// Of the file that registers `method`: the comment at its head, or that of its class with those of the headers that
/// it names. Read from the source tree when it is asked for; empty where there is none, as beside an installed program.
std::optional<Scheme> scheme_of(const std::string& method);

}  // namespace ricochet
