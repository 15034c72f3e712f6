// A method of one's own as a plugin: symplectic Euler with Newton's law for one contact.
//   cmake -B build && cmake --build build
//   ricochet --plugin build/libmine.so run --problem bouncing_ball --method mine --steps 1000
#include <ricochet/plugin.h>

#include <Eigen/Cholesky>

using namespace ricochet;

namespace {

/// v_{k+1} = v_k + h M^-1 f(q_k, v_k), then Newton's law at a closed contact; q_{k+1} = q_k + h v_{k+1}. Order 1.
class Mine final : public Method {
 public:
  explicit Mine(const MethodSpec& spec) : id_(spec.text()) {}

  MethodInfo info() const override {
    return {.id = id_, .title = "symplectic Euler", .source = "example", .order_smooth = 1, .order_impacts = 1};
  }
  Support supports(const ProblemInfo& problem) const override {
    return problem.n_c() > 1 || problem.has_friction() ? Support::no("one frictionless contact at most")
                                                       : Support::yes();
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    Solution s;
    s.q = problem.info().q0;
    s.v = problem.info().v0;
    const double h = problem.info().end_time / settings.steps;
    for (; s.counters.steps < settings.steps; ++s.counters.steps) {
      const Eigen::LLT<Matrix> M(problem.mass_matrix(s.q));
      s.v += h * M.solve(problem.force(s.q, s.v));
      if (problem.n_c() == 1 && problem.gap(s.q)[0] <= 0) {
        const Matrix n = problem.normal_jacobian(s.q);
        const Vector Mn = M.solve(problem.force_directions(n));
        const double approach = n.col(0).dot(s.v);
        if (approach < 0) s.v -= (1 + problem.info().contacts[0].eps_r) * approach / n.col(0).dot(Mn) * Mn;
      }
      s.q += h * s.v;
    }
    s.t = problem.info().end_time;
    return s;
  }

 private:
  std::string id_;
};

}  // namespace

RICOCHET_PLUGIN() {
  register_method<Mine>({.name = "mine", .usage = "mine", .summary = "symplectic Euler", .examples = {"mine"}});
}
