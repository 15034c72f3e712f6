#include <gtest/gtest.h>

#include <random>

#include "tests/test_data.h"

namespace ricochet {
namespace {

/// Central difference of a vector function; fourth order, so the error is about h^4 |f^(5)| / 30 + eps |f| / h.
Matrix difference(const std::function<Vector(const Vector&)>& f, const Vector& x, double h = 1e-4) {
  Matrix J(f(x).size(), x.size());
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    const auto at = [&](int steps) {
      Vector moved = x;
      moved[k] += steps * h;
      return f(moved);
    };
    J.col(k) = (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * h);
  }
  return J;
}

/// With h = 1e-4, eps / h is near 1e-12, and h^4 is 1e-10 for a length of 3 cm: 100 for the size of derivatives (k =
/// 1e4 in some scenes).
constexpr double kDifference = 1e-8;

void expect_close(const Matrix& exact, const Matrix& approximate, const std::string& what) {
  const double size = 1 + exact.cwiseAbs().maxCoeff();
  EXPECT_LE((exact - approximate).cwiseAbs().maxCoeff(), kDifference * size) << what << "\n"
                                                                             << exact << "\n---\n"
                                                                             << approximate;
}

class Derivatives : public testing::TestWithParam<std::size_t> {
 protected:
  static const std::vector<NamedProblem>& problems() {
    static const auto list = all_problems();
    return list;
  }
  const Problem& problem() const { return *problems()[GetParam()].problem; }

  /// A state near the initial one, where no scene is singular.
  Vector near(const Vector& x, unsigned seed) const {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> shift(0.05, 0.3);
    Vector y = x;
    for (double& value : y) value += shift(random);
    return y;
  }
};

TEST_P(Derivatives, AgreeWithDifferencesOfTheValues) {
  const Problem& p = problem();
  const int n_q = p.n_q(), n_c = p.n_c();
  const auto& info = p.info();
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Vector q = near(info.q0, seed), v = near(info.v0, 10 + seed), a = near(Vector::Zero(n_q), 20 + seed);
    const Vector w = near(Vector::Zero(n_q), 30 + seed), w_c = near(Vector::Zero(n_c), 40 + seed);
    const Vector lambda_n = near(Vector::Zero(n_c), 50 + seed),
                 lambda_t = near(Vector::Zero(info.n_lambda_t), 60 + seed);

    expect_close(p.normal_jacobian(q).transpose(), difference([&](const Vector& x) { return p.gap(x); }, q), "J_n");

    Matrix f_q(n_q, n_q), f_v(n_q, n_q), Ma_q(n_q, n_q), Jl_q(n_q, n_q);
    p.force_jacobians(q.data(), v.data(), info.u.data(), f_q.data(), f_v.data());
    expect_close(f_q, difference([&](const Vector& x) { return p.force(x, v); }, q), "df/dq");
    expect_close(f_v, difference([&](const Vector& x) { return p.force(q, x); }, v), "df/dv");

    p.mass_derivative(q.data(), a.data(), Ma_q.data());
    expect_close(Ma_q, difference([&](const Vector& x) { return Vector(p.mass_matrix(x) * a); }, q), "d(M a)/dq");

    const auto contact_force = [&](const Vector& x) {
      return Vector(p.force_directions(p.normal_jacobian(x) * lambda_n + p.tangent_jacobian(x) * lambda_t));
    };
    p.contact_force_derivative(q.data(), lambda_n.data(), lambda_t.data(), Jl_q.data());
    expect_close(Jl_q, difference(contact_force, q), "d(J lambda)/dq");

    Vector bias(n_c);
    p.gap_acceleration_bias(q.data(), v.data(), bias.data());
    const Matrix gap_velocity =
        difference([&](const Vector& x) { return Vector(p.normal_jacobian(x).transpose() * v); }, q);
    if (n_c > 0) expect_close(bias, gap_velocity * v, "v' hess(f_c) v");

    Matrix slip_q(info.n_lambda_t, n_q);
    p.slip_velocity_derivative(q.data(), v.data(), slip_q.data());
    if (info.n_lambda_t > 0) {
      const auto slip = [&](const Vector& x) { return Vector(p.tangent_jacobian(x).transpose() * v); };
      expect_close(slip_q, difference(slip, q), "d(J_t'v)/dq");
    }

    Matrix H(n_q, n_q), H_dynamics(2 * n_q, 2 * n_q);
    p.gap_hessian(q.data(), w_c.data(), H.data());
    if (n_c > 0)
      expect_close(H, difference([&](const Vector& x) { return Vector(p.normal_jacobian(x) * w_c); }, q),
                   "hess(w'f_c)");

    // Gradient of w'(M a - f - J lambda) from the first derivatives, then one more difference.
    Vector state(2 * n_q);
    state << q, v;
    const auto gradient = [&](const Vector& x) {
      const Vector qx = x.head(n_q), vx = x.tail(n_q);
      Matrix fq(n_q, n_q), fv(n_q, n_q), mq(n_q, n_q), jq(n_q, n_q);
      p.force_jacobians(qx.data(), vx.data(), info.u.data(), fq.data(), fv.data());
      p.mass_derivative(qx.data(), a.data(), mq.data());
      p.contact_force_derivative(qx.data(), lambda_n.data(), lambda_t.data(), jq.data());
      Vector g(2 * n_q);
      g << (mq - fq - jq).transpose() * w, -fv.transpose() * w;
      return g;
    };
    p.dynamics_hessian(q.data(), v.data(), info.u.data(), a.data(), lambda_n.data(), lambda_t.data(), w.data(),
                       H_dynamics.data());
    expect_close(H_dynamics, difference(gradient, state), "hess(w'R)");
    EXPECT_LE((H_dynamics - H_dynamics.transpose()).cwiseAbs().maxCoeff(),
              1e-13 * (1 + H_dynamics.cwiseAbs().maxCoeff()))
        << "a Hessian is symmetric up to the rounding of two orders of differentiation";
  }
}

TEST_P(Derivatives, StructureIsWhatTheFormulasSay) {
  const Problem& p = problem();
  const auto& s = p.info().structure;
  const Vector q1 = near(p.info().q0, 1), q2 = near(p.info().q0, 2), v1 = near(p.info().v0, 3),
               v2 = near(p.info().v0, 4);
  if (s.constant_mass) EXPECT_EQ(p.mass_matrix(q1), p.mass_matrix(q2));
  if (s.diagonal_mass) EXPECT_TRUE(p.mass_matrix(q1).isDiagonal(0));
  if (!s.force_uses_velocity) EXPECT_EQ(p.force(q1, v1), p.force(q1, v2));
  if (!s.force_uses_position) EXPECT_EQ(p.force(q1, v1), p.force(q2, v1));
  const Matrix J1 = p.normal_jacobian(q1), J2 = p.normal_jacobian(q2);
  for (int i = 0; i < p.n_c(); ++i) {
    const auto& contact = p.info().contacts[i];
    if (contact.is_affine) EXPECT_EQ(J1.col(i), J2.col(i));
    for (int k = 0; k < p.n_q(); ++k) {
      const bool in_support = std::find(contact.support.begin(), contact.support.end(), k) != contact.support.end();
      if (!in_support) EXPECT_EQ(J1(k, i), 0) << contact.name << " does not touch coordinate " << k;
    }
    EXPECT_EQ(contact.n_t == 0, contact.mu == 0) << "no friction, no tangential variable";
  }
}

std::string problem_name(const testing::TestParamInfo<std::size_t>& info) {
  static const auto problems = all_problems();
  return problems[info.param].id;
}
INSTANTIATE_TEST_SUITE_P(AllProblems, Derivatives, testing::Range(std::size_t{0}, all_problems().size()), problem_name);

TEST(DerivativesOfKnownScenes, PendulumWallByHand) {
  const auto p = make_problem("pendulum_wall");
  const double theta = 0.37, omega = -1.3, l = 0.8, m = 1, g = 9.81;
  double f_q = 0, f_v = 1, J_n = 0, bias = 0;
  p->force_jacobians(&theta, &omega, nullptr, &f_q, &f_v);
  p->normal_jacobian(&theta, &J_n);
  p->gap_acceleration_bias(&theta, &omega, &bias);
  EXPECT_DOUBLE_EQ(f_q, -m * g * l * std::cos(theta));
  EXPECT_EQ(f_v, 0);
  EXPECT_DOUBLE_EQ(J_n, l * std::cos(theta));
  EXPECT_DOUBLE_EQ(bias, -l * std::sin(theta) * omega * omega);
}

TEST(DerivativesOfKnownScenes, FileAndCompiledSceneAgree) {
  const std::pair<const char*, const char*> pairs[] = {{"P1a_ball_e09", "bouncing_ball"},
                                                       {"P2_two_balls_spring", "two_balls_spring"},
                                                       {"P3_sliding_block", "sliding_block"},
                                                       {"P6a_oblique_slip", "oblique_impact"}};
  for (const auto& [file, scene] : pairs) {
    const auto a = ground_truth_problem(file), b = make_problem(scene);
    ASSERT_EQ(a->n_q(), b->n_q());
    EXPECT_EQ(a->info().q0, b->info().q0) << file;
    EXPECT_EQ(a->info().v0, b->info().v0) << file;
    EXPECT_EQ(a->info().end_time, b->info().end_time) << file;
    const Vector q = b->info().q0.array() + 0.123, v = b->info().v0.array() - 0.456;
    // One formula written twice: a few roundings of forces of size k |q| = 1e4.
    EXPECT_LE((a->force(q, v) - b->force(q, v)).cwiseAbs().maxCoeff(), 4e-16 * 1e4 * 2) << file;
    EXPECT_EQ(a->mass_matrix(q), b->mass_matrix(q)) << file;
    EXPECT_EQ(a->normal_jacobian(q), b->normal_jacobian(q)) << file;
    EXPECT_EQ(a->tangent_jacobian(q), b->tangent_jacobian(q)) << file;
  }
}

TEST(DerivativesOfKnownScenes, LeaveAFrictionlessSceneWithoutTangents) {
  for (const char* id : {"bouncing_ball", "two_balls_spring", "pendulum_wall"}) {
    const auto p = make_problem(id);
    EXPECT_EQ(p->info().n_tangent_entries, 0);
    EXPECT_EQ(p->info().n_lambda_t, 0);
  }
  const auto smooth_block = make_problem("sliding_block", {{"mu", 0}});
  EXPECT_EQ(smooth_block->info().n_lambda_t, 0) << "mu = 0 removes the tangents";
}

TEST(DerivativesOfKnownScenes, UnreadInputsMayBeNaN) {
  const auto p = make_problem("two_balls_spring");
  const double nan = std::nan(""), q[2] = {0.3, 1.2}, v[2] = {nan, nan};
  double f[2], f_q[4], f_v[4];
  p->force(q, v, nullptr, f);
  EXPECT_TRUE(std::isfinite(f[0]) && std::isfinite(f[1])) << "no velocity occurs in these forces";
  p->force_jacobians(v, v, nullptr, f_q, f_v);
  EXPECT_TRUE(std::isfinite(f_q[0])) << "the Jacobian is constant";
}

}  // namespace
}  // namespace ricochet
