#pragma once

#include <optional>
#include <string>
#include <vector>

#include "methods/registry.h"
#include "problems/registry.h"

namespace ricochet {

/// What a source file states at its beginning: the scheme of a method, in a comment whose numbered lines are equations, or
/// a scene.
struct Scheme {
  std::string file;  ///< "methods/time_stepping/moreau_jean.cpp"
  std::string text;
};

/// Of the file that registers a method, or of the one that it names as its scheme: the comment at its head, with those of
/// the headers whose equations it counts on, or that of its class with those of all headers that it names. Read when it
/// is asked for; empty where the file is not there, as beside an installed program.
std::optional<Scheme> scheme_of(const MethodEntry& method);

/// Of the file of a scene: the comment above its text, a sketch with the equations. Empty for a scene without a file of
/// its own.
std::optional<Scheme> statement_of(const SceneEntry& scene);

/// What is neither sketch nor equation in a statement: the lines that begin at the margin, joined where they follow each
/// other.
std::vector<std::string> paragraphs_of(const Scheme& statement);

}  // namespace ricochet
