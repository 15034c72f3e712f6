// The geometry of a scene says the same as its formulas: gaps, normals, tangents, M and weight at random states.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "problems/derivatives/symbolic_problem.h"
#include "problems/geometry_kinematics.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

/// Products of a dozen sines and lengths, each rounded to 1e-16, in another order.
constexpr double kGeometryRounding = 1e-14;

std::vector<std::string> scenes_with_geometry() {
  std::vector<std::string> names;
  for (const auto& entry : scenes()) {
    if (make_problem(entry.id)->info().geometry) names.push_back(entry.id);
  }
  return names;
}

std::vector<double> numbers_of(const Vector& x) {
  return {x.begin(), x.end()};
}

Vector vector_of(const std::vector<double>& x) {
  return Eigen::Map<const Vector>(x.data(), static_cast<Eigen::Index>(x.size()));
}

class EveryGeometry : public testing::TestWithParam<std::string> {
 protected:
  /// Coordinates up to 1.2 from the start, where no box lies on its singular angle.
  Vector random_state() {
    std::uniform_real_distribution<double> shift(-1.2, 1.2);
    Vector q = problem->info().q0;
    for (double& x : q) x += shift(random);
    if (problem->info().clock >= 0) q[problem->info().clock] = 0;
    return q;
  }

  /// Balls on a line that have passed through each other: the formulas of such scenes go on with the order they began in.
  bool have_passed(const ShapePair& pair, double gap) const {
    const BodyShape& first = geometry.shapes[static_cast<std::size_t>(pair.first)];
    const BodyShape& second = geometry.shapes[static_cast<std::size_t>(pair.second)];
    return first.kind == ShapeKind::sphere && gap < -first.size[0] - second.size[0];
  }

  std::unique_ptr<Problem> problem = make_problem(GetParam());
  const ProblemInfo& info = problem->info();
  const Geometry& geometry = *info.geometry;
  std::mt19937 random{7};
};

TEST_P(EveryGeometry, NamesBodiesShapesAndContactsThatAreThere) {
  const auto n_bodies = static_cast<int>(geometry.bodies.size()), n_shapes = static_cast<int>(geometry.shapes.size());
  std::set<std::string> names;
  for (int i = 0; i < n_bodies; ++i) {
    const Body& body = geometry.bodies[static_cast<std::size_t>(i)];
    EXPECT_LT(body.parent, i);
    EXPECT_TRUE(names.insert(body.name).second) << body.name;
    for (const auto& entries : {body.position, body.angles}) {
      for (const PoseEntry& entry : entries) EXPECT_LT(entry.coordinate, info.n_mechanical());
    }
  }
  for (const BodyShape& shape : geometry.shapes) EXPECT_LT(shape.body, n_bodies);
  std::set<int> contacts;
  for (const ShapePair& pair : geometry.pairs) {
    EXPECT_LT(pair.first, n_shapes);
    EXPECT_LT(pair.second, n_shapes);
    EXPECT_LT(pair.contact, info.n_c());
    EXPECT_TRUE(contacts.insert(pair.contact).second) << "two pairs for contact " << pair.contact;
  }
}

TEST_P(EveryGeometry, HasTheGapsOfTheScene) {
  for (int sample = 0; sample < 20; ++sample) {
    const Vector q = random_state(), gap = problem->gap(q);
    const auto gaps = geometry_gaps<double>(geometry, numbers_of(q));
    for (std::size_t i = 0; i < gaps.size(); ++i) {
      const double expected = gap[geometry.pairs[i].contact];
      if (have_passed(geometry.pairs[i], expected)) continue;
      EXPECT_NEAR(gaps[i], expected, kGeometryRounding * (1 + std::abs(expected))) << "pair " << i;
    }
  }
}

TEST_P(EveryGeometry, HasTheNormalsOfTheScene) {
  for (int sample = 0; sample < 20; ++sample) {
    const Vector q = random_state(), gap = problem->gap(q);
    const Matrix J_n = problem->normal_jacobian(q);
    for (const ShapePair& pair : geometry.pairs) {
      if (have_passed(pair, gap[pair.contact])) continue;
      const Vector normal = vector_of(contact_of<double>(geometry, pair, numbers_of(q)).J_n);
      for (int k = 0; k < info.n_mechanical(); ++k) EXPECT_NEAR(normal[k], J_n(k, pair.contact), kGeometryRounding);
    }
  }
}

// Up to the choice of two directions in the plane of contact: J_t J_t' is the same, and with it |v_t| for every v.
TEST_P(EveryGeometry, HasTheSlipVelocitiesOfTheScene) {
  const int n = info.n_mechanical();
  for (int sample = 0; sample < 20; ++sample) {
    const Vector q = random_state();
    const Matrix J_t = problem->tangent_jacobian(q);
    for (const ShapePair& pair : geometry.pairs) {
      const ContactInfo& contact = info.contacts[static_cast<std::size_t>(pair.contact)];
      if (contact.n_t == 0) continue;
      Matrix ours = Matrix::Zero(n, n);
      for (const auto& direction : contact_of<double>(geometry, pair, numbers_of(q)).J_t) {
        const Vector t = vector_of(direction).head(n);
        ours += t * t.transpose();
      }
      const Matrix columns = J_t.middleCols(contact.tangent_index, contact.n_t).topRows(n);
      const Matrix expected = columns * columns.transpose();
      EXPECT_LE((ours - expected).cwiseAbs().maxCoeff(), kGeometryRounding * (1 + expected.cwiseAbs().maxCoeff()))
          << contact.name;
    }
  }
}

TEST_P(EveryGeometry, HasTheMassMatrixOfTheScene) {
  const int n = info.n_mechanical();
  for (int sample = 0; sample < 20; ++sample) {
    Vector q = random_state();
    if (info.id == "woodpecker_toy") q.setZero();  // M is that of small angles
    const Matrix M = problem->mass_matrix(q).topLeftCorner(n, n);
    const auto rows = mass_matrix_of<double>(geometry, numbers_of(q));
    for (int row = 0; row < n; ++row) {
      for (int column = 0; column < n; ++column)
        EXPECT_NEAR(rows[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)], M(row, column),
                    kGeometryRounding * M.cwiseAbs().maxCoeff());
    }
  }
}

TEST_P(EveryGeometry, HasTheWeightOfTheScene) {
  if (scenes_with_other_forces().contains(info.id)) GTEST_SKIP() << "other forces act, too";
  const int n = info.n_mechanical();
  for (int sample = 0; sample < 20; ++sample) {
    const Vector q = random_state(), f = problem->force(q, Vector::Zero(info.n_q)).head(n);
    const Vector weight = vector_of(weight_of<double>(geometry, numbers_of(q))).head(n);
    EXPECT_LE((weight - f).cwiseAbs().maxCoeff(), kGeometryRounding * (1 + f.cwiseAbs().maxCoeff()));
  }
}

INSTANTIATE_TEST_SUITE_P(Geometry, EveryGeometry, testing::ValuesIn(scenes_with_geometry()),
                         [](const auto& scene) { return scene.param; });

// What is no pair of shapes is a joint, or the linear kinematics of the woodpecker toy. Formulas alone: the ground truth.
TEST(Geometry, EverySceneHasOneAndAPairForEveryContact) {
  for (const auto& entry : scenes()) {
    if (std::ranges::find(ground_truth(), entry.id, &reference::GroundTruth::id) != ground_truth().end()) continue;
    const auto problem = make_problem(entry.id);
    ASSERT_TRUE(problem->info().geometry) << entry.id;
    if (entry.id == "woodpecker_toy") continue;
    EXPECT_EQ(problem->info().geometry->pairs.size(), problem->info().unilateral.size()) << entry.id;
  }
}

TEST(Geometry, FollowsTheParameters) {
  const auto problem = make_problem("rocking_block", {{"b", 0.25}, {"m", 3}});
  const Geometry& geometry = *problem->info().geometry;
  EXPECT_EQ(geometry.shapes[1].size[0], 0.25);
  EXPECT_EQ(geometry.bodies[0].mass, 3);
}

TEST(Geometry, FollowsParametersThatChangeLater) {
  const auto problem = make_problem("rocking_block");
  SymbolicProblem& symbolic = *problem->symbolic();
  symbolic.open_parameters();
  std::vector<double> values;
  for (const auto& parameter : problem->info().parameters)
    values.push_back(parameter.name == "b" ? 0.25 : parameter.value);
  ASSERT_TRUE(symbolic.set_parameters(values));
  const auto anew = make_problem("rocking_block", {{"b", 0.25}});
  EXPECT_EQ(problem->info().geometry->shapes[1].size, anew->info().geometry->shapes[1].size);
  EXPECT_EQ(problem->info().geometry->bodies[0].inertia, anew->info().geometry->bodies[0].inertia);
}

}  // namespace
}  // namespace ricochet
