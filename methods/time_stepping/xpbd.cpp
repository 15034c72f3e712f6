// Extended position based dynamics with a velocity pass: rigid bodies as Mueller et al. (2020) have them.
//
// A step of length H has n substeps of length h = H / n, each with M, J_n, J_t at its predicted position:
//
//   v~ = v_k + h M^-1 f(q_k, v_k),   q~ = q_k + h v~                                        (1)
//   `iterations` sweeps over the contacts, constraints first, with d = q - q~ that follows each change:
//     lambda_n <- max(0, lambda_n - m (f_c(q~) + J_n' d + a lambda_n)),   m = 1 / (J_n' M^-1 J_n + a),   a = compliance / h^2   (2)
//     lambda_t <- lambda_t - (J_t' M^-1 J_t)^-1 J_t' (q - q_k),   if that is within the disc of radius mu lambda_n   (3)
//   q_{k+1} = q,   v = (q - q_k) / h = v~ + d / h                                           (4)
//   one sweep over the contacts with lambda_n > 0, v follows each change:
//     impulse against J_t' v, the smaller of what stops it and mu lambda_n / h              (5)
//     impulse that makes J_n' v the larger of 0 and -eps_r J_n' v~; eps_r = 0 where |J_n' v~| <= 2 |J_n' (v~ - v_k)|   (6)
//
// Multipliers lambda have the dimension of an impulse times h, and start at zero in each substep. A bilateral
// constraint has (2) without max(). Order 1: (4) is implicit Euler, whose loss of energy falls with the substep. What is
// pushed out of the surface gets velocity by (4), which (6) takes away again. (5) takes lambda_n for the impulse, which
// it is for a block at rest on a plane. At an impact it is the part of the approach that lies behind the surface at the end of
// the substep, on a curve it has half of the centrifugal force: friction there does not converge.
//
// Source: M. Mueller, M. Macklin, N. Chentanez, S. Jeschke, T.-Y. Kim, Detailed Rigid Body Simulation with Extended
// Position Based Dynamics, CGF 39 (2020) 101-112, sections 3.3-3.6.
// Differs from the source: 1. generalised coordinates; gaps are linearised at q~ once in each sweep, where the source
// evaluates them after each change; 2. (5) bounds an impulse, where the source bounds a change of velocity by a force
// times h, right for unit mass only; 3. (6) has the acceleration of the gap in place of gravity; 4. the impulses of
// (2) and (6) together do not pull, where the source stops a contact that has penetrated and separates; 5. contacts that
// can close are found once in each step, by (1) of sequential_contacts.h.

#include <fmt/format.h>

#include "methods/registry.h"
#include "methods/time_stepping/common/sequential_contacts.h"
#include "problems/levers.h"

namespace ricochet {
namespace {

struct XpbdOptions {
  int substeps, iterations;
  double compliance;
};

/// The steps (1)-(6) of one run.
class XpbdRun {
 public:
  XpbdRun(const Problem& problem, const Settings& settings, const XpbdOptions& options)
      : problem_(problem),
        info_(problem.info()),
        options_(options),
        run_(problem, settings),
        contacts_(run_),
        h_(run_.h / options.substeps),
        softness_(options.compliance / (h_ * h_)) {
    run_.solution.residuals.clear();  // a sweep fulfils no law
    for (auto* x : {&gap_, &lambda_n_}) x->setZero(info_.n_c());
    lambda_t_.setZero(info_.n_lambda_t);
    for (auto* x : {&v_free_, &q_free_, &d_, &q_last_}) x->setZero(info_.n_q);
    change_ = contacts_.free_change(run_.q, run_.v, h_);
  }

  Solution take_steps() {
    return run_.take_steps([&](Vector& v) {
      v = run_.v;
      if (info_.n_c() > 0) {
        change_ *= options_.substeps;  // of the substep before
        contacts_.choose(run_.q, v, change_, run_.h);
      }
      for (int s = 0; s < options_.substeps; ++s) {
        if (!substep(v)) return false;
      }
      return v.allFinite() || run_.fail("the velocity is not finite");
    });
  }

 private:
  bool substep(Vector& v) {
    if (!contacts_.set_mass(run_.q)) return false;
    change_ = contacts_.free_change(run_.q, v, h_);
    v_free_ = v + change_;
    q_free_ = run_.q + h_ * v_free_;  // (1)
    lambda_n_.setZero();
    lambda_t_.setZero();
    d_.setZero();
    if (!contacts_.list().empty()) {
      for (int k = 0; k < options_.iterations; ++k) {
        if (!correct_positions()) return false;
      }
    }
    run_.q = q_free_ + d_;
    v = v_free_ + d_ / h_;  // (4)
    for (const int i : contacts_.list()) {
      if (info_.contacts[i].is_bilateral)
        run_.Lambda_n[i] += lambda_n_[i] / h_;
      else if (lambda_n_[i] > 0)
        correct_velocity(i, v);
    }
    return true;
  }

  /// A sweep of (2), (3).
  bool correct_positions() {
    q_last_ = q_free_ + d_;
    if (!contacts_.set_position(q_last_)) return false;
    problem_.gap(q_last_.data(), gap_.data());
    for (const int i : contacts_.list()) gap_[i] -= contacts_.normal_velocity(i, d_);
    ++run_.solution.counters.inner_iterations;
    for (const int i : contacts_.list()) {
      const double gap = gap_[i] + contacts_.normal_velocity(i, d_), mass = contacts_.mass(i);
      double lambda = lambda_n_[i];
      if (mass > 0) lambda -= (gap + softness_ * lambda) / (1 / mass + softness_);
      if (!info_.contacts[i].is_bilateral) lambda = std::max(0.0, lambda);
      contacts_.push(i, lambda - lambda_n_[i], d_);
      lambda_n_[i] = lambda;
      if (contacts_.n_t(i) > 0 && lambda > 0) stick(i);
    }
    return true;
  }

  /// (3)
  void stick(int i) {
    const auto by_speed = contacts_.slip(i, v_free_), by_d = contacts_.slip(i, d_);
    const auto change = contacts_.slip_impulse(i, {h_ * by_speed[0] + by_d[0], h_ * by_speed[1] + by_d[1]});
    const int at = info_.contacts[i].tangent_index;
    std::array<double, 2> next{lambda_t_[at] - change[0], 0};
    if (contacts_.n_t(i) == 2) next[1] = lambda_t_[at + 1] - change[1];
    if (std::hypot(next[0], next[1]) > info_.contacts[i].mu * lambda_n_[i]) return;
    contacts_.push_tangent(i, {-change[0], -change[1]}, d_);
    for (int d = 0; d < contacts_.n_t(i); ++d) lambda_t_[at + d] = next[d];
  }

  /// (5), (6)
  void correct_velocity(int i, Vector& v) {
    const ContactInfo& law = info_.contacts[i];
    if (contacts_.n_t(i) > 0) {
      const auto stop = contacts_.slip_impulse(i, contacts_.slip(i, v));
      const auto impulse = in_disc({-stop[0], -stop[1]}, law.mu * lambda_n_[i] / h_);
      contacts_.push_tangent(i, impulse, v);
      for (int d = 0; d < law.n_t; ++d)
        run_.Lambda_t[law.tangent_index + d] += lambda_t_[law.tangent_index + d] / h_ + impulse[d];
    }
    const double before = contacts_.normal_velocity(i, v_free_), by_force = contacts_.normal_velocity(i, change_);
    const double eps_r = std::abs(before) <= 2 * std::abs(by_force) ? 0 : law.restitution(before);
    const double wanted = std::max(0.0, -eps_r * before), pushed = lambda_n_[i] / h_;
    const double impulse = std::max(-pushed, contacts_.mass(i) * (wanted - contacts_.normal_velocity(i, v)));
    contacts_.push(i, impulse, v);
    run_.Lambda_n[i] += pushed + impulse;
  }

  const Problem& problem_;
  const ProblemInfo& info_;
  const XpbdOptions options_;
  FixedStepRun run_;
  SequentialContacts contacts_;
  const double h_, softness_;                     // of a substep; a of (2)
  Vector gap_, lambda_n_, lambda_t_;              // of a substep
  Vector change_, v_free_, q_free_, d_, q_last_;  // h M^-1 f, v~, q~, d, where a sweep begins
};

class Xpbd final : public Method {
 public:
  explicit Xpbd(const MethodSpec& spec)
      : id_(spec.text()),
        options_{.substeps = spec.whole_number("substeps", 20, 1, 10000),
                 .iterations = spec.whole_number("iterations", 1, 1, 10000),
                 .compliance = spec.number("compliance", 0, 0, 1e300)} {}

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("XPBD, {} substeps", options_.substeps),
            .source = "Mueller et al., CGF 39 (2020) 101-112, sections 3.3-3.6",
            .order_smooth = 1,
            .order_impacts = 1,
            .is_adaptive = false,
            .has_restitution_of_speed = true,
            .is_allocation_free = true};
  }

  Support supports(const ProblemInfo& problem) const override {
    if (has_levers(problem))
      return Support::no("friction in its impacts is not bounded by their impulse, and no friction element can be");
    return Support::yes();
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return XpbdRun(problem, settings, options_).take_steps();
  }

 private:
  const std::string id_;
  const XpbdOptions options_;
};

const bool registered = register_method<Xpbd>({
    .name = "xpbd",
    .usage = "xpbd[,substeps=20][,iterations=1][,compliance=0]",
    .summary = "extended position based dynamics with a velocity pass, in substeps",
    .examples = {"xpbd", "xpbd,substeps=1,iterations=4"},
});

}  // namespace
}  // namespace ricochet
