#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "methods/contact_laws/impact_laws/lzb_impact.h"
#include "methods/contact_laws/impact_laws/planar_impact.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

constexpr double kRounding = 1e-14;  // a few operations on numbers of size 1

PlanarImpact struck(ImpactHypothesis law, const PlanarContact& contact, PlanarPair w) {
  const auto impact = planar_impact(law, contact, w);
  EXPECT_TRUE(impact) << name_of(law);
  return impact.value_or(PlanarImpact{});
}

// Darboux' equation by small increments of the normal impulse, friction along the slip of each: an integration that
// knows nothing of the stop.
PlanarPair by_increments(const PlanarContact& k, PlanarPair w, bool is_stronge) {
  const double dp = 1e-5;
  double p = 0, p_c = 0, work = 0, compression = 0;
  for (bool compressing = true;; p += dp) {
    if (compressing && w.n >= 0) {
      compressing = false;
      p_c = p;
      compression = std::exchange(work, 0);
    }
    if (!compressing && (is_stronge ? work >= -k.e * k.e * compression : p >= (1 + k.e) * p_c)) return w;
    const double stopping = -(w.t + k.c * dp) / k.b, friction = std::clamp(stopping, -k.mu * dp, k.mu * dp);
    const double before = w.n;
    w = {w.n + k.a * dp + k.c * friction, w.t + k.c * dp + k.b * friction};
    work += dp * (before + w.n) / 2;
  }
}

// The contact of Kane's double pendulum at 20 and 30 degrees, m = l = 1, and what its kinetic energy was.
struct KanesContact {
  PlanarContact contact{};
  PlanarPair w{};
  double energy = 0;
};

KanesContact kanes_contact(double e, double mu) {
  const double t1 = M_PI / 9, t2 = M_PI / 6, v1 = -0.1, v2 = -0.2;
  const double m11 = 4.0 / 3, m12 = std::cos(t1 - t2) / 2, m22 = 1.0 / 3, D = m11 * m22 - m12 * m12;
  const double n1 = std::sin(t1), n2 = std::sin(t2), s1 = std::cos(t1), s2 = std::cos(t2);
  const auto dot = [&](double x1, double x2, double y1, double y2) {
    return (m22 * x1 * y1 - m12 * (x1 * y2 + x2 * y1) + m11 * x2 * y2) / D;
  };
  return {{dot(n1, n2, n1, n2), dot(s1, s2, s1, s2), dot(n1, n2, s1, s2), e, mu},
          {n1 * v1 + n2 * v2, s1 * v1 + s2 * v2},
          (m11 * v1 * v1 + 2 * m12 * v1 * v2 + m22 * v2 * v2) / 2};
}

// a = 2, b = c = 1, mu = 1/2, w- = (-1, -3/10): slip stops at p_n = 1/5 with w_n = -1/2 and reverses; from there w_n
// grows by 3/2 and w_t by 1/2 per impulse, so that p_c = 8/15 and the work of compression is -3/20 - 1/12 = -7/30.
TEST(PlanarImpact, HandDerivedReversal) {
  const PlanarContact contact{2, 1, 1, 0.5, 0.5};
  const PlanarPair w{-1, -0.3};
  const auto newton = struck(ImpactHypothesis::newton, contact, w);  // slides forwards: (2 - 1/2) p_n = 3/2
  EXPECT_NEAR(newton.p.n, 1, kRounding);
  EXPECT_NEAR(newton.w.n, 0.5, kRounding);
  EXPECT_NEAR(newton.w.t, 0.2, kRounding);
  const auto poisson = struck(ImpactHypothesis::poisson, contact, w);  // p_n^C = 2/3, slides in both phases
  EXPECT_NEAR(poisson.p.n, 1, kRounding);
  EXPECT_NEAR(poisson.w.t, 0.2, kRounding);
  const auto routh = struck(ImpactHypothesis::routh, contact, w);
  EXPECT_NEAR(routh.p.n, 0.8, kRounding);
  EXPECT_NEAR(routh.w.n, 0.4, kRounding);
  EXPECT_NEAR(routh.w.t, 0.3, kRounding);
  const auto stronge = struck(ImpactHypothesis::stronge, contact, w);  // 3/4 x^2 = e^2 7/30
  EXPECT_NEAR(stronge.p.n, 8.0 / 15 + 0.5 * std::sqrt(14.0 / 45), kRounding);
  EXPECT_NEAR(stronge.w.n, 0.75 * std::sqrt(14.0 / 45), kRounding);
}

// The same contact with e = 9/10 and w_t- = -3/5: Newton's law gives p_n = 19/15, w_t+ = 1/30, and gains 209/1800 J.
// Poisson's first phase just sticks, p^C = (2/5, 1/5), and its second slides, p^E = (9/25, -9/50).
TEST(PlanarImpact, HandDerivedGain) {
  const PlanarContact contact{2, 1, 1, 0.9, 0.5};
  const PlanarPair w{-1, -0.6};
  const auto newton = struck(ImpactHypothesis::newton, contact, w);
  EXPECT_NEAR(newton.w.t, 1.0 / 30, kRounding);
  EXPECT_NEAR(energy_change(newton, w), 209.0 / 1800, kRounding);
  const auto poisson = struck(ImpactHypothesis::poisson, contact, w);
  EXPECT_NEAR(poisson.p.n, 0.76, kRounding);
  EXPECT_NEAR(poisson.w.n, 0.54, kRounding);
  EXPECT_NEAR(energy_change(poisson, w), -0.179, kRounding);
  EXPECT_LT(energy_change(struck(ImpactHypothesis::stronge, contact, w), w), 0);
}

// e = mu = 1/2: the kinetic energy grows by 59 % under Newton's law, as in the text of the scene, and under no other.
TEST(PlanarImpact, KanesPendulum) {
  const auto kane = kanes_contact(0.5, 0.5);
  const auto gain = [&](ImpactHypothesis law) {
    return energy_change(struck(law, kane.contact, kane.w), kane.w) / kane.energy;
  };
  EXPECT_NEAR(gain(ImpactHypothesis::newton), 0.59, 0.005);  // as printed, to two digits
  EXPECT_LT(gain(ImpactHypothesis::poisson), 0);
  EXPECT_LT(gain(ImpactHypothesis::routh), 0);
  EXPECT_LT(gain(ImpactHypothesis::stronge), 0);
}

TEST(PlanarImpact, PathIsThatOfSmallIncrements) {
  const double increment = 1e-4;                // ten increments of impulse, by which its end and its stop are missed
  const PlanarContact jam{1, 20, 4, 0.5, 0.8};  // a < mu c: w_n falls while it slips
  const auto kane = kanes_contact(0.5, 0.5);
  const std::pair<PlanarContact, PlanarPair> cases[]{
      {kane.contact, kane.w}, {{2, 1, 1, 0.9, 0.5}, {-1, -0.6}}, {jam, {-1, 0.7}}, {jam, {-1, -0.7}}};
  for (const auto& [contact, w] : cases) {
    const PlanarPair routh = by_increments(contact, w, false), stronge = by_increments(contact, w, true);
    EXPECT_NEAR(struck(ImpactHypothesis::routh, contact, w).w.n, routh.n, increment * contact.a);
    EXPECT_NEAR(struck(ImpactHypothesis::routh, contact, w).w.t, routh.t, increment * contact.b);
    EXPECT_NEAR(struck(ImpactHypothesis::stronge, contact, w).w.n, stronge.n, increment * contact.a);
    EXPECT_NEAR(struck(ImpactHypothesis::stronge, contact, w).w.t, stronge.t, increment * contact.b);
  }
}

TEST(PlanarImpact, LawsAgreeWithoutFriction) {
  const PlanarContact contact{2, 3, 1, 0.7, 0};
  for (const auto law : kPlanarHypotheses) {
    const auto impact = struck(law, contact, {-1.5, 0.4});
    EXPECT_NEAR(impact.w.n, 0.7 * 1.5, kRounding) << name_of(law);
    EXPECT_NEAR(impact.p.t, 0, kRounding) << name_of(law);
  }
}

// (8) bounds the energy for every contact; Newton's law is seen to gain it for some.
TEST(PlanarImpact, StrongeNeverGainsAndNewtonMay) {
  std::mt19937 random(18);
  std::uniform_real_distribution<double> unit(0, 1);
  int newton_gains = 0;
  for (int k = 0; k < 20000; ++k) {
    const double a = 0.1 + unit(random), b = 0.1 + unit(random);
    const double c = (2 * unit(random) - 1) * 0.99 * std::sqrt(a * b);
    const PlanarContact contact{a, b, c, unit(random), 2 * unit(random)};
    const PlanarPair w{-unit(random), 4 * unit(random) - 2};
    const auto stronge = struck(ImpactHypothesis::stronge, contact, w);
    EXPECT_LE(energy_change(stronge, w), 1e-12);  // rounding of products of impulses up to 1e2
    EXPECT_GE(stronge.w.n, 0);
    if (const auto newton = planar_impact(ImpactHypothesis::newton, contact, w))
      newton_gains += energy_change(*newton, w) > 1e-9;
  }
  EXPECT_GT(newton_gains, 0);
}

TEST(PlanarImpact, RefusesWhatIsNoContact) {
  const auto law = ImpactHypothesis::stronge;
  EXPECT_THROW(planar_impact(law, {1, 1, 1.5, 0.5, 0.5}, {-1, 0}), InputError);
  EXPECT_THROW(planar_impact(law, {1, 1, 0, 1.5, 0.5}, {-1, 0}), InputError);
  EXPECT_THROW(planar_impact(law, {1, 1, 0, 0.5, -1}, {-1, 0}), InputError);
}

// G of n beads of mass 1 that touch; contact i lies between beads i and i + 1, w_i = v_(i + 1) - v_i.
Matrix chain(int n) {
  Matrix G = Matrix::Zero(n - 1, n - 1);
  for (int i = 0; i < n - 1; ++i) {
    G(i, i) = 2;
    if (i > 0) G(i, i - 1) = G(i - 1, i) = -1;
  }
  return G;
}

Vector struck_beads(const LzbImpact& impact, int n) {  // the first had velocity 1
  Vector v = Vector::Zero(n);
  v[0] = 1;
  for (int i = 0; i < n - 1; ++i) {
    v[i] -= impact.P[i];
    v[i + 1] += impact.P[i];
  }
  return v;
}

LzbImpact cradle(int n, double eta, double e) {
  Vector w = Vector::Zero(n - 1);
  w[0] = -1;
  return lzb_impact({Vector::Ones(n - 1), Vector::Constant(n - 1, e), eta}, chain(n), w);
}

// Beads with springs of exponent eta between them, positions in place of compressions, by Runge-Kutta steps.
Vector beads_with_springs(int n, double eta, double K) {
  Vector x = Vector::Zero(n), v = Vector::Zero(n);
  v[0] = 1;
  const auto acceleration = [&](const Vector& q) {
    Vector f = Vector::Zero(n);
    for (int i = 0; i < n - 1; ++i) {
      const double force = K * std::pow(std::max(q[i] - q[i + 1], 0.0), eta);
      f[i] -= force;
      f[i + 1] += force;
    }
    return f;
  };
  const double duration = std::pow(K, -1 / (eta + 1)), h = 2e-4 * duration;
  for (int k = 0; k < 150000; ++k) {  // 30 durations of a contact
    const Vector a1 = acceleration(x), x2 = x + h / 2 * v, a2 = acceleration(x2), x3 = x2 + h * h / 4 * a1;
    const Vector a3 = acceleration(x3), a4 = acceleration(x + h * v + h * h / 2 * a2);
    x += h * v + h * h / 6 * (a1 + a2 + a3);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return v;
}

TEST(LzbImpact, OneContactHasNewtonsRestitution) {
  for (const double eta : {1.0, 1.5, 2.0}) {
    Vector w(1);
    w << -2;
    const auto impact = lzb_impact({Vector::Ones(1), Vector::Constant(1, 0.6), eta}, Matrix::Constant(1, 1, 3), w);
    EXPECT_NEAR(impact.w[0], 1.2, 1e-8) << eta;  // 2000 steps of order at least 5/2
  }
}

// Three equal beads, linear springs: the frequencies 1 and sqrt(3) until the first contact opens at t_1, then sqrt(2)
// until the second does. v_1 = 1/3 + cos(t) / 2 + cos(sqrt(3) t) / 6 stays from t_1 on.
TEST(LzbImpact, ThreeBeadsWithLinearSpringsInClosedForm) {
  const double r = std::sqrt(3);
  double before = 1.5, after = 3.1;  // delta_1 = sin(t) / 2 + sin(r t) / (2 r) changes its sign in between
  for (int k = 0; k < 60; ++k) {
    const double t = (before + after) / 2;
    (std::sin(t) / 2 + std::sin(r * t) / (2 * r) > 0 ? before : after) = t;
  }
  const double t = before, v1 = 1.0 / 3 + std::cos(t) / 2 + std::cos(r * t) / 6;
  const double v2 = (1 - std::cos(r * t)) / 3, v3 = 1.0 / 3 - std::cos(t) / 2 + std::cos(r * t) / 6;
  const double delta2 = std::sin(t) / 2 - std::sin(r * t) / (2 * r);
  const double mean = (v2 + v3) / 2, relative = std::hypot(v3 - v2, std::sqrt(2) * delta2);  // energy of the pair
  const Vector v = struck_beads(cradle(3, 1, 1), 3);
  EXPECT_NEAR(v[0], v1, 1e-9);
  EXPECT_NEAR(v[1], mean - relative / 2, 1e-9);
  EXPECT_NEAR(v[2], mean + relative / 2, 1e-9);
}

// Hertz's springs: the law is the limit of stiff springs, at any stiffness the same.
TEST(LzbImpact, CradleIsTheLimitOfHertzSprings) {
  for (const int n : {3, 4, 5}) {
    const Vector law = struck_beads(cradle(n, 1.5, 1), n), springs = beads_with_springs(n, 1.5, 1e8);
    EXPECT_LT((law - springs).cwiseAbs().maxCoeff(), 1e-6) << law.transpose() << " / " << springs.transpose();
  }
}

TEST(LzbImpact, KeepsMomentumAndLosesEnergy) {
  for (const double e : {0.3, 0.6, 0.9, 1.0}) {
    const Vector v = struck_beads(cradle(5, 1.5, e), 5);
    EXPECT_NEAR(v.sum(), 1, 1e-12);
    if (e < 1) {
      EXPECT_LT(v.squaredNorm(), 1);
    } else {
      EXPECT_NEAR(v.squaredNorm(), 1, 1e-7);  // the integration's error
    }
    for (int i = 0; i < 4; ++i) EXPECT_GE(v[i + 1] - v[i], -1e-9);  // rest of lzb_impact.cpp
  }
}

TEST(LzbImpact, RefusesWhatIsNoSpring) {
  const Vector w = Vector::Constant(1, -1), one = Vector::Ones(1);
  const Matrix G = Matrix::Ones(1, 1);
  EXPECT_THROW(lzb_impact({one, Vector::Zero(1), 1.5}, G, w), InputError);
  EXPECT_THROW(lzb_impact({-one, one, 1.5}, G, w), InputError);
  EXPECT_THROW(lzb_impact({one, one, 0.5}, G, w), InputError);
  EXPECT_THROW(lzb_impact({Vector::Ones(2), one, 1.5}, G, w), InputError);
}

}  // namespace
}  // namespace ricochet
