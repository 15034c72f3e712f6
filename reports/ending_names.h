#pragma once

#include "problems/named_values.h"
#include "reports/verdict.h"

namespace ricochet {

/// Of a run in a process of its own, as results files spell them.
inline const Names<Ending> kEndings = {{"returned", Ending::returned},
                                       {"declined", Ending::declined},
                                       {"killed", Ending::killed},
                                       {"crashed", Ending::crashed}};

}  // namespace ricochet
