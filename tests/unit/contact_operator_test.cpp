#include "methods/contact_laws/contact_operator.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

#include "methods/contact_laws/mass_inverse.h"
#include "methods/linear_algebra/block_inverse.h"
#include "problems/registry.h"

namespace ricochet {
namespace {

/// D, P W D and G = D' P W D of all contacts of a scene, formed with full matrices.
struct DenseOperator {
  DenseOperator(const Problem& problem, const Vector& q, const Matrix& W) {
    const ProblemInfo& info = problem.info();
    const Matrix J_n = problem.normal_jacobian(q), J_t = problem.tangent_jacobian(q);
    for (const auto& contact : info.contacts) {
      first.push_back(static_cast<int>(rates.cols()));
      rates.conservativeResize(info.n_q, rates.cols() + 1 + contact.n_t);
      rates.col(first.back()) = J_n.col(static_cast<Eigen::Index>(first.size()) - 1);
      for (int d = 0; d < contact.n_t; ++d) rates.col(first.back() + 1 + d) = J_t.col(contact.tangent_index + d);
    }
    Matrix P = Matrix::Identity(info.n_q, info.n_q);
    if (info.has_bilateral()) {
      const Matrix C = J_n(Eigen::all, info.bilateral), WC = W * problem.force_directions(C);
      P -= WC * (C.transpose() * WC).inverse() * C.transpose();
      reactions = -(C.transpose() * WC).inverse() * C.transpose() * W * problem.force_directions(rates);
    }
    responses = P * W * problem.force_directions(rates);
    G = rates.transpose() * responses;
  }

  std::vector<int> first;  // column of the normal of each contact
  Matrix rates{0, 0}, responses, G, reactions;
};

Matrix inverse_of(const BlockInverse& W, int n) {
  Matrix dense(n, n);
  Vector x(n), y(n);
  for (int k = 0; k < n; ++k) {
    x = Vector::Unit(n, k);
    W.apply(x, y);
    dense.col(k) = y;
  }
  return dense;
}

/// The matrix and the operator round as their largest entries do, through inverses of M and of bilateral constraints.
double rounding(const Matrix& A) {
  return 1e-11 * A.cwiseAbs().maxCoeff();
}

/// Everything the operator says of these contacts, against the dense one.
void expect_equal(ContactOperator& op, const DenseOperator& dense, std::span<const int> contacts,
                  const Problem& problem) {
  const ProblemInfo& info = problem.info();
  Delassus G;
  op.assemble(contacts, G);
  Matrix sparse(G.n_rows(), G.n_rows());
  G.to_dense(sparse);
  const double G_rounding = rounding(dense.G), W_rounding = rounding(dense.responses);
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const int i = contacts[k], row = G.row(static_cast<int>(k));
    for (std::size_t l = 0; l < contacts.size(); ++l) {
      const int j = contacts[l], column = G.row(static_cast<int>(l));
      const Matrix block = dense.G.block(dense.first[i], dense.first[j], 1 + op.n_t(i), 1 + op.n_t(j));
      EXPECT_LE((sparse.block(row, column, block.rows(), block.cols()) - block).cwiseAbs().maxCoeff(), G_rounding)
          << info.contacts[i].name << ", " << info.contacts[j].name;
    }
    for (int d = 0; d <= op.n_t(i); ++d) {
      const Vector x = Vector::LinSpaced(info.n_q, -1, 2), D = dense.rates.col(dense.first[i] + d);
      EXPECT_NEAR(op.dot(i, d, x), D.dot(x), rounding(D));
      EXPECT_NEAR(op.terms(i, d, x), D.cwiseAbs().dot(x.cwiseAbs()), rounding(D));
      Vector pushed = x, size = Vector::Zero(info.n_q), impulses = Vector::Zero(info.n_c());
      op.push(i, d, -3, pushed, impulses);
      op.add_size(i, d, -3, size);
      const Vector response = dense.responses.col(dense.first[i] + d);
      EXPECT_LE((pushed - x + 3 * response).lpNorm<Eigen::Infinity>(), 3 * W_rounding);
      EXPECT_LE((size - 3 * response.cwiseAbs()).lpNorm<Eigen::Infinity>(), 3 * W_rounding);
      for (std::size_t b = 0; b < info.bilateral.size(); ++b)
        EXPECT_NEAR(impulses[info.bilateral[b]], -3 * dense.reactions(b, dense.first[i] + d),
                    3 * rounding(dense.reactions));
      for (int e = 0; e <= op.n_t(i); ++e)
        EXPECT_NEAR(op.own_delassus(i, e, d), dense.G(dense.first[i] + e, dense.first[i] + d), G_rounding);
    }
  }
  // Contacts of two islands do not move each other.
  Islands islands;
  op.find_islands(contacts, islands);
  ASSERT_EQ(islands.n(), static_cast<int>(contacts.size()));
  for (int k = 0; k < islands.n(); ++k) {
    for (int l = 0; l < islands.n(); ++l) {
      if (islands.of(k) == islands.of(l)) continue;
      EXPECT_EQ(sparse.block(G.row(k), G.row(l), G.size(k), G.size(l)).cwiseAbs().maxCoeff(), 0);
    }
  }
}

class OperatorOfScene : public testing::TestWithParam<std::string> {
 protected:
  const std::unique_ptr<Problem> problem_ = make_problem(GetParam());
  const ProblemInfo& info_ = problem_->info();
  std::mt19937 random_{1};

  /// The initial position, changed by some millimetres and milliradians, so that no entry is there by chance.
  Vector position() {
    std::uniform_real_distribution<double> number(-3e-3, 3e-3);
    Vector q = info_.q0;
    for (int k = 0; k < info_.n_mechanical(); ++k) q[k] += number(random_);
    return q;
  }
};

TEST_P(OperatorOfScene, HasTheOperatorOfItsMassMatrix) {
  Counters counters;
  MassInverse W(*problem_, counters);
  ContactOperator op(*problem_);
  for (int k = 0; k < 3; ++k) {
    const Vector q = position();
    ASSERT_TRUE(W.set_position(q));
    op.set_directions(q);
    ASSERT_TRUE(op.set_responses(info_.unilateral, W));
    const DenseOperator dense(*problem_, q, problem_->mass_matrix(q).inverse());
    expect_equal(op, dense, info_.unilateral, *problem_);
    // Some contacts only, after all of them: nothing is left of the others.
    std::vector<int> some;
    for (std::size_t s = 0; s < info_.unilateral.size(); s += 2) some.push_back(info_.unilateral[s]);
    expect_equal(op, dense, some, *problem_);
  }
}

/// An iteration matrix is not symmetric and couples more: here each coordinate with the next but one.
TEST_P(OperatorOfScene, HasTheOperatorOfAnIterationMatrix) {
  const Vector q = position();
  Matrix A = problem_->mass_matrix(q);
  const double size = A.diagonal().minCoeff();
  for (int k = 0; k + 2 < info_.n_mechanical(); k += 3) A(k, k + 2) += 0.2 * size;
  BlockInverse W;
  ContactOperator op(*problem_);
  op.set_directions(q);
  for (const Matrix& matrix : {problem_->mass_matrix(q), A}) {  // the islands change in between
    W.compute(matrix, info_.has_bilateral());
    ASSERT_TRUE(op.set_responses(info_.unilateral, W));
    expect_equal(op, DenseOperator(*problem_, q, inverse_of(W, info_.n_q)), info_.unilateral, *problem_);
  }
}

std::vector<std::string> scenes_with_contacts() {
  std::vector<std::string> names;
  for (const auto& scene : scenes()) {
    if (!make_problem(scene.id)->info().unilateral.empty()) names.push_back(scene.id);
  }
  return names;
}

INSTANTIATE_TEST_SUITE_P(ContactOperator, OperatorOfScene, testing::ValuesIn(scenes_with_contacts()),
                         [](const auto& test) { return test.param; });

/// n beads in a row have contacts with their neighbours only: a band of blocks, not n^2 of them.
TEST(ContactOperators, AreSparseInAChain) {
  const int n = 60;
  const auto problem = make_problem("bead_row", {{"n", n}});
  const ProblemInfo& info = problem->info();
  Counters counters;
  MassInverse W(*problem, counters);
  ContactOperator op(*problem);
  op.set_directions(info.q0);
  ASSERT_TRUE(op.set_responses(info.unilateral, W));
  Delassus G;
  op.assemble(info.unilateral, G);
  EXPECT_EQ(G.n_contacts(), info.n_c());
  EXPECT_EQ(G.n_blocks(), 3 * info.n_c() - 2);
  expect_equal(op, DenseOperator(*problem, info.q0, problem->mass_matrix(info.q0).inverse()), info.unilateral,
               *problem);
  Islands islands;
  op.find_islands(info.unilateral, islands);
  EXPECT_EQ(islands.count(), 1);
}

/// Without tangents the operator has the normals only.
TEST(ContactOperators, LeaveFrictionOutWhereTold) {
  const auto problem = make_problem("box_3d");
  const ProblemInfo& info = problem->info();
  Counters counters;
  MassInverse W(*problem, counters);
  ASSERT_TRUE(W.set_position(info.q0));
  ContactOperator op(*problem, true);
  op.set_directions(info.q0);
  ASSERT_TRUE(op.set_responses(info.unilateral, W));
  Delassus G;
  op.assemble(info.unilateral, G);
  ASSERT_EQ(G.n_rows(), static_cast<int>(info.unilateral.size()));
  Matrix sparse(G.n_rows(), G.n_rows());
  G.to_dense(sparse);
  const Matrix J_n = problem->force_directions(problem->normal_jacobian(info.q0))(Eigen::all, info.unilateral);
  const Matrix dense = J_n.transpose() * problem->mass_matrix(info.q0).inverse() * J_n;
  EXPECT_LE((sparse - dense).cwiseAbs().maxCoeff(), rounding(dense));
}

TEST(ContactOperators, RefuseDependentBilateralConstraints) {
  const auto problem = make_problem("pendulum_wall_cartesian");
  const ProblemInfo& info = problem->info();
  ContactOperator op(*problem);
  op.set_directions(Vector::Zero(info.n_q));  // the rod has no length there, and its constraint no gradient
  Counters counters;
  MassInverse W(*problem, counters);
  EXPECT_FALSE(op.set_responses(info.unilateral, W));
}

}  // namespace
}  // namespace ricochet
