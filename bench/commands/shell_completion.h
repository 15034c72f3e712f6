#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace ricochet {

/// Completions of the last word of a command line: commands, options and names of problems, methods and so on that
/// begin with it. They follow from the commands in `app`. None if the name of a file is expected.
/// @param words  after the name of the program; the last one, which may be empty, is completed
std::vector<std::string> completions(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace ricochet
