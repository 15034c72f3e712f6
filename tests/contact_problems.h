#pragma once

#include <random>
#include <vector>

#include "methods/contact_laws/delassus_matrix.h"
#include "methods/contact_laws/solvers/contact_solver.h"

namespace ricochet {

/// The operator from its dense matrix: blocks that are zero are left out.
inline void set_operator(ContactProblem& problem, const Matrix& G,
                         const std::vector<ContactProblem::Contact>& contacts) {
  problem.contacts = contacts;
  std::vector<int> sizes;
  for (const auto& contact : contacts) sizes.push_back(1 + contact.n_t);
  set_operator(problem.G, sizes, SparseMatrix(G.sparseView(0, 0)));
}

/// n_c contacts on a body of n_q coordinates: G = J' J, singular when there are more rows than coordinates.
inline ContactProblem random_problem(FrictionLaw law, int n_c, int n_t, int n_q, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Matrix J(n_q, n_c * (1 + n_t));
  for (auto& entry : J.reshaped()) entry = uniform(generator);
  Vector v(n_q);
  for (auto& entry : v) entry = uniform(generator);
  std::vector<ContactProblem::Contact> contacts;
  for (int i = 0; i < n_c; ++i)
    contacts.push_back({.id = i, .n_t = n_t, .mu = n_t > 0 ? 0.1 + std::abs(uniform(generator)) : 0});
  ContactProblem problem;
  problem.law = law;
  set_operator(problem, J.transpose() * J, contacts);
  problem.b = J.transpose() * v;
  return problem;
}

struct SolverAnswer {
  ContactStatus status = ContactStatus::iteration_limit;
  Vector r, w;
  double violation = 0;
};

/// From r = 0.
inline SolverAnswer solve(ContactSolver& solver, const ContactProblem& problem) {
  SolverAnswer answer;
  answer.r = answer.w = Vector::Zero(problem.G.n_rows());
  answer.status = solver.solve(problem, answer.r);
  problem.G.times(answer.r, problem.b, answer.w);
  answer.violation = violation(problem, answer.r, answer.w, solver.polygon());
  return answer;
}

}  // namespace ricochet
