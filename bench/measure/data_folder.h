#pragma once

#include <string>

namespace ricochet {

/// Folder of the program's data, with the paths of the source tree (bench/experiments, reports/baselines, ...): the
/// value of RICOCHET_DATA if it is set; share/ricochet beside the folder of an installed program; else the source tree
/// from which it was built, or /usr/share/ricochet if that does not exist.
std::string data_folder();

/// Path of a file in data_folder(); a path that exists is returned unchanged.
std::string find_project_file(const std::string& path);

}  // namespace ricochet
