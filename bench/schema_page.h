#pragma once

#include <string>

namespace ricochet {

/// The reference pages of scene files and of experiment files, in Markdown, made from their schemas: every field with
/// its type, unit and sign convention, and an example.
std::string scene_file_page();
std::string experiment_file_page();

}  // namespace ricochet
