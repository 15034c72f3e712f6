#pragma once

#include <string>
#include <vector>

#include "reports/site/site_page.h"

namespace ricochet {

/// An entry of methods/sources.bib, whose field `ricochet` names the methods that it is a source of.
struct Source {
  std::string entry;  ///< BibTeX, without that field
  std::vector<std::string> methods;
};

/// All of them, in the order of the file, which is read once; empty where there is none, as beside an installed program.
const std::vector<Source>& sources();

/// BibTeX of the sources of a method.
std::string sources_of(const std::string& method);

/// BibTeX of this program, by CITATION.cff, and with the revision that runs.
std::string program_entry();

/// How to cite: this program, and what each method is from.
SitePage citation_page();

}  // namespace ricochet
