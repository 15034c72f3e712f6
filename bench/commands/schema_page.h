#pragma once

#include <string>

namespace ricochet {

/// The reference pages of scene files, of experiment files and of what `ricochet run --json` prints, in Markdown, made from their schemas: every field with
/// its type, unit and sign convention, and an example.
std::string scene_file_page();
std::string experiment_file_page();
std::string run_page();

}  // namespace ricochet
