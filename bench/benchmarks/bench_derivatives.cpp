// Evaluations of scenes: DERIVATION/SCENE/N/WHAT, N coordinates. `symbolic` are the programs that GiNaC's derivatives are
// compiled to, of all scenes; `autodiff`, beside two of them, is forward automatic differentiation by the compiler
// (Eigen::AutoDiffScalar): of a double pendulum, whose forces depend on q and v, and of two balls, whose forces are
// affine. Items are evaluations.
//
//   bench_derivatives --benchmark_filter='/force_jacobians'
#include <fmt/format.h>

#include <Eigen/Dense>  // before AutoDiff, which does not include what it needs
#include <unsupported/Eigen/AutoDiff>

#include "bench/benchmarks/benchmark_program.h"
#include "problems/registry.h"
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
void automatic_differentiation(benchmark::State& state) {
  using Dual = Eigen::AutoDiffScalar<Eigen::Vector4d>;
  const Scene<Dual> scene;
  double x[4] = {0.37, -0.21, 0.4, -1.2}, jacobian[8];
  measure(state, 1, [&] {
    benchmark::DoNotOptimize(x);
    const Vec<Dual, 2> q{Dual(x[0], 4, 0), Dual(x[1], 4, 1)}, v{Dual(x[2], 4, 2), Dual(x[3], 4, 3)};
    const auto f = scene.force(q, v);
    for (int row = 0; row < 2; ++row) Eigen::Map<Eigen::Vector4d>(jacobian + 4 * row) = f[row].derivatives();
    benchmark::DoNotOptimize(jacobian);
  });
}

/// A scene at a state, with room for what is evaluated there.
struct Evaluated {
  explicit Evaluated(std::shared_ptr<const Problem> scene)
      : problem(std::move(scene)),
        q(problem->info().q0),
        v(problem->info().v0),
        u(problem->info().u),
        vector(problem->n_q()),
        matrix(problem->n_q(), problem->n_q()),
        second(problem->n_q(), problem->n_q()),
        J_n(problem->info().n_normal_entries),
        J_t(problem->info().n_tangent_entries) {}

  std::shared_ptr<const Problem> problem;
  Vector q, v, u, vector;
  Matrix matrix, second;
  Vector J_n, J_t;
};

struct Evaluation {
  const char* what;
  void (*evaluate)(Evaluated& e);
  bool (*is_there)(const ProblemInfo& info) = [](const ProblemInfo&) { return true; };
};

constexpr Evaluation kEvaluations[] = {
    {"mass_matrix", [](Evaluated& e) { e.problem->mass_matrix(e.q.data(), e.matrix.data()); }},
    {"force", [](Evaluated& e) { e.problem->force(e.q.data(), e.v.data(), e.u.data(), e.vector.data()); }},
    {"force_jacobians",
     [](Evaluated& e) {
       e.problem->force_jacobians(e.q.data(), e.v.data(), e.u.data(), e.matrix.data(), e.second.data());
     }},
    {"contact_jacobians",
     [](Evaluated& e) {
       e.problem->normal_jacobian(e.q.data(), e.J_n.data());
       e.problem->tangent_jacobian(e.q.data(), e.J_t.data());
     },
     [](const ProblemInfo& info) { return info.n_c() > 0; }},
};

void register_scene(const std::string& name, std::shared_ptr<const Problem> problem) {
  const auto evaluated = std::make_shared<Evaluated>(std::move(problem));
  const ProblemInfo& info = evaluated->problem->info();
  for (const Evaluation& evaluation : kEvaluations) {
    if (!evaluation.is_there(info)) continue;
    const auto run = [=, &evaluation](benchmark::State& state) {
      measure(state, 1, [&] {
        evaluation.evaluate(*evaluated);
        benchmark::ClobberMemory();
      });
      set_counter(state, "contacts", evaluated->problem->n_c());
    };
    benchmark::RegisterBenchmark(fmt::format("symbolic/{}/{}/{}", name, info.n_q, evaluation.what).c_str(), run);
  }
}

void register_all() {
  register_scene("pendulum_formulas", std::make_shared<CompiledProblem<DoublePendulum>>(DoublePendulum<double>()));
  register_scene("spring_formulas", std::make_shared<CompiledProblem<TwoBalls>>(TwoBalls<double>()));
  benchmark::RegisterBenchmark("autodiff/pendulum_formulas/2/force_jacobians",
                               automatic_differentiation<DoublePendulum>);
  benchmark::RegisterBenchmark("autodiff/spring_formulas/2/force_jacobians", automatic_differentiation<TwoBalls>);
  for (const auto& scene : scenes()) register_scene(scene.id, make_problem(scene.id));
}

}  // namespace
}  // namespace ricochet

int main(int argc, char** argv) {
  ricochet::register_all();
  return ricochet::run_benchmarks(argc, argv);
}
