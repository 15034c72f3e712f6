#pragma once

namespace ricochet::assets {

// The files of reports/site/dist/, put into the program by CMake.

extern const char* const kSiteStyle;
extern const char* const kSiteScript;
extern const char* const kEquationStyle;   // of KaTeX, with its fonts
extern const char* const kEquationScript;  // KaTeX

}  // namespace ricochet::assets
