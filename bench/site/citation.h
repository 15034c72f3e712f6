#pragma once

#include <string>

#include "reports/site/site_page.h"

namespace ricochet {

/// BibTeX of the sources of a method, by methods/sources.bib, whose field `ricochet` names the methods of an entry. Read
/// when it is asked for; empty where there is none, as beside an installed program.
std::string sources_of(const std::string& method);

/// How to cite: this program, and what each method is from.
SitePage citation_page();

}  // namespace ricochet
