#pragma once

#include <string>
#include <vector>

namespace ricochet {

/// Loads plugins (plugin.h), in this order: those that come with the program; those of the folder plugins/ in $XDG_CONFIG_HOME/ricochet, or in
/// ~/.config/ricochet; those of RICOCHET_PLUGINS, separated by colons; and those of "--plugin FILE", which may stand
/// anywhere on the command line.
/// @param words  of the command line; "--plugin FILE" is taken out
/// @throws InputError for a file that is no plugin, has another interface, or registers a name that is there already
void load_plugins(std::vector<std::string>& words);

/// The files that were loaded, absolute.
const std::vector<std::string>& loaded_plugins();

}  // namespace ricochet
