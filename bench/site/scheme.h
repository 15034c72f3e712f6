#pragma once

#include <optional>
#include <string>

namespace ricochet {

/// What a source file states at its beginning: the scheme of a method, in a comment whose numbered lines are equations, or
/// a scene.
struct Scheme {
  std::string file;  ///< "methods/time_stepping/moreau_jean.cpp"
  std::string text;
};

/// Of the file that registers `method`: the comment at its head, or that of its class with those of the headers that
/// it names. Read from the source tree when it is asked for; empty where there is none, as beside an installed program.
std::optional<Scheme> scheme_of(const std::string& method);

/// Of the file of a scene: the comment above its text, a sketch with the equations. Empty for a scene without a file of its own.
std::optional<Scheme> statement_of(const std::string& scene);

}  // namespace ricochet
