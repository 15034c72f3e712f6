#include "problems/input_error.h"
#include "reference/certified/certificate.h"

// In place of certified_motion.cpp where Arb is not installed.

namespace ricochet::reference::certified {

CertifiedMotion certified_motion(const Problem&, const Options& options) {
  CertifiedMotion motion;
  motion.reason = "this program was built without Arb (Debian's libflint-arb-dev)";
  motion.reading = options.reading;
  return motion;
}

Certificate certificate_of(const Problem&, const CertifiedMotion& motion, const Options&) {
  throw InputError("no certificate: " + motion.reason);
}

CertificateReport check_certificate(const Certificate&, bool, double) {
  CertificateReport report;
  report.reason = "this program was built without Arb (Debian's libflint-arb-dev)";
  return report;
}

bool can_certify() {
  return false;
}

}  // namespace ricochet::reference::certified
