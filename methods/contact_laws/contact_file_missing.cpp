// Contact files where the library for them was not found.

#include "methods/contact_laws/contact_file.h"
#include "problems/input_error.h"

namespace ricochet {

void require_contact_files() {
  throw InputError("contact files are not built: libhdf5-dev not found");
}

StoredContactProblem read_contact_file(const std::string&) {
  require_contact_files();
  return {};
}

void write_contact_file(const StoredContactProblem&, const std::string&) {
  require_contact_files();
}

}  // namespace ricochet
