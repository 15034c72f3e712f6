#pragma once

#include <string>
#include <vector>

#include "reference/coulomb_enumeration.h"

namespace ricochet::reference {

/// Contacts that act at once, and the motion with their impulses or forces z: motion = free + MJ z. Rows are ordered as
/// in CoulombContact: normal, then tangents, contact after contact.
struct ContactQuestion {
  const char* what = "";  ///< name of the law, for messages
  std::vector<std::string> names;
  std::vector<CoulombContact> contacts;
  Matrix J, MJ;        ///< n_q x rows, M^-1 J under the bilateral constraints
  Vector free;         ///< n_q, motion without z
  Vector b, b_size;    ///< rows, u = J' MJ z + b; sizes of the terms of b
  bool stays = false;  ///< z are forces, which must stay within their cones for a while, not impulses
};

struct ContactAnswer {
  std::string failure;             ///< message, if the law does not determine the motion; else empty
  FailureReason reason;            ///< of the failure
  std::vector<ContactMode> modes;  ///< by contact
  Vector z, u;                     ///< rows
  Vector u_size;                   ///< rows, sizes of the terms of u
};

/// Solves Coulomb's law if it determines the motion. Groups of contacts that do not act on each other are solved
/// separately, so that their thresholds do not mix. Solutions with different z and the same motion are common, for
/// example for a rod whose ends stick; the one with the least sum_r G_rr z_r^2 is taken. For impulses this choice is
/// sufficient. Forces must remain admissible: a division inside all cones is searched, with every resting contact
/// sticking. If there is none, and the chosen forces are at the edge of a cone without slip, the law fails.
/// @return a failure if no modes fit ("inconsistent"), or several with different motions ("indeterminate")
ContactAnswer answer_coulomb_law(const ContactQuestion& question);

}  // namespace ricochet::reference
