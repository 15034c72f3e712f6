#pragma once

#include <string>

namespace ricochet {

/// Where the program's data are, with the paths of the source tree (bench/experiments, reports/baselines, reference/data):
/// RICOCHET_DATA where that is set; share/ricochet beside the folder of an installed program; else the source tree that
/// it was built from, or /usr/share/ricochet where there is none.
std::string data_folder();

}  // namespace ricochet
