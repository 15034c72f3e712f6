// Why derivatives come from GiNaC: the same Jacobians by a StraightLineProgram of symbolic derivatives and by forward
// automatic differentiation (Eigen::AutoDiffScalar), on a double pendulum, whose mass matrix and forces depend on q and
// v, and on the two balls, whose forces are affine.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>  // before AutoDiff, which does not include what it needs
#include <unsupported/Eigen/AutoDiff>

#include "problems/scene.h"

namespace ricochet {
namespace {

template <class T>
struct DoublePendulum {
  static constexpr SceneText text{"double_pendulum", "double pendulum", "Lagrange's equations", "benchmark"};
  T m1{1.3}, m2{0.7}, l1{0.9}, l2{0.6}, g{9.81};
  void parameters(auto&& visit) {
    visit("m1", m1, "kg");
    visit("m2", m2, "kg");
    visit("l1", l1, "m");
    visit("l2", l2, "m");
    visit("g", g, "m/s^2");
  }
  Vec<T, 2> q0() const { return {T(0.4), T(-0.2)}; }
  Vec<T, 2> v0() const { return {T(0.3), T(-1.1)}; }
  T end_time() const { return T(1); }
  Mat<T, 2> mass(const Vec<T, 2>& q) const {
    using std::cos;
    const T c = m2 * l1 * l2 * cos(q[0] - q[1]);
    return {{{(m1 + m2) * l1 * l1, c}, {c, m2 * l2 * l2}}};
  }
  Vec<T, 2> force(const Vec<T, 2>& q, const Vec<T, 2>& v) const {
    using std::sin;
    const T s = m2 * l1 * l2 * sin(q[0] - q[1]);
    return {-s * v[1] * v[1] - (m1 + m2) * g * l1 * sin(q[0]), s * v[0] * v[0] - m2 * g * l2 * sin(q[1])};
  }
};

template <class T>
struct TwoBalls {
  static constexpr SceneText text{"two_balls", "two balls and a spring", "FESD-J, section 5.1", "benchmark"};
  T m{1.0}, g{9.81}, k{1e4}, l{1.0};
  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("g", g, "m/s^2");
    visit("k", k, "N/m");
    visit("l", l, "m");
  }
  Vec<T, 2> q0() const { return {T(1), T(2)}; }
  Vec<T, 2> v0() const { return {T(0), T(0)}; }
  T end_time() const { return T(1); }
  Vec<T, 2> mass() const { return {m, m}; }
  Vec<T, 2> force(const Vec<T, 2>& q, const Vec<T, 2>&) const {
    const T spring = k * (q[1] - q[0] - l);
    return {-m * g + spring, -m * g - spring};
  }
};

template <template <class> class Scene>
void symbolic_program(benchmark::State& state) {
  const CompiledProblem<Scene> problem{Scene<double>()};
  double q[2] = {0.37, -0.21}, v[2] = {0.4, -1.2}, f_q[4], f_v[4];
  for (auto _ : state) {
    benchmark::DoNotOptimize(q);
    problem.force_jacobians(q, v, nullptr, f_q, f_v);
    benchmark::DoNotOptimize(f_q);
    benchmark::DoNotOptimize(f_v);
  }
}

template <template <class> class Scene>
void automatic_differentiation(benchmark::State& state) {
  using Dual = Eigen::AutoDiffScalar<Eigen::Vector4d>;
  const Scene<Dual> scene;
  double x[4] = {0.37, -0.21, 0.4, -1.2}, jacobian[8];
  for (auto _ : state) {
    benchmark::DoNotOptimize(x);
    const Vec<Dual, 2> q{Dual(x[0], 4, 0), Dual(x[1], 4, 1)}, v{Dual(x[2], 4, 2), Dual(x[3], 4, 3)};
    const auto f = scene.force(q, v);
    for (int row = 0; row < 2; ++row) Eigen::Map<Eigen::Vector4d>(jacobian + 4 * row) = f[row].derivatives();
    benchmark::DoNotOptimize(jacobian);
  }
}

BENCHMARK(symbolic_program<DoublePendulum>)->Name("double pendulum, symbolic program");
BENCHMARK(automatic_differentiation<DoublePendulum>)->Name("double pendulum, Eigen::AutoDiffScalar");
BENCHMARK(symbolic_program<TwoBalls>)->Name("two balls, symbolic program");
BENCHMARK(automatic_differentiation<TwoBalls>)->Name("two balls, Eigen::AutoDiffScalar");

}  // namespace
}  // namespace ricochet

BENCHMARK_MAIN();
