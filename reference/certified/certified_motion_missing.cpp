#include "reference/certified/certified_motion.h"

// In place of certified_motion.cpp where Arb is not installed.

namespace ricochet::reference::certified {

CertifiedMotion certified_motion(const Problem&, const Options& options) {
  CertifiedMotion motion;
  motion.reason = "this program was built without Arb (Debian's libflint-arb-dev)";
  motion.reading = options.reading;
  return motion;
}

bool can_certify() {
  return false;
}

}  // namespace ricochet::reference::certified
