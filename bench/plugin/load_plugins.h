#pragma once

#include <string>
#include <vector>

namespace ricochet {

/// Loads plugins (plugin.h) in this order: those installed with the program; those in the folder plugins/ of
/// $XDG_CONFIG_HOME/ricochet or ~/.config/ricochet; those in RICOCHET_PLUGINS, separated by colons; and those of
/// "--plugin FILE", anywhere on the command line.
/// @param words  of the command line; "--plugin FILE" is removed
/// @throws InputError for a file that is not a plugin, has another interface, or registers an existing name
void load_plugins(std::vector<std::string>& words);

/// Absolute paths of the loaded files.
const std::vector<std::string>& loaded_plugins();

}  // namespace ricochet
