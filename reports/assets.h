#pragma once

namespace ricochet::assets {

// The files of reports/assets/, put into the program by CMake.

extern const char* const kPageStyle;
extern const char* const kAnimationStyle;
extern const char* const kAnimationScript;

}  // namespace ricochet::assets
