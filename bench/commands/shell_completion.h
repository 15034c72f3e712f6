#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace ricochet {

/// What may take the place of the last word of a command line: commands, options and the names of what there is, as
/// far as they begin with that word. They follow from the commands in `app`; nothing is listed a second time.
/// @param words  behind the name of the program; the last one, which may be empty, is completed
/// Empty where the name of a file is expected.
std::vector<std::string> completions(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace ricochet
