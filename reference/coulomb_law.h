#pragma once

#include <string>
#include <vector>

#include "reference/coulomb_enumeration.h"

namespace ricochet::reference {

/// Contacts that act at once, and the motion that their impulses or forces z leave: motion = free + MJ z. Rows as in
/// CoulombContact: normal, then tangents, contact after contact.
struct ContactQuestion {
  const char* what = "";  ///< law, for messages
  std::vector<std::string> names;
  std::vector<CoulombContact> contacts;
  Matrix J, MJ;        ///< n_q x rows, M^-1 J under the bilateral constraints
  Vector free;         ///< n_q, motion without z
  Vector b, b_size;    ///< rows, u = J' MJ z + b; sizes of the terms of b
  bool stays = false;  ///< forces that have to stay within their cones for a while, instead of impulses
};

struct ContactAnswer {
  std::string failure;             ///< why the law decides nothing; empty when it does
  std::vector<ContactMode> modes;  ///< by contact
  Vector z, u;                     ///< rows
  Vector u_size;                   ///< rows, sizes of the terms of u
};

/// Coulomb's law where it determines the motion. Groups of contacts that do not act on each other are asked one by one,
/// so that none lends its sizes to another. Solutions with different impulses or forces and the same motion are common,
/// a rod whose ends stick has them: the least is taken, sum_r G_rr z_r^2. As impulses they are as good as any. Forces
/// have to go on: a division that is inside all cones is looked for, with every contact that rests sticking; where
/// there is none and those that are taken are at the edge of a cone without slip, the law fails.
/// @return a failure where no mode fits ("inconsistent"), or several with different motions do ("indeterminate")
ContactAnswer answer_coulomb_law(const ContactQuestion& question);

}  // namespace ricochet::reference
