#pragma once

#include <vector>

#include "methods/contact_laws/contact_problem.h"
#include "methods/contact_laws/delassus_matrix.h"

namespace ricochet {

/// A contact problem as other programs state it, u = W r + q with Coulomb's law, where all contacts have the same
/// number of directions. A contact may have fewer: mu = 0, or it is in the plane beside others in space. Its missing
/// tangents get W_tt = W_nn, q_t = 0, which fulfil the law with zeros.
struct UniformContacts {
  int dimension = 0;  ///< directions of a contact, 1 to 3
  SparseMatrix W;     ///< compressed
  Vector q, mu;
  std::vector<int> rows;  ///< of each row of W, that of the problem, or -1

  /// @param least  dimension, at least. @throws InputError for what Coulomb's law on (W, q, mu) cannot express: the
  /// associated law with friction, impulses that are already there
  UniformContacts(const ContactProblem& problem, int least);

  Vector pack(const Vector& r) const;                   ///< with zeros for what is missing
  void unpack(const Vector& uniform, Vector& r) const;  ///< r: its first G.n_rows()
};

}  // namespace ricochet
