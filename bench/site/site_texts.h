#pragma once

#include <optional>
#include <string>
#include <vector>

#include "methods/registry.h"
#include "problems/registry.h"

namespace ricochet {

// Texts about methods and scenes from the source tree, collected when the program is built (collect_texts).

struct SourceText {
  std::string file;  ///< "methods/time_stepping/moreau_jean.cpp"
  std::string text;
};

/// The comment with the numbered equations of a method. Empty for a method of a plugin.
std::optional<SourceText> scheme_of(const MethodEntry& method);

/// The comment above the text of a scene, a sketch with the equations. Empty for a scene without a file of its own.
std::optional<SourceText> statement_of(const SceneEntry& scene);

/// The prose of a statement: the lines that begin at the margin, joined where they follow each other.
std::vector<std::string> paragraphs_of(const SourceText& statement);

/// An entry of methods/sources.bib.
struct Source {
  std::string entry;                 ///< BibTeX
  std::vector<std::string> methods;  ///< of which it is a source
};

/// All sources, in the order of the file.
const std::vector<Source>& sources();

/// BibTeX of the sources of a method.
std::string sources_of(const std::string& method);

/// BibTeX of this program, with the revision that runs.
std::string program_entry();

}  // namespace ricochet
