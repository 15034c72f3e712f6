#include "methods/contact_laws/uniform_contacts.h"

#include <algorithm>

#include "problems/input_error.h"

namespace ricochet {

UniformContacts::UniformContacts(const ContactProblem& problem, int least) : dimension(least) {
  for (const auto& contact : problem.contacts) {
    if (contact.present != 0)
      throw InputError("contact problem: impulses that are already there have no place in (W, q, mu)");
    if (problem.law == FrictionLaw::associated && contact.n_t > 0)
      throw InputError("contact problem: Coulomb's law is required, not the associated one");
    dimension = std::max(dimension, 1 + contact.n_t);
  }
  std::vector<int> place(problem.G.n_rows());
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    for (int d = 0; d < dimension; ++d) {
      const int at = static_cast<int>(rows.size());
      const bool is_there = d < problem.G.size(i);
      rows.push_back(is_there ? problem.G.row(i) + d : -1);
      if (is_there)
        place[rows.back()] = at;
      else
        entries.emplace_back(at, at, problem.G.diagonal(i, 0));
    }
  }
  const SparseMatrix G = sparse_matrix(problem.G);
  for (int column = 0; column < G.outerSize(); ++column) {
    for (SparseMatrix::InnerIterator entry(G, column); entry; ++entry)
      entries.emplace_back(place[entry.row()], place[column], entry.value());
  }
  const auto m = static_cast<Eigen::Index>(rows.size());
  W.resize(m, m);
  W.setFromTriplets(entries.begin(), entries.end());
  q = pack(problem.b);
  mu.resize(problem.G.n_contacts());
  for (int i = 0; i < problem.G.n_contacts(); ++i) mu[i] = problem.contacts[i].n_t > 0 ? problem.contacts[i].mu : 0;
}

Vector UniformContacts::pack(const Vector& r) const {
  Vector uniform = Vector::Zero(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (rows[k] >= 0) uniform[static_cast<Eigen::Index>(k)] = r[rows[k]];
  }
  return uniform;
}

void UniformContacts::unpack(const Vector& uniform, Vector& r) const {
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (rows[k] >= 0) r[rows[k]] = uniform[static_cast<Eigen::Index>(k)];
  }
}

}  // namespace ricochet
