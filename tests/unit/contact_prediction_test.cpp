#include "methods/contact_laws/contact_prediction.h"

#include <gtest/gtest.h>

#include <random>

namespace ricochet {
namespace {

/// A chain of n contacts, each with its neighbours: G = D' D of directions that two successive bodies share.
struct Chain {
  Chain(int n, int n_t, unsigned seed) : random(seed) {
    const int rows = 1 + n_t;
    Matrix D = Matrix::Zero(3 * (n + 1), n * rows);
    for (int i = 0; i < n; ++i) {
      for (int d = 0; d < rows; ++d) {
        D(3 * i + d, rows * i + d) = -1;
        D(3 * i + 3 + d, rows * i + d) = 1;
        for (int k = 0; k < 6; ++k) D(3 * i + k, rows * i + d) += 0.1 * number();
      }
    }
    dense = D.transpose() * D;
    sizes.assign(n, rows);
    G.set_sizes(sizes);
    for (int i = 0; i < n; ++i) {
      std::vector<int> neighbours;
      for (int j = std::max(0, i - 1); j <= std::min(n - 1, i + 1); ++j) neighbours.push_back(j);
      G.add_row(neighbours);
    }
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < G.n_neighbours(i); ++k) {
        Eigen::Map<Matrix>(G.values(i, k), rows, rows) =
            dense.block(rows * i, rows * G.block(i, k).contact, rows, rows);
      }
      contacts.push_back({.mu = n_t > 0 ? 0.3 : 0, .n_t = n_t});
    }
    b = Vector::NullaryExpr(n * rows, [&] { return number(); });
    for (int i = 0; i < n; ++i) b[rows * i] -= 0.4;  // most are pressed together
  }
  double number() { return 2.0 * random() / std::mt19937::max() - 1; }

  std::mt19937 random;
  Matrix dense;
  Delassus G;
  std::vector<int> sizes;
  Vector b;
  std::vector<FrictionProblem::Contact> contacts;
};

TEST(ContactPrediction, FindsTheForcesThatLemkesMethodFinds) {
  int solved = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    for (const int n_t : {0, 1}) {
      Chain chain(20, n_t, seed);
      if (n_t == 1) chain.contacts[3] = {.mu = 0.3, .n_t = 1, .slides = true, .direction = {-1, 0}};
      auto predicted = chain.contacts, pivoted = chain.contacts;
      Vector r(chain.b.size()), expected(chain.b.size());
      FrictionProblem lemke;
      lemke.resize(20, 20 * n_t);
      ASSERT_EQ(lemke.solve(chain.dense, chain.b, 1e-14, pivoted, expected), LcpStatus::solved);
      ContactPrediction prediction;
      if (!prediction.solve(chain.G, chain.b, 1e-14, predicted, r)) continue;
      ++solved;
      EXPECT_LT((r - expected).norm(), 1e-12 * expected.norm()) << "the condition of G is some hundreds";
      for (int i = 0; i < 20; ++i) EXPECT_EQ(predicted[i].mode, pivoted[i].mode) << "contact " << i;
    }
  }
  EXPECT_GE(solved, 70) << "of 80; a prediction that does not settle says so";
}

TEST(ContactPrediction, LeavesOpenWhatNothingPresses) {
  Chain chain(12, 0, 1);
  chain.b.setZero();
  Vector r(12);
  ContactPrediction prediction;
  ASSERT_TRUE(prediction.solve(chain.G, chain.b, 1e-14, chain.contacts, r));
  EXPECT_TRUE(r.isZero(0));
  for (const auto& contact : chain.contacts) EXPECT_EQ(contact.mode, ContactMode::open);
}

TEST(ContactPrediction, DeclinesRedundantContacts) {
  Chain chain(10, 0, 1);
  for (int i = 0; i < 10; ++i) {
    for (int k = 0; k < chain.G.n_neighbours(i); ++k) chain.G.values(i, k)[0] = 1;
  }
  // Each contact moves with its neighbours: rows 1 and 2 of G are those of 1, 2, 3 and 1, 2, 3, 4; contacts 9, 10
  // agree.
  chain.b.setConstant(-1);
  Vector r(10);
  ContactPrediction prediction;
  chain.G.values(8, 0)[0] = 0;
  EXPECT_FALSE(prediction.solve(chain.G, chain.b, 1e-14, chain.contacts, r));
}

}  // namespace
}  // namespace ricochet
