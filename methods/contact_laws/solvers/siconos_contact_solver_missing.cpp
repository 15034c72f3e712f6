// The contact solver of Siconos where its library was not found.

#include "methods/contact_laws/solvers/contact_solver.h"

namespace ricochet {

bool has_siconos_contact_solver() {
  return false;
}

/// Never called: contact_solver_argument() declines.
std::unique_ptr<ContactSolver> make_siconos_contact_solver(double, int) {
  return nullptr;
}

}  // namespace ricochet
